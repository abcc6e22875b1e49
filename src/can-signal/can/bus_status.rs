//! Diagnostic status of one bus.

use super::catalogue::{self, INTERFACE};
use crate::can::bus::{Bus, BusFinding, BusReception};
use crate::can::error_frame::{ControllerState, class_name};
use crate::can::link::LinkState;
use gateway_base::diagnostics::{Level, MessagePart, Status};
use gateway_base::time::MonoTime;

/// Diagnostic status of a bus.
pub fn status(bus: &Bus, rate_hz: f64, now: MonoTime) -> Status {
    let settings = bus.settings();
    let counts = &bus.counts;
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
    Status::new(&INTERFACE, &settings.interface, &message(bus, now), values)
}

impl ControllerState {
    /// Returns the level of this link state alone.
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
    link_message(interface, state).map_or_else(|| format!("{interface} is up"), |message| message.text)
}

/// Message for a link over which nothing is received; `None` if it is up.
pub fn link_message(interface: &str, state: LinkState) -> Option<MessagePart> {
    Some(match state {
        LinkState::Up => return None,
        LinkState::Down => catalogue::link_down(interface),
        LinkState::Missing => catalogue::link_missing(interface),
        LinkState::NotCan => catalogue::not_can(interface),
        LinkState::Failed(errno) if NO_CAN.contains(&errno) => catalogue::no_can_sockets(interface, errno),
        LinkState::Failed(errno) => catalogue::cannot_be_opened(interface, errno),
        LinkState::Ended => catalogue::recording_ended(interface),
    })
}

/// Returns the level of a bus's diagnostic status.
pub(super) fn level(bus: &Bus, now: MonoTime) -> Level {
    message(bus, now).iter().map(MessagePart::level).max().unwrap_or_default()
}

/// Returns the message in parts: the cause before its consequence, without parts that follow from others.
fn message(bus: &Bus, now: MonoTime) -> Vec<MessagePart> {
    match bus.finding(now) {
        BusFinding::NoLink(state) => link_message(&bus.settings().interface, state).into_iter().collect(),
        BusFinding::BusOff { restart_ms } => vec![bus_off_message(bus, restart_ms)],
        BusFinding::Stopped => vec![catalogue::stopped()],
        BusFinding::Sound(reception) => vec![reception_message(bus, reception)],
        BusFinding::Disturbed(state, reception) => {
            let state = match state {
                ControllerState::Warning => catalogue::error_warning(),
                ControllerState::Passive => catalogue::error_passive(),
                ControllerState::Restarted
                | ControllerState::ErrorActive
                | ControllerState::BusOff
                | ControllerState::Stopped => catalogue::restarted(),
            };
            let reception = (reception.level() > Level::Ok).then(|| reception_message(bus, reception));
            [state].into_iter().chain(reception).collect()
        }
    }
}

fn reception_message(bus: &Bus, reception: BusReception) -> MessagePart {
    match reception {
        BusReception::NothingYet => catalogue::nothing_yet(),
        BusReception::Silent => catalogue::silent(bus.settings().alive_timeout.as_millis()),
        BusReception::Losing => catalogue::losing(),
        BusReception::Asleep => catalogue::asleep(),
        BusReception::Receiving => catalogue::receiving(),
    }
}

fn bus_off_message(bus: &Bus, restart_ms: Option<u32>) -> MessagePart {
    match restart_ms {
        Some(0) => catalogue::bus_off_until_restart(&bus.settings().interface),
        Some(ms) => catalogue::bus_off_restarting(ms),
        None => catalogue::bus_off(),
    }
}

/// Adds the values of the controller; nothing for a bus without a controller, such as a virtual bus.
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
