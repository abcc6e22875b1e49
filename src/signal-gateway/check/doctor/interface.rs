//! Checks that the interfaces exist, and that each controller is set up for its use by the configuration.

use super::facts::{Facts, InterfaceFacts};
use super::row::{CheckRow, FindingRow, Outcome};
use can_signal::can::ControllerState;
use can_signal::can::interface_state::{BitTiming, ControllerSettings, InterfaceKind};
use gateway_base::diagnostics::Level;

const REPORTS: &str = "docs/troubleshooting.md#no-reports";
const LISTEN: &str = "docs/doctor.md#listen-only";
const CONTROLLERS: &str = "docs/doctor.md#controller";

/// Maximum queue length of an interface that sends commands; the kernel's default is 10. Frames that wait
/// while a bus is blocked are sent later, although they are outdated by then.
const MAX_QUEUE: u32 = 128;

const MISSING: FindingRow = FindingRow {
    name: "interface_missing",
    level: Level::Error,
    text: "{interface}: there is no interface of that name",
    why: "no frame arrives, so that all reports of this bus are withheld",
    remedy: "plug the adapter in, or correct the name, in [can.*] interface of the configuration; {there}",
    see: REPORTS,
};
const NOT_CAN: FindingRow = FindingRow {
    name: "interface_not_can",
    level: Level::Error,
    text: "{interface} is not a CAN interface",
    why: "no frame arrives, so that all reports of this bus are withheld",
    remedy: "name the right one in [can.*] interface of the configuration; {there}",
    see: REPORTS,
};
const DOWN: FindingRow = FindingRow {
    name: "interface_down",
    level: Level::Error,
    text: "{interface} is down",
    why: "no frame arrives, so that all reports of this bus are withheld",
    remedy: "bring it up: ip link set {interface} up{settings}",
    see: REPORTS,
};
const UNKNOWN: FindingRow = FindingRow {
    name: "interface_unknown",
    level: Level::Error,
    text: "{interface}: the kernel tells nothing of it: {reason}",
    why: "it cannot be used, and nothing else about it can be checked",
    remedy: "run doctor where it may use netlink: outside of a sandbox, or with AF_NETLINK allowed",
    see: REPORTS,
};

pub(super) const INTERFACE: CheckRow = CheckRow {
    name: "interface",
    asks: "Does each configured interface exist, is it a CAN interface, and is it up?",
    findings: &[&MISSING, &NOT_CAN, &DOWN, &UNKNOWN],
    judge: |facts: &Facts| {
        if facts.interfaces.is_empty() {
            return vec![Outcome::not_checked(format!("no interface is known; {}", there(facts)))];
        }
        let judge = |interface: &InterfaceFacts| {
            let name = interface.state.name.as_str();
            let found = |row: &FindingRow| row.found().with("interface", name);
            match interface.state.kind {
                InterfaceKind::Missing => found(&MISSING).with("there", there(facts)),
                InterfaceKind::NotCan => found(&NOT_CAN).with("there", there(facts)),
                InterfaceKind::Unknown(errno) => {
                    found(&UNKNOWN).with("reason", std::io::Error::from_raw_os_error(errno))
                }
                InterfaceKind::Can if interface.state.is_up => Outcome::sound(format!("{name} is up")),
                InterfaceKind::Can => found(&DOWN).with("settings", settings(interface)),
            }
        };
        facts.interfaces.iter().map(judge).collect()
    },
};

