//! Disturbances in a drive scenario.

use super::reader::{DriveMoment, MAX_S, NamedLanelets, required_moment, required_seconds};
use super::route::{RoutePlan, plan};
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;

/// A disturbance of the inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Start of the disturbance.
    pub at: DriveMoment,
    /// Kind of the disturbance.
    pub kind: DisturbanceKind,
}

/// The kind of a disturbance.
#[derive(Debug, Clone, PartialEq)]
pub enum DisturbanceKind {
    /// No odometry is received.
    OdometryGap {
        /// Time that it lasts, seconds.
        for_s: f64,
    },
    /// The pose is not a number.
    NanPose {
        /// Time that it lasts, seconds.
        for_s: f64,
    },
    /// The planned path has no points.
    EmptyPath {
        /// Time that it lasts, seconds.
        for_s: f64,
    },
    /// The planner is in another scenario, such as parking.
    NotLaneDriving {
        /// Time that it lasts, seconds.
        for_s: f64,
    },
    /// The clock jumps once.
    TimeJump {
        /// Distance of the jump, seconds; negative for back.
        by_s: f64,
    },
    /// Another route is set.
    Reroute(RoutePlan),
}

/// Disturbances that last for some seconds.
const LASTING: Keywords<fn(f64) -> DisturbanceKind> = &[
    ("odometry_gap", |for_s| DisturbanceKind::OdometryGap { for_s }),
    ("nan_pose", |for_s| DisturbanceKind::NanPose { for_s }),
    ("empty_path", |for_s| DisturbanceKind::EmptyPath { for_s }),
    ("not_lane_driving", |for_s| DisturbanceKind::NotLaneDriving { for_s }),
];

/// Reads the list `disturbance`.
pub(super) fn disturbances(lanes: &NamedLanelets, top: &Fields<'_>) -> Vec<Disturbance> {
    top.tables("disturbance").filter_map(|fields| disturbance(lanes, fields)).collect()
}

fn disturbance(lanes: &NamedLanelets, fields: Fields<'_>) -> Option<Disturbance> {
    let name = fields.required_text("kind")?;
    let at = required_moment(&fields, ["at_m", "at_s"]);
    let lasting = LASTING.iter().find(|(known, _)| *known == name.text);
    let kind = match (name.text.as_str(), lasting) {
        (_, Some((_, make))) => required_seconds(&fields, "for_s").map(make),
        ("time_jump", None) => {
            let by_s = fields.required_number("by_s", -MAX_S..=MAX_S, "s");
            by_s.map(|by_s| DisturbanceKind::TimeJump { by_s })
        }
        ("reroute", None) => plan(lanes, &fields).map(DisturbanceKind::Reroute),
        _ => {
            let lasting: Vec<_> = LASTING.iter().map(|(known, _)| *known).collect();
            let remedy = format!("give one of {}, time_jump, reroute", lasting.join(", "));
            fields.refuse("kind", format!("unknown value {:?}", name.text), &remedy);
            fields.accept_rest();
            None
        }
    };
    fields.done();
    Some(Disturbance { at: at?, kind: kind? })
}
