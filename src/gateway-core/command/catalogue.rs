//! Status messages of commands.

use gateway_base::diagnostics::{Section, messages};

messages! {
    /// What is requested of the vehicle, and whether it complies.
    FUNCTION {
        Ok sent(state, reported) "{state} sent, the vehicle reports {reported}";
        Ok dry_run(state) "{state} commanded, not sent: dry run";
        Warn no_bus(state) "{state} commanded, not sent: no frame can be sent on the bus", "Read the status of the bus.";
        Warn last_frame_failed(state) "{state} commanded, not sent: the last frame could not be sent", "Read the status `command_transmission`.";
        Ok in_effect(state, why) "{state}, {why}";
        Warn no_command() "no command received", "Start the sender, or check the topic's name.";
        Warn oscillating() "the command changes all the time: more than one sender?", "Look for a second sender on the topic.";
        Warn overdue(state, reported) "commanded {state}, but the vehicle still reports {reported}", "Wait; if it stays, it becomes an ERROR.";
        Warn no_feedback(state) "commanded {state}, and no report shows it", "Read the status of the report: it is not published.";
        Warn driver_override(state, reported) "commanded {state}, left to the driver: {reported}", "Nothing is to be done; the driver has taken over.";
        Error mismatch(state, reported) "commanded {state}, but the vehicle reports {reported}", "Check `command_transmission`, the vehicle's drive-by-wire mode, and the lamps.";
        Error timed_out(state) "the command has timed out: {state}", "Check the sender.";
        Error undefined_command(raw) "undefined command {raw} is ignored", "Correct the sender.";
        Error no_response_to_button() "no response to the hazard button", "Check the button's message; the attempts start again with the next command.";
    }
}

messages! {
    /// Whether frames go out, and in which control mode.
    TRANSMISSION {
        Ok in_control_mode(mode) "control mode {mode}";
        Ok nothing_is_sent() "dry run: nothing is sent";
        Warn mode_unknown() "control mode unknown: nothing is requested of the vehicle", "Check the topic of the control mode.";
        Warn mode_not_received(reason) "control mode unknown: nothing is requested of the vehicle ({reason})", "See also the status `control_mode`.";
        Error mode_unusable(reason) "control mode unknown: nothing is requested of the vehicle ({reason})", "The values of the signal are in [control_mode] of the profile.";
        Warn delayed() "frames are delayed", "Reduce the load of the bus, or lengthen the transmit queue.";
        Error undefined_mode(raw) "undefined control mode {raw}", "Correct the sender of the control mode.";
        Error broken() "frames cannot be sent", "Check the interface; read `queue_full` and `refused`.";
        Error cut_off(bus) "nothing can be sent on {bus}", "Read the status of the bus's interface.";
        Error conflicting_sender(message) "conflicting sender of {message}", "Find the other node that sends this message and stop it, or the gateway.";
    }
}

/// Commands to turn indicators and hazard lights.
pub static COMMAND: Section =
    Section { names: &["turn_indicators_command", "hazard_lights_command"], messages: &[FUNCTION] };

/// Transmission of commands.
pub static COMMAND_TRANSMISSION: Section =
    Section { names: &["command_transmission"], messages: &[TRANSMISSION] };
