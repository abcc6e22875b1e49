//! The present state of a bus, for people and programs that watch the gateway.

use serde::{Deserialize, Serialize};

use super::bus::{Bus, BusFinding, Reception};
use super::link::LinkState;
use crate::core::time::{MonoTime, millis};

/// The present state of one bus.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BusSnapshot {
    /// Name in the vehicle profile.
    pub name: String,
    /// SocketCAN interface.
    pub interface: String,
    /// Link below it: `up`, `down`, `missing`, `not_can`, `failed` or `ended`.
    pub link: String,
    /// Error number of a link that failed; `None` for any other.
    pub link_errno: Option<i32>,
    /// Reception over it: `no_link`, `nothing_yet`, `silent`, `asleep`, `losing` or `receiving`.
    pub reception: String,
    /// Its controller; `None` where none has been reported, as on a virtual bus.
    pub controller: Option<ControllerSnapshot>,
    /// Times that the controller went bus-off since start.
    pub bus_offs: u64,
    /// Frames of the vehicle profile since start.
    pub frames: u64,
    /// Frames of the vehicle profile per second, to two decimals.
    pub rate_hz: f64,
    /// Time since the last of them, ms; `None` before the first, and without a link.
    pub silence_ms: Option<u64>,
    /// Frames dropped by the kernel or by our own queue since start.
    pub drops: u64,
    /// Error frames since start.
    pub error_frames: u64,
    /// Times that the link was lost since start.
    pub link_losses: u64,
    /// Unreadable records of a recording since start.
    pub bad_records: u64,
    /// All frames on the wire, as the kernel counts them; `None` where it does not.
    pub traffic: Option<TrafficSnapshot>,
}

/// The present state of a controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerSnapshot {
    /// `error-active`, `error-warning`, `error-passive`, `bus-off`, `restarted` or `stopped`.
    pub state: String,
    /// Time in this state, ms.
    pub state_ms: u64,
    /// Transmit error counter; `None` where the driver does not give it.
    pub tx_errors: Option<u16>,
    /// Receive error counter, likewise.
    pub rx_errors: Option<u16>,
    /// Time from bus-off to an automatic restart, ms, 0 for none; `None` where it is unknown.
    pub restart_ms: Option<u32>,
}

/// All frames of an interface, those that the gateway does not need as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrafficSnapshot {
    /// Frames per second, received and sent.
    pub rate_hz: f64,
    /// Share of the time in which the bus is busy, percent: an estimate from the number of frames and bytes, without
    /// stuff bits; `None` without a bit rate, as on a virtual bus.
    pub load_percent: Option<f64>,
    /// Nominal bit rate, bit/s; `None` where there is none.
    pub bitrate_bps: Option<u32>,
}

impl BusSnapshot {
    /// The state of a bus whose frames of the vehicle profile have a rate of `rate_hz`.
    pub(in crate::core) fn of(bus: &Bus, rate_hz: f64, now: MonoTime) -> Self {
        let (settings, counts, controller) = (bus.settings(), &bus.counts, bus.controller());
        let link_errno = match bus.link() {
            LinkState::Failed(errno) => Some(errno),
            LinkState::Up | LinkState::Down | LinkState::Missing | LinkState::NotCan | LinkState::Ended => {
                None
            }
        };
        let state = controller.state().zip(controller.time_in_state(now));
        Self {
            name: settings.name.clone(),
            interface: settings.interface.clone(),
            link: bus.link().name().to_owned(),
            link_errno,
            reception: reception_name(bus.finding(now)).to_owned(),
            controller: state.map(|(state, time)| ControllerSnapshot {
                state: state.name().to_owned(),
                state_ms: millis(time),
                tx_errors: controller.counters.map(|counters| counters.tx),
                rx_errors: controller.counters.map(|counters| counters.rx),
                restart_ms: controller.restart_ms,
            }),
            bus_offs: controller.bus_offs,
            frames: counts.frames,
            rate_hz: (rate_hz * 100.0).round() / 100.0,
            silence_ms: bus.silence(now).map(millis),
            drops: counts.drops,
            error_frames: counts.error_frames,
            link_losses: counts.link_losses,
            bad_records: counts.bad_records,
            traffic: None,
        }
    }
}

/// The reception in a finding; nothing is received without a working controller.
fn reception_name(finding: BusFinding) -> &'static str {
    match finding {
        BusFinding::BusOff { .. } | BusFinding::Stopped => "silent",
        BusFinding::Disturbed(_, reception) | BusFinding::Sound(reception) => match reception {
            Reception::Link(_) => "no_link",
            Reception::NothingYet => "nothing_yet",
            Reception::Silent => "silent",
            Reception::Asleep => "asleep",
            Reception::Losing => "losing",
            Reception::Receiving => "receiving",
        },
    }
}
