//! Diagnostic status of one bus.

use crate::core::can::bus::{Bus, BusFinding, BusReception};
use crate::core::can::error_frame::{ControllerState, class_name};
use crate::core::can::link::LinkState;
use crate::core::diagnostics::{Level, Status};
use crate::core::time::MonoTime;

/// Diagnostic status of a bus.
pub(in crate::core) fn status(bus: &Bus, rate_hz: f64, now: MonoTime) -> Status {
    let settings = bus.settings();
    let counts = &bus.counts;
    let (level, message) = level_and_message(bus, now);
    let mut values = vec![("bus", settings.name.clone()), ("link", link_value(bus.link()))];
    controller_values(bus, now, &mut values);
    values.extend([
        ("frames", counts.frames.to_string()),
        ("rate_hz", format!("{rate_hz:.1}")),
        ("silence_ms", bus.silence(now).map_or("never".into(), |for_| for_.as_millis().to_string())),
        ("drops", counts.drops.to_string()),
        ("error_frames", counts.error_frames.to_string()),
    ]);
    if !counts.error_classes.is_empty() {
        let classes = counts.error_classes.iter().map(|(bit, n)| format!("{} {n}", class_name(*bit)));
        values.push(("error_classes", classes.collect::<Vec<_>>().join(", ")));
    }
    if let Some((error, at)) = bus.controller().last_error {
        values.push(("last_error", format!("{error} ({} s ago)", now.since(at).as_secs())));
    }
    values.push(("link_losses", counts.link_losses.to_string()));
    if counts.bad_records > 0 {
        values.push(("bad_lines", counts.bad_records.to_string()));
    }
    Status::new(&settings.interface, level, message, values)
}

impl ControllerState {
    /// Returns how bad the state is by itself.
    pub fn level(self) -> Level {
        match self {
            Self::ErrorActive => Level::Ok,
            Self::Warning | Self::Passive | Self::Restarted => Level::Warn,
            Self::BusOff | Self::Stopped => Level::Error,
        }
    }
}

/// `EPROTONOSUPPORT` and `EAFNOSUPPORT`: the kernel has no raw CAN sockets, or no CAN at all.
const NO_CAN: [i32; 2] = [93, 97];

/// Text for the state of a link.
pub fn link_text(interface: &str, state: LinkState) -> String {
    match state {
        LinkState::Up => format!("{interface} is up"),
        LinkState::Down => format!("{interface} is down"),
        LinkState::Missing => format!("{interface} is missing"),
        LinkState::NotCan => format!("{interface} is not a CAN interface"),
        LinkState::Failed(errno) if NO_CAN.contains(&errno) => {
            format!(
                "{interface} cannot be opened: this kernel has no CAN sockets (errno {errno}), try modprobe can-raw"
            )
        }
        LinkState::Failed(errno) => format!("{interface} cannot be opened (errno {errno})"),
        LinkState::Ended => format!("the recording of {interface} has ended"),
    }
}

/// Returns the level of a bus's diagnostic status.
pub(super) fn level(bus: &Bus, now: MonoTime) -> Level {
    level_and_message(bus, now).0
}

/// Level and message, the cause before its consequence and nothing that follows from it.
fn level_and_message(bus: &Bus, now: MonoTime) -> (Level, String) {
    match bus.finding(now) {
        BusFinding::NoLink(state) => (Level::Error, link_text(&bus.settings().interface, state)),
        BusFinding::BusOff { restart_ms } => (Level::Error, bus_off_text(bus, restart_ms)),
        BusFinding::Stopped => (Level::Error, "the controller has stopped: receives nothing".to_owned()),
        BusFinding::Sound(reception) => (reception.level(), reception_text(bus, reception)),
        BusFinding::Disturbed(state, reception) => {
            let text = disturbed_text(state);
            let more =
                (reception.level() > Level::Ok).then(|| format!("; {}", reception_text(bus, reception)));
            (Level::Warn, text + &more.unwrap_or_default())
        }
    }
}

fn reception_text(bus: &Bus, reception: BusReception) -> String {
    let limit = bus.settings().alive_timeout.as_millis();
    match reception {
        BusReception::NothingYet => "up, but no frame of the vehicle profile yet".to_owned(),
        BusReception::Silent => format!("up, but no frame of the vehicle profile for more than {limit} ms"),
        BusReception::Losing => "receiving, with recent drops, error frames or bad lines".to_owned(),
        BusReception::Asleep | BusReception::Receiving => reception.to_string(),
    }
}

fn bus_off_text(bus: &Bus, restart_ms: Option<u32>) -> String {
    let interface = &bus.settings().interface;
    match restart_ms {
        Some(0) => {
            format!(
                "bus-off: receives nothing, needs a manual restart: ip link set {interface} type can restart"
            )
        }
        Some(ms) => format!("bus-off: receives nothing, restarts by itself after {ms} ms"),
        None => "bus-off: receives nothing until it is restarted".to_owned(),
    }
}

fn disturbed_text(state: ControllerState) -> String {
    let more = match state {
        ControllerState::Warning => ": the bus is disturbed",
        ControllerState::Passive => ": the bus is heavily disturbed",
        ControllerState::Restarted => " after bus-off",
        ControllerState::ErrorActive | ControllerState::BusOff | ControllerState::Stopped => "",
    };
    format!("{state}{more}")
}

/// Values of the controller; none for a bus without one, such as a virtual bus.
fn controller_values(bus: &Bus, now: MonoTime, values: &mut Vec<(&'static str, String)>) {
    let controller = bus.controller();
    if let Some((state, time)) = controller.state().zip(controller.time_in_state(now)) {
        values.push(("controller", state.to_string()));
        values.push(("controller_state_s", time.as_secs().to_string()));
        let (tx, rx) = controller.counters.map_or_else(
            || ("unknown".to_owned(), "unknown".to_owned()),
            |counters| (counters.tx.to_string(), counters.rx.to_string()),
        );
        values.extend([("tx_errors", tx), ("rx_errors", rx)]);
    }
    if controller.state().is_some() || controller.bus_offs > 0 {
        values.push(("bus_off_count", controller.bus_offs.to_string()));
    }
    if let Some(ms) = controller.restart_ms {
        values.push(("restart_ms", ms.to_string()));
    }
}

fn link_value(state: LinkState) -> String {
    match state {
        LinkState::Failed(errno) => format!("failed, errno {errno}"),
        LinkState::NotCan => "not a CAN interface".to_owned(),
        LinkState::Up | LinkState::Down | LinkState::Missing | LinkState::Ended => state.to_string(),
    }
}
