//! The state of a simulated vehicle, in the form shown by the view.

use std::time::Duration;

use crate::report::gateway_view::{
    BusView, GatewayView, HAZARD, Lamp, Mark, RawView, ReportView, TURN, Value, caption,
};
use can_signal::can::BusIndex;
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, millis};
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::state::TurnCode;
use vehicle_bringup::simulated_vehicle::{VehicleEvent, VehicleOutput, Who};

/// Time over which the frame rate is measured.
const RATE_TIME: Duration = Duration::from_secs(1);

/// The last state of all parts reported by the vehicle.
#[derive(Debug, Clone)]
pub struct VehicleState {
    turn: Option<Turn>,
    hazard: Option<bool>,
    lights: (TurnCode, Who),
    lamps: [bool; 2],
    is_bus_off: bool,
    buses: Vec<SentFrames>,
}

#[derive(Debug, Clone)]
struct SentFrames {
    name: String,
    counted: u32,
    since: MonoTime,
    rate_hz: f64,
    /// False from a failure until the next successfully sent frame.
    can_send: bool,
}

impl VehicleState {
    /// Creates an idle vehicle on buses with these names.
    pub fn new(buses: impl IntoIterator<Item = String>) -> Self {
        let bus = |name| SentFrames { name, counted: 0, since: MonoTime::ZERO, rate_hz: 0.0, can_send: true };
        Self {
            turn: None,
            hazard: None,
            lights: (TurnCode::Off, Who::Nobody),
            lamps: [false; 2],
            is_bus_off: false,
            buses: buses.into_iter().map(bus).collect(),
        }
    }

    /// Applies an output of the vehicle.
    pub fn update(&mut self, output: &VehicleOutput, now: MonoTime) {
        match output {
            VehicleOutput::Frame { bus, .. } => self.count(*bus, now),
            VehicleOutput::Happened(event) => match event {
                VehicleEvent::Commanded { turn, hazard } => (self.turn, self.hazard) = (*turn, *hazard),
                VehicleEvent::Lights { code, who } => self.lights = (*code, *who),
                VehicleEvent::Lamps { left, right } => self.lamps = [*left, *right],
                VehicleEvent::BusOff(is_off) => self.is_bus_off = *is_off,
                VehicleEvent::CommandTimedOut { .. }
                | VehicleEvent::CommandRejected { .. }
                | VehicleEvent::NotPossible(_) => {}
            },
            VehicleOutput::Error { .. } => {}
        }
    }

    /// Records that sending on a bus fails, until a frame is sent.
    pub fn cannot_send(&mut self, bus: BusIndex) {
        if let Some(bus) = self.buses.get_mut(usize::from(bus.0)) {
            (bus.can_send, bus.counted, bus.rate_hz) = (false, 0, 0.0);
        }
    }

    fn count(&mut self, bus: BusIndex, now: MonoTime) {
        let Some(bus) = self.buses.get_mut(usize::from(bus.0)) else { return };
        bus.counted += 1;
        bus.can_send = true;
        let time = now.since(bus.since);
        if time >= RATE_TIME {
            bus.rate_hz = f64::from(std::mem::take(&mut bus.counted)) / time.as_secs_f64();
            bus.since = now;
        }
    }

    /// Returns the state at `now`.
    pub fn picture(&self, now: MonoTime) -> GatewayView {
        let (code, who) = self.lights;
        let (turn_mark, hazard_mark) = match code {
            TurnCode::Off => (Mark::Off, Mark::Off),
            TurnCode::Left => (Mark::Left, Mark::Off),
            TurnCode::Right => (Mark::Right, Mark::Off),
            TurnCode::Both => (Mark::Off, Mark::Hazard),
        };
        let lit = |is_lit: bool| if is_lit { "●" } else { "○" };
        let lamps =
            RawView { name: "lamps".to_owned(), value: self.lamps.map(lit).join(" "), ..RawView::default() };
        let by = match who {
            Who::Nobody => String::new(),
            Who::Command | Who::Driver => format!(" ({})", who.name()),
        };
        let [turn, hazard] = match code {
            TurnCode::Both => ["–".to_owned(), format!("on{by}")],
            TurnCode::Off | TurnCode::Left | TurnCode::Right => {
                [format!("{}{by}", code.name()), "off".to_owned()]
            }
        };
        let function = |key, name, commanded: Option<&str>, lights: String, mark| ReportView {
            key,
            name,
            mark,
            commanded: commanded.map(|commanded| Value::new(None, commanded)),
            reported: Value::new(None, lights),
            ..ReportView::default()
        };
        let commanded_hazard = self.hazard.map(|on| if on { "on" } else { "off" });
        GatewayView {
            stamp_ms: i64::try_from(millis(now.since(MonoTime::ZERO))).unwrap_or(i64::MAX),
            lamps: self.lamps.map(|is_lit| if is_lit { Lamp::Lit } else { Lamp::Off }),
            caption: caption(&[turn_mark, hazard_mark]).to_owned(),
            reports: vec![
                function(TURN, "turn", self.turn.map(Turn::name), turn, turn_mark),
                function(HAZARD, "hazard", commanded_hazard, hazard, hazard_mark),
            ],
            signals: vec![lamps],
            buses: self.buses.iter().map(|bus| self.bus(bus)).collect(),
            ..GatewayView::default()
        }
    }

    fn bus(&self, bus: &SentFrames) -> BusView {
        let (level, state) = match (self.is_bus_off, bus.can_send) {
            (true, _) => (Level::Error, "bus-off"),
            (false, true) => (Level::Ok, "sends"),
            (false, false) => (Level::Error, "cannot send"),
        };
        BusView::plain(bus.name.clone(), level, state, bus.rate_hz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_signal::can::{CanId, Frame};

    #[test]
    fn bus_on_which_nothing_can_be_sent_is_not_shown_as_sound_until_a_frame_is_sent() {
        let mut state = VehicleState::new(["body (can0)".to_owned()]);
        let shown = |state: &VehicleState| {
            let bus = state.picture(MonoTime::ZERO).buses.remove(0);
            (bus.state, bus.level)
        };
        state.cannot_send(BusIndex(0));
        assert_eq!(shown(&state), ("cannot send".to_owned(), Level::Error));
        let frame = Frame::classic(CanId::Standard(1), &[0]).unwrap();
        state.update(&VehicleOutput::Frame { bus: BusIndex(0), frame }, MonoTime::ZERO);
        assert_eq!(shown(&state), ("sends".to_owned(), Level::Ok));
    }
}
