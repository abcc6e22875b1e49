//! Statuses of the commands to the vehicle.

use signal_gateway::core::diagnostics::Level::{Error, Ok, Warn};

use super::{NOTHING, Task, key, message};

pub(super) fn command() -> Task {
    Task {
        names: &["turn_indicators_command", "hazard_lights_command"],
        about: "What is requested of the vehicle, why, and whether its report shows it. With a `[command]` section.",
        messages: vec![
            message(
                Ok,
                "{state} sent, the vehicle reports {state}",
                "Nothing; after `warn_after_ms` a difference is a WARN.",
            ),
            message(
                Ok,
                "{state} commanded, not sent: dry run",
                "Set `tx = \"on\"` when the dry run was looked at.",
            ),
            message(
                Warn,
                "{state} commanded, not sent: no frame can be sent on the bus",
                "Read the status of the bus.",
            ),
            message(
                Warn,
                "{state} commanded, not sent: the last frame could not be sent",
                "Read `command_transmission`.",
            ),
            message(Ok, "{state}, {reason}", NOTHING),
            message(Warn, "no command received", "Start the sender, or check the topic's name."),
            message(
                Warn,
                "the command changes all the time: more than one sender?",
                "Look for a second sender on the topic.",
            ),
            message(
                Warn,
                "commanded {state}, but the vehicle still reports {state}",
                "Wait; if it stays, it becomes an ERROR.",
            ),
            message(
                Warn,
                "commanded {state}, and no report shows it",
                "Read the status of the report: it is not published.",
            ),
            message(
                Warn,
                "commanded {state}, left to the driver: {state}",
                "Nothing; the driver has taken over.",
            ),
            message(
                Error,
                "commanded {state}, but the vehicle reports {state}",
                "Check `command_transmission`, the vehicle's drive-by-wire mode, and the lamps.",
            ),
            message(Error, "the command has timed out: {state}", "Check the sender."),
            message(Error, "undefined command {raw} is ignored", "Correct the sender."),
            message(
                Error,
                "no response to the hazard button",
                "Check the button's message; the attempts start again with the next command.",
            ),
        ],
        keys: vec![
            key("command", "-", "What the sender wants: a state, `never`, `nothing requested` or `silent`."),
            key("requested", "-", "What is requested of the vehicle: a state, or `left to the vehicle`."),
            key(
                "reason",
                "-",
                "`as commanded`, `hazard lights come first`, `the command has timed out`, `nothing requested`, \
                 `no command yet`, `not allowed in this control mode`, `left to the driver`, `no report shows whether \
                 they are on` or `the gateway ends`.",
            ),
            key("reported", "-", "`off`, `on`, `left` or `right` as the vehicle reports it, or `unknown`."),
            key("command_age_s", "s", "Age of the last command, or `-` before the first."),
            key("commands", "-", "Commands received since start."),
            key("no_command", "-", "Of these, `NO_COMMAND`."),
            key("undefined", "-", "Of these, with an undefined value."),
            key("overtaken_messages", "-", "Of these, received after a later one of the same writer."),
            key("stale_messages", "-", "Of these, made before the gateway started or too long ago."),
            key("driver_overrides", "-", "Times the driver took over."),
            key(
                "feedback_mismatches",
                "-",
                "Times the report differed from the command for `error_after_ms`.",
            ),
        ],
    }
}

pub(super) fn command_transmission() -> Task {
    Task {
        names: &["command_transmission"],
        about: "Whether command frames go out, and in which control mode. With a `[command]` section.",
        messages: vec![
            message(Ok, "control mode {mode}", NOTHING),
            message(Ok, "dry run: nothing is sent", "Set `tx = \"on\"` when the dry run was looked at."),
            message(
                Warn,
                "control mode unknown: nothing is requested of the vehicle",
                "Check the topic or the signal of the control mode.",
            ),
            message(
                Warn,
                "frames are delayed",
                "Reduce the load of the bus, or lengthen the transmit queue.",
            ),
            message(Error, "undefined control mode {raw}", "Correct the sender of the control mode."),
            message(Error, "frames cannot be sent", "Check the interface; read `queue_full` and `refused`."),
            message(Error, "nothing can be sent on {bus}", "Read the status of the bus's interface."),
            message(
                Error,
                "conflicting sender of {message}",
                "Find the other node that sends this message and stop it, or the gateway.",
            ),
        ],
        keys: vec![
            key("tx", "-", "`on`, or `off` in a dry run."),
            key("source", "-", "Who commands: `topic` or `decider`."),
            key("control_mode", "-", "Constant of `ControlModeReport`, `undefined (N)` or `unknown`."),
            key("undefined_control_modes", "-", "Control modes with an undefined value since start."),
            key("frames", "-", "Frames sent since start, by message."),
            key("with_authority", "-", "Of these, requesting something."),
            key("queue_full", "-", "Not sent: the transmit queue was full."),
            key("refused", "-", "Not sent: the kernel refused them."),
            key("echoed", "-", "Own frames received again by loopback."),
            key("foreign", "-", "Frames of these messages from another sender."),
        ],
    }
}
