//! The state of the vehicle from its own signals, and the hazard lights that it requests
//! (docs/spec/turn-signal-decider.md, "Hazard lights").

use derive_more::Display;

/// Below this speed the vehicle stands, m/s.
const STANDSTILL_MPS: f64 = 0.1;

/// State of the vehicle, as far as its signals provide it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VehicleState {
    /// Speed, m/s, negative backwards.
    pub speed_mps: Option<f64>,
    /// True in park.
    pub is_parked: Option<bool>,
    /// True in reverse gear.
    pub is_in_reverse: Option<bool>,
    /// True unless every door is closed.
    pub has_open_door: Option<bool>,
    /// True while the driver is in control.
    pub is_manual: Option<bool>,
}

/// Use of the state of the vehicle; unused by default.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct VehicleUse {
    /// The speed is taken from the vehicle's signals if available, otherwise from the odometry.
    pub takes_speed: bool,
    /// The states in which hazard lights are on.
    pub hazards: Vec<VehicleHazard>,
}

/// A state of the vehicle that requests hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum VehicleHazard {
    /// A door is open while the vehicle stands, but not in park.
    #[display("a door is open at standstill")]
    OpenDoor,
    #[display("reverse gear is engaged")]
    Reverse,
}

impl VehicleHazard {
    /// Returns whether the hazard lights are requested; `None` while a deciding signal is unknown. A driver
    /// in control operates them himself.
    pub fn asks(self, vehicle: &VehicleState) -> Option<bool> {
        let not = |is: Option<bool>| is.map(|is| !is);
        let is_driven = if vehicle.is_manual == Some(true) { Some(false) } else { Some(true) };
        let is_standing = vehicle.speed_mps.map(|speed| speed.abs() < STANDSTILL_MPS);
        match self {
            Self::OpenDoor => all([is_driven, vehicle.has_open_door, is_standing, not(vehicle.is_parked)]),
            Self::Reverse => all([is_driven, vehicle.is_in_reverse]),
        }
    }
}

/// Returns false if any condition is false; otherwise `None` if any is unknown.
fn all<const COUNT: usize>(conditions: [Option<bool>; COUNT]) -> Option<bool> {
    if conditions.contains(&Some(false)) {
        return Some(false);
    }
    (!conditions.contains(&None)).then_some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_door_asks_at_standstill_outside_park_and_not_for_a_driver() {
        let stop = VehicleState {
            speed_mps: Some(0.0),
            is_parked: Some(false),
            is_in_reverse: Some(false),
            has_open_door: Some(true),
            is_manual: None,
        };
        let cases = [
            (stop, Some(true)),
            (VehicleState { speed_mps: Some(-0.11), ..stop }, Some(false)),
            (VehicleState { speed_mps: None, ..stop }, None),
            (VehicleState { is_parked: Some(true), ..stop }, Some(false)),
            (VehicleState { is_parked: None, ..stop }, None),
            (VehicleState { has_open_door: None, ..stop }, None),
            (VehicleState { has_open_door: None, is_parked: Some(true), ..stop }, Some(false)),
            (VehicleState { is_manual: Some(true), ..stop }, Some(false)),
            (VehicleState { is_manual: Some(false), ..stop }, Some(true)),
        ];
        for (vehicle, expected) in cases {
            assert_eq!(VehicleHazard::OpenDoor.asks(&vehicle), expected, "{vehicle:?}");
        }
        let reverse = VehicleState { is_in_reverse: Some(true), speed_mps: None, ..stop };
        assert_eq!(VehicleHazard::Reverse.asks(&reverse), Some(true));
        assert_eq!(VehicleHazard::Reverse.asks(&stop), Some(false));
        assert_eq!(VehicleHazard::Reverse.asks(&VehicleState::default()), None);
    }
}
