//! Current state of a bus, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bus::{Bus, BusFinding, BusReception};
use super::bus_status::level;
use super::controller::ControllerReport;
use super::error_frame::{ControllerState, ErrorCounters};
use super::link::LinkState;
use gateway_base::diagnostics::Level;
use gateway_base::names::words;
use gateway_base::time::{MonoTime, millis};

/// The present state of one bus.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BusSnapshot {
    /// Name in the vehicle profile.
    pub name: String,
    /// SocketCAN interface.
    pub interface: String,
    /// Level of its diagnostic status.
    pub level: Level,
    /// Link below it.
    pub link: LinkState,
    /// Reception over it; `None` without a link.
    pub reception: Option<BusReception>,
    /// Its controller; `None` where none has been reported, as on a virtual bus.
    pub controller: Option<ControllerSnapshot>,
    /// Times that the controller went bus-off since start.
    pub bus_offs: u64,
    /// Frames of the vehicle profile since start.
    pub frames: u64,
    /// Frames of the vehicle profile per second over the last 5 s, to two decimals.
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ControllerSnapshot {
    /// Its state.
    pub state: ControllerState,
    /// Time in this state, ms.
    pub state_ms: u64,
    /// Transmit error counter; `None` where the driver does not give it.
    pub tx_errors: Option<u16>,
    /// Receive error counter; `None` where the driver does not give it.
    pub rx_errors: Option<u16>,
    /// Time from bus-off to an automatic restart, ms, 0 for none; `None` where it is unknown.
    pub restart_ms: Option<u32>,
}

/// All frames of an interface, those that the gateway does not need as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrafficSnapshot {
    /// Frames per second over the last 5 s: received and sent; on vcan, which gives back what is sent, only
    /// received.
    pub rate_hz: f64,
    /// Share of the time in which the bus is busy, percent: an estimate from the number of frames and bytes,
    /// without stuff bits; `None` without a bit rate, as on a virtual bus.
    pub load_percent: Option<f64>,
    /// Nominal bit rate, bit/s; `None` where there is none.
    pub bitrate_bps: Option<u32>,
}

impl ControllerSnapshot {
    /// Returns the part that the controller reports.
    pub fn report(&self) -> ControllerReport {
        let counters = self.tx_errors.zip(self.rx_errors).map(|(tx, rx)| ErrorCounters { tx, rx });
        ControllerReport { state: self.state, counters, restart_ms: self.restart_ms }
    }
}

impl BusSnapshot {
    /// Returns true while frames of the vehicle profile are received.
    pub fn is_receiving(&self) -> bool {
        matches!(self.reception, Some(BusReception::Receiving | BusReception::Losing))
    }

    /// Returns the link, the controller and the reception, each with its level and its state as text.
    pub fn states(&self) -> impl Iterator<Item = (Level, String)> {
        self.parts(|controller| controller.state.to_string())
    }

    /// Like `states`, but with the error counters of the controller, which change constantly.
    pub fn details(&self) -> impl Iterator<Item = (Level, String)> {
        self.parts(|controller| controller.report().to_string())
    }

    fn parts(
        &self,
        text: fn(&ControllerSnapshot) -> String,
    ) -> impl Iterator<Item = (Level, String)> + use<> {
        let link = if self.link == LinkState::Up { Level::Ok } else { Level::Error };
        let controller = self.controller.as_ref().map(|found| (found.state.level(), text(found)));
        let reception = self.reception.map(|reception| (reception.level(), words(&reception)));
        [(link, self.link.text())].into_iter().chain(controller).chain(reception)
    }

    /// Returns the worst level of these states. The diagnostic status holds a controller's state for longer.
    pub fn worst(&self) -> Level {
        self.states().map(|(level, _)| level).max().unwrap_or(Level::Ok)
    }

    /// Creates the state of a bus; `rate_hz` is the rate of frames of the vehicle profile.
    pub fn of(bus: &Bus, rate_hz: f64, now: MonoTime) -> Self {
        let (settings, counts, controller) = (bus.settings(), &bus.counts, bus.controller());
        let state = controller.state().zip(controller.time_in_state(now));
        Self {
            name: settings.name.clone(),
            interface: settings.interface.clone(),
            level: level(bus, now),
            link: bus.link(),
            reception: reception(bus.finding(now)),
            controller: state.map(|(state, time)| ControllerSnapshot {
                state,
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

/// Returns the reception in a finding; `None` without a working controller, since nothing can be received.
fn reception(finding: BusFinding) -> Option<BusReception> {
    match finding {
        BusFinding::NoLink(_) => None,
        BusFinding::BusOff { .. } | BusFinding::Stopped => Some(BusReception::Silent),
        BusFinding::Disturbed(_, reception) | BusFinding::Sound(reception) => Some(reception),
    }
}
