//! Current state of the reports, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::doors::DoorState;
use super::gear::Gear;
use super::measure::{Measure, StatusReport};
use super::velocity::Velocity;
use crate::control_mode::ControlMode;
use crate::vehicle_report::ReportSnapshot;
use gateway_base::names::state_word;

/// A door and its state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DoorSnapshot {
    /// Name in the vehicle profile.
    pub name: String,
    /// Its state.
    pub state: DoorState,
}

/// The reports on the vehicle's status.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleStatusSnapshot {
    /// Speed and heading rate at the middle of the rear axle; `None` when the profile leaves them out.
    pub velocity: Option<ReportSnapshot<Velocity>>,
    /// Angle of the front wheels, rad, left positive; `None` when the profile leaves it out.
    pub steering: Option<ReportSnapshot<f64>>,
    /// Engaged gear; `None` when the profile leaves it out.
    pub gear: Option<ReportSnapshot<Gear>>,
    /// Who is in control; `None` when the profile leaves it out.
    pub control_mode: Option<ReportSnapshot<ControlMode>>,
    /// Doors in the order of the profile; `None` when the profile leaves them out.
    pub doors: Option<ReportSnapshot<Vec<DoorSnapshot>>>,
}

impl VehicleStatusSnapshot {
    /// Returns the reports that the profile describes, each with its value in words.
    pub fn reports(&self) -> Vec<(StatusReport, ReportSnapshot<String>)> {
        let velocity =
            self.velocity.as_ref().map(|report| report.map(|value| Measure::texts(&value.measures())));
        let steering =
            self.steering.as_ref().map(|report| report.map(|angle| Measure::TireAngle.text(*angle)));
        let gear = self.gear.as_ref().map(|report| report.map(state_word));
        let mode = self.control_mode.as_ref().map(|report| report.map(state_word));
        let doors = self.doors.as_ref().map(|report| report.map(|doors| doors_words(doors)));
        let reports = [
            (StatusReport::Velocity, velocity),
            (StatusReport::Steering, steering),
            (StatusReport::Gear, gear),
            (StatusReport::ControlMode, mode),
            (StatusReport::Doors, doors),
        ];
        reports.into_iter().filter_map(|(name, report)| Some((name, report?))).collect()
    }

    /// Returns the published measured values, in SI units.
    pub fn measures(&self) -> Vec<(Measure, f64)> {
        let velocity = self.velocity.as_ref().and_then(|report| report.published);
        let steering = self.steering.as_ref().and_then(|report| report.published);
        let velocity = velocity.iter().flat_map(|velocity| velocity.measures());
        velocity.chain(steering.map(|angle| (Measure::TireAngle, angle))).collect()
    }
}

/// Returns the states of doors in words: `all closed`, or `front left open, others closed`.
fn doors_words(doors: &[DoorSnapshot]) -> String {
    let named = |state: DoorState| -> Vec<&str> {
        doors.iter().filter(|door| door.state == state).map(|door| door.name.as_str()).collect()
    };
    // Closed comes last: it is what needs no name.
    let groups = DoorState::ALL.into_iter().filter(|state| *state != DoorState::Closed);
    let groups = groups.chain([DoorState::Closed]).map(|state| (state_word(&state), named(state)));
    let groups: Vec<_> = groups.filter(|(_, names)| !names.is_empty()).collect();
    let text = |(index, (word, names)): (usize, &(String, Vec<&str>))| {
        let is_last = index + 1 == groups.len();
        match (names.len(), groups.len()) {
            (1, 1) => format!("{} {word}", names[0]),
            (_, 1) => format!("all {word}"),
            (2.., _) if is_last => format!("others {word}"),
            _ => format!("{} {word}", names.join(", ")),
        }
    };
    groups.iter().enumerate().map(text).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(states: &[(&str, DoorState)]) -> String {
        let door =
            |(name, state): &(&str, DoorState)| DoorSnapshot { name: (*name).to_owned(), state: *state };
        doors_words(&states.iter().map(door).collect::<Vec<_>>())
    }

    #[test]
    fn doors_are_named_unless_they_are_like_all_others() {
        use DoorState::{Closed, NotAvailable, Opened};
        assert_eq!(text(&[("left", Closed), ("right", Closed)]), "all closed");
        assert_eq!(text(&[("left", Opened)]), "left open");
        assert_eq!(text(&[("left", Opened), ("right", Closed)]), "left open, right closed");
        let four = [("a", Closed), ("b", NotAvailable), ("c", Opened), ("d", Closed)];
        assert_eq!(text(&four), "b not available, c open, others closed");
    }
}