const BUS_OFF: FindingRow = FindingRow {
    name: "bus_off",
    level: Level::Error,
    text: "{interface} is bus-off",
    why: "the controller has left the bus after too many errors of its own, and neither sends nor receives",
    remedy: "find the cause, mostly a wrong bit rate, wiring or a missing terminator; then: ip link set {interface} type can restart",
    see: CONTROLLERS,
};
const ERROR_PASSIVE: FindingRow = FindingRow {
    name: "error_passive",
    level: Level::Warn,
    text: "{interface} is error-passive{counters}",
    why: "the bus is heavily disturbed, or nobody else is on it",
    remedy: "check bit rate, wiring, and the terminators of 120 ohm at both ends",
    see: CONTROLLERS,
};
const ERROR_WARNING: FindingRow = FindingRow {
    name: "error_warning",
    level: Level::Warn,
    text: "{interface} is error-warning{counters}",
    why: "the bus is disturbed; at 128 errors the controller becomes error-passive",
    remedy: "check bit rate, wiring, and the terminators of 120 ohm at both ends",
    see: CONTROLLERS,
};
const NO_RESTART: FindingRow = FindingRow {
    name: "no_restart",
    level: Level::Warn,
    text: "{interface} does not restart after bus-off (restart-ms 0)",
    why: "after one bus-off it stays silent until somebody restarts it by hand",
    remedy: "set it while the interface is down: ip link set {interface} down; ip link set {interface} type can restart-ms 100; ip link set {interface} up",
    see: CONTROLLERS,
};
const LOOPBACK: FindingRow = FindingRow {
    name: "loopback",
    level: Level::Error,
    text: "{interface} is in loopback mode",
    why: "the controller hears itself alone, and nothing of the vehicle",
    remedy: "ip link set {interface} down; ip link set {interface} type can loopback off; ip link set {interface} up",
    see: CONTROLLERS,
};

pub(super) const CONTROLLER: CheckRow = CheckRow {
    name: "controller",
    asks: "Is the controller error-active, and does it come back from bus-off by itself where it can get there?",
    findings: &[&BUS_OFF, &ERROR_PASSIVE, &ERROR_WARNING, &NO_RESTART, &LOOPBACK],
    judge: |facts: &Facts| with_controller(facts, controller),
};

fn controller(interface: &InterfaceFacts, controller: &ControllerSettings) -> Vec<Outcome> {
    let name = interface.state.name.as_str();
    let counters = controller.counters.map_or(String::new(), |counted| {
        format!(", transmit errors {}, receive errors {}", counted.tx, counted.rx)
    });
    let mut outcomes = Vec::new();
    let found = |row: &FindingRow| row.found().with("interface", name).with("counters", &counters);
    match controller.state.filter(|_| interface.state.is_up) {
        Some(ControllerState::BusOff) => outcomes.push(found(&BUS_OFF)),
        Some(ControllerState::Passive) => outcomes.push(found(&ERROR_PASSIVE)),
        Some(ControllerState::Warning) => outcomes.push(found(&ERROR_WARNING)),
        Some(ControllerState::ErrorActive | ControllerState::Restarted | ControllerState::Stopped) | None => {
        }
    }
    if controller.modes.loopback {
        outcomes.push(found(&LOOPBACK));
    }
    // A controller in listen-only mode never enters bus-off.
    if controller.restart_ms == Some(0) && !controller.modes.listen_only {
        outcomes.push(found(&NO_RESTART));
    }
    if outcomes.is_empty() {
        let state = controller.state.map_or("no state".to_owned(), |state| state.to_string());
        outcomes.push(Outcome::sound(format!("{name} is {state}{counters}")));
    }
    outcomes
}

const CAN_SEND: FindingRow = FindingRow {
    name: "listen_only_off",
    level: Level::Warn,
    text: "{interface} can send, though the configuration sends nothing",
    why: "with a wrong bit rate its error flags disturb every frame of the vehicle, and any program can send on it",
    remedy: "ip link set {interface} down; ip link set {interface} up type can{bitrate} listen-only on",
    see: LISTEN,
};
const CANNOT_SEND: FindingRow = FindingRow {
    name: "listen_only_on",
    level: Level::Error,
    text: "{interface} only listens, though the configuration sends commands on it",
    why: "no command reaches the vehicle",
    remedy: "ip link set {interface} down; ip link set {interface} up type can{bitrate} listen-only off restart-ms 100; or set [command] tx = \"off\"",
    see: LISTEN,
};

pub(super) const LISTEN_ONLY: CheckRow = CheckRow {
    name: "listen_only",
    asks: "Does an interface only listen where the configuration sends nothing, and can it send where it does?",
    findings: &[&CAN_SEND, &CANNOT_SEND],
    judge: |facts: &Facts| {
        with_controller(facts, |interface, controller| vec![listen_only(interface, controller)])
    },
};

