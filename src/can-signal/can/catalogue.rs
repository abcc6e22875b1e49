//! Messages of an interface's status, and the messages of other statuses about its link.

use gateway_base::diagnostics::{Section, messages};

messages! {
    /// Why nothing is received over an interface.
    LINK {
        Error link_down(interface) "{interface} is down", "Set the interface up.";
        Error link_missing(interface) "{interface} is missing", "Plug in the adapter, or correct `interface`.";
        Error not_can(interface) "{interface} is not a CAN interface", "Correct `interface`.";
        Error cannot_be_opened(interface, errno) "{interface} cannot be opened (errno {errno})", "Check the driver and the rights of the service.";
        Error no_can_sockets(interface, errno) "{interface} cannot be opened: this kernel has no CAN sockets (errno {errno}), try modprobe can-raw", "Load the kernel's modules, also the module of the adapter.";
        Error recording_ended(interface) "the recording of {interface} has ended", "Nothing is to be done; a recording is not repeated.";
    }
}

messages! {
    /// The state of the controller, and what is received.
    BUS {
        Ok receiving() "receiving";
        Ok asleep() "asleep";
        Warn nothing_yet() "up, but no frame of the vehicle profile yet", "Check ignition, bit rate, and whether this is the profile's bus.";
        Warn silent(limit) "up, but no frame of the vehicle profile for more than {limit} ms", "Check ignition and wiring.";
        Warn losing() "receiving, with recent drops, error frames or bad lines", "Read `drops`, `error_frames`, `error_classes` and `bad_lines`.";
        Warn error_warning() "error-warning: the bus is disturbed", "Check wiring, termination, bit rate and the other nodes of the bus.";
        Warn error_passive() "error-passive: the bus is heavily disturbed", "Check wiring, termination, bit rate and the other nodes of the bus.";
        Warn restarted() "restarted after bus-off", "Wait for the next frame, which ends it.";
        Error bus_off_until_restart(interface) "bus-off: receives nothing, needs a manual restart: ip link set {interface} type can restart", "Find the cause, then run the command; `restart-ms` does it by itself.";
        Error bus_off_restarting(time) "bus-off: receives nothing, restarts by itself after {time} ms", "Check wiring, termination, bit rate and the other nodes of the bus.";
        Error bus_off() "bus-off: receives nothing until it is restarted", "Check wiring, termination, bit rate and the other nodes of the bus.";
        Error stopped() "the controller has stopped: receives nothing", "Set the interface down and up again; check the adapter.";
    }
}

/// One CAN interface.
pub static INTERFACE: Section = Section { names: &["{interface}"], messages: &[BUS, LINK] };
