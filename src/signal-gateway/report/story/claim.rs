//! Claims of captions about the gateway's state.

use derive_more::Display;

use crate::process_status::snapshot::Snapshot;
use crate::report::lights::bulbs_text;
use gateway_base::names::variant_name;
use gateway_core::vehicle_report::ReportSnapshot;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::doors::{DoorState, doors_text};
use traffic_lights::snapshot::TrafficLightsSnapshot;
use traffic_lights::target::{LightChannel, StoreLayer};

/// An observable of the snapshot, and the name of its required value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim(pub Observed, pub &'static str);

/// The part of a snapshot to which a caption refers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum Observed {
    /// The published value of a report, or `withheld`. Of measured values the direction: `forward`,
    /// `backward`, `standing`; `left`, `right`, `straight`. Of doors those that are not closed, or `closed`.
    #[display("the report {_0}")]
    Report(ClaimedReport),
    /// The kind of failure of a report, or `none`.
    #[display("the failure of the report {_0}")]
    Failure(ClaimedReport),
    /// The level of the status of a report.
    #[display("the level of the status {_0}")]
    Level(ClaimedReport),
    /// The turn signal of the decider.
    #[display("the decision")]
    Decided,
    /// The turn command without intervention of the driver, or `nothing`.
    #[display("the turn command")]
    Commanded,
    /// The turn signal that is requested of the vehicle, or `nothing`.
    #[display("the request to the vehicle")]
    Requested,
    /// The comparison of the reported turn signal with the command.
    #[display("the compliance with the turn command")]
    Compliance,
    /// The level of the status of the turn command.
    #[display("the level of the status turn_indicators_command")]
    CommandLevel,
    /// The bulbs of a light, by its way id; `dark`, or `not listed`.
    #[display("light {_0} of the channel {}, {}", _1.name(), variant_name(_2))]
    Light(i64, LightChannel, StoreLayer),
    /// The phase of a controller, by its name.
    #[display("the phase of {_0}")]
    Phase(&'static str),
}

/// A report of the vehicle; its text is the name of its diagnostic task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum ClaimedReport {
    /// The report on turn indicators.
    #[display("turn_indicators")]
    TurnIndicators,
    /// The report on hazard lights.
    #[display("hazard_lights")]
    HazardLights,
    /// A report on the vehicle's status.
    #[display("{}", _0.name())]
    Status(StatusReport),
}

/// Angle of the front wheels above which the steering is not straight, rad; 1 degree.
const STEERING_RAD: f64 = 0.0175;

impl ClaimedReport {
    /// Returns the report with the name of its value; `None` if the profile leaves it out.
    fn named(self, snapshot: &Snapshot) -> Option<ReportSnapshot<String>> {
        fn sign(value: f64, least: f64, [above, below, otherwise]: [&str; 3]) -> String {
            let name = if value > least {
                above
            } else if value < -least {
                below
            } else {
                otherwise
            };
            name.to_owned()
        }
        let status = &snapshot.vehicle_status;
        match self {
            Self::TurnIndicators => {
                Some(snapshot.turn_indicators.as_ref()?.map(|turn| turn.name().to_owned()))
            }
            Self::HazardLights => {
                Some(snapshot.hazard_lights.as_ref()?.map(|hazard| hazard.name().to_owned()))
            }
            Self::Status(StatusReport::Velocity) => {
                let names = ["forward", "backward", "standing"];
                Some(status.velocity.as_ref()?.map(|velocity| sign(velocity.longitudinal_mps, 0.0, names)))
            }
            Self::Status(StatusReport::Steering) => {
                let names = ["left", "right", "straight"];
                Some(status.steering.as_ref()?.map(|angle| sign(*angle, STEERING_RAD, names)))
            }
            Self::Status(StatusReport::Gear) => {
                Some(status.gear.as_ref()?.map(|gear| gear.name().to_owned()))
            }
            Self::Status(StatusReport::ControlMode) => {
                Some(status.control_mode.as_ref()?.map(|mode| mode.name().to_owned()))
            }
            Self::Status(StatusReport::Doors) => Some(status.doors.as_ref()?.map(|doors| {
                let open = doors.iter().filter(|door| door.state != DoorState::Closed);
                let open = doors_text(open.map(|door| (door.name.as_str(), door.state)));
                if open.is_empty() { "closed".to_owned() } else { open }
            })),
        }
    }
}

/// Value of an observable that is not in the snapshot.
const NOT_LISTED: &str = "not listed";

impl Observed {
    /// Returns the name of its value, as programs see it.
    pub fn value(self, snapshot: &Snapshot) -> String {
        let or_nothing = |value: Option<_>| value.as_ref().map_or("nothing", variant_name).to_owned();
        let command = snapshot.commands.as_ref().map(|commands| &commands.turn_indicators);
        let decision = snapshot.decider.as_ref().and_then(|decider| decider.decision.as_ref());
        let lights = snapshot.traffic_lights.as_ref();
        let value = match self {
            Self::Report(report) => {
                report.named(snapshot).map(|report| report.published.unwrap_or_else(|| "withheld".to_owned()))
            }
            Self::Failure(report) => report
                .named(snapshot)
                .map(|report| report.failure.as_ref().map_or("none", variant_name).to_owned()),
            Self::Level(report) => report.named(snapshot).map(|report| report.level.to_string()),
            Self::Decided => decision.map(|decision| variant_name(&decision.turn).to_owned()),
            Self::Commanded => command.map(|turn| or_nothing(turn.commanded)),
            Self::Requested => command.map(|turn| or_nothing(turn.requested)),
            Self::Compliance => command.map(|turn| variant_name(&turn.compliance).to_owned()),
            Self::CommandLevel => command.map(|turn| turn.level.to_string()),
            Self::Light(id, channel, layer) => lights.and_then(|lights| {
                let channel = lights.channels.iter().find(|listed| listed.channel == channel)?;
                let light = channel.states.iter().find(|light| light.id == id && light.layer == layer)?;
                Some(bulbs_text(&light.bulbs))
            }),
            Self::Phase(name) => lights.and_then(|lights| {
                lights.controllers.iter().find(|controller| controller.name == name)?.phase.clone()
            }),
        };
        value.unwrap_or_else(|| NOT_LISTED.to_owned())
    }
}

pub(super) fn lights(snapshot: &Snapshot) -> impl Iterator<Item = (String, String)> {
    let lights = snapshot.traffic_lights.iter().flat_map(TrafficLightsSnapshot::named_lights);
    lights.map(|(name, light)| (name, bulbs_text(&light.bulbs)))
}