fn listen_only(interface: &InterfaceFacts, controller: &ControllerSettings) -> Outcome {
    let name = interface.state.name.as_str();
    let bitrate = bitrate_options(controller, "");
    let found = |row: &FindingRow| row.found().with("interface", name).with("bitrate", &bitrate);
    let can_listen = controller.supported.is_none_or(|modes| modes.listen_only);
    match (interface.sends, controller.modes.listen_only) {
        (None, is_on) => {
            let state = if is_on { "it only listens" } else { "it can send" };
            Outcome::not_checked(format!("{name}: no configuration says whether commands are sent; {state}"))
        }
        (Some(true), true) => found(&CANNOT_SEND),
        (Some(false), false) if can_listen => found(&CAN_SEND),
        (Some(false), false) => Outcome::not_checked(format!("{name}: its driver has no listen-only mode")),
        (Some(true), false) => Outcome::sound(format!("{name} can send, as the configuration does")),
        (Some(false), true) => {
            Outcome::sound(format!("{name} only listens, and the configuration sends nothing"))
        }
    }
}

const LONG_QUEUE: FindingRow = FindingRow {
    name: "long_queue",
    level: Level::Warn,
    text: "{interface} queues up to {length} frames for sending",
    why: "when the bus was blocked, the outdated commands of that time are sent first",
    remedy: "ip link set {interface} txqueuelen 10",
    see: "docs/commands.md",
};

pub(super) const TRANSMIT_QUEUE: CheckRow = CheckRow {
    name: "transmit_queue",
    asks: "Is the queue of an interface that sends commands short?",
    findings: &[&LONG_QUEUE],
    judge: |facts: &Facts| {
        let sending = facts.interfaces.iter().filter(|interface| interface.sends == Some(true));
        let outcomes: Vec<_> = sending
            .filter_map(|interface| {
                let (name, length) = (interface.state.name.as_str(), interface.state.transmit_queue?);
                Some(if length > MAX_QUEUE {
                    LONG_QUEUE.found().with("interface", name).with("length", length)
                } else {
                    Outcome::sound(format!("{name} queues up to {length} frames"))
                })
            })
            .collect();
        if !outcomes.is_empty() {
            return outcomes;
        }
        // Without a configuration, it is unknown for all interfaces.
        let is_known = facts.interfaces.iter().any(|interface| interface.sends.is_some());
        vec![if is_known {
            Outcome::sound("no command is sent")
        } else {
            Outcome::not_checked("no configuration says whether commands are sent")
        }]
    },
};

/// Judges each controller; reports an interface without a controller as not checked.
fn with_controller(
    facts: &Facts,
    judge: impl Fn(&InterfaceFacts, &ControllerSettings) -> Vec<Outcome>,
) -> Vec<Outcome> {
    let judge = |interface: &InterfaceFacts| match (interface.state.kind, &interface.state.controller) {
        (InterfaceKind::Can, Some(controller)) => judge(interface, controller),
        (InterfaceKind::Can, None) => {
            vec![Outcome::not_checked(format!("{} is virtual, and has no controller", interface.state.name))]
        }
        (InterfaceKind::Missing | InterfaceKind::NotCan | InterfaceKind::Unknown(_), _) => {
            vec![Outcome::not_checked(format!("{} cannot be used", interface.state.name))]
        }
    };
    facts.interfaces.iter().flat_map(judge).collect()
}

/// Returns the settings for bringing an interface up; empty for a virtual interface, which refuses them.
fn settings(interface: &InterfaceFacts) -> String {
    let Some(controller) = &interface.state.controller else { return String::new() };
    let bitrate = bitrate_options(controller, " bitrate RATE");
    match interface.sends {
        Some(true) => format!(" type can{bitrate} restart-ms 100"),
        Some(false) | None => format!(" type can{bitrate} listen-only on"),
    }
}

/// Returns the bit rates as options of `ip link`; `unless_set` for a controller without a bit rate.
fn bitrate_options(controller: &ControllerSettings, unless_set: &str) -> String {
    let rate = |timing: BitTiming| timing.bitrate_bps;
    let nominal =
        controller.bit_timing.map(rate).map_or(unless_set.to_owned(), |rate| format!(" bitrate {rate}"));
    match controller.data_bit_timing.map(rate).filter(|_| controller.modes.fd) {
        Some(data) => format!("{nominal} dbitrate {data} fd on"),
        None => nominal,
    }
}

fn there(facts: &Facts) -> String {
    match facts.known_interfaces.as_slice() {
        [] => "there is no CAN interface at all; a virtual one: ip link add dev vcan0 type vcan".to_owned(),
        names => format!("of CAN there is {}", names.join(", ")),
    }
}
