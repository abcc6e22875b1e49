//! Claims of captions about the gateway's state.

use derive_more::Display;
use serde::Serialize;

use crate::process_status::snapshot::Snapshot;
use crate::report::lights::bulbs_text;
use gateway_base::names::variant_name;
use gateway_core::vehicle_report::ReportSnapshot;
use traffic_lights::snapshot::TrafficLightsSnapshot;
use traffic_lights::target::{LightChannel, StoreLayer};

/// An observable of the snapshot, and the name of its required value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim(pub Observed, pub &'static str);

/// The part of a snapshot to which a caption refers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum Observed {
    /// The published report on turn indicators, or `withheld`.
    #[display("the report on turn indicators")]
    TurnReport,
    /// The published report on hazard lights, or `withheld`.
    #[display("the report on hazard lights")]
    HazardReport,
    /// The kind of failure of the report on turn indicators, or `none`.
    #[display("the failure of the report on turn indicators")]
    TurnFailure,
    /// The level of the status of the report on turn indicators.
    #[display("the level of the status turn_indicators")]
    TurnLevel,
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

/// Value of an observable that is not in the snapshot.
const NOT_LISTED: &str = "not listed";

impl Observed {
    /// Returns the name of its value, as programs see it.
    pub fn value(self, snapshot: &Snapshot) -> String {
        let or_nothing = |value: Option<_>| value.as_ref().map_or("nothing", variant_name).to_owned();
        let report = snapshot.turn_indicators.as_ref();
        let command = snapshot.commands.as_ref().map(|commands| &commands.turn_indicators);
        let decision = snapshot.decider.as_ref().and_then(|decider| decider.decision.as_ref());
        let lights = snapshot.traffic_lights.as_ref();
        let value = match self {
            Self::TurnReport => report.map(published),
            Self::HazardReport => snapshot.hazard_lights.as_ref().map(published),
            Self::TurnFailure => {
                report.map(|report| report.failure.as_ref().map_or("none", variant_name).to_owned())
            }
            Self::TurnLevel => report.map(|report| report.level.to_string()),
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

fn published<T: Serialize>(report: &ReportSnapshot<T>) -> String {
    report.published.as_ref().map_or("withheld", variant_name).to_owned()
}

pub(super) fn lights(snapshot: &Snapshot) -> impl Iterator<Item = (String, String)> {
    let lights = snapshot.traffic_lights.iter().flat_map(TrafficLightsSnapshot::named_lights);
    lights.map(|(name, light)| (name, bulbs_text(&light.bulbs)))
}
