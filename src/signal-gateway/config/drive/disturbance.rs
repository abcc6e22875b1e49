//! Disturbances in a drive scenario.

use super::reader::{DriveMoment, MAX_S, NamedLanelets, required_moment, required_seconds};
use super::route::{RoutePlan, plan};
use crate::config::reading::{Fields, Keywords};

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
    /// A gap in the inputs that lasts for some seconds.
    Gap(GapKind, f64),
    /// The clock jumps once by these seconds; negative for back.
    TimeJump(f64),
    /// A different route is set.
    Reroute(RoutePlan),
}

/// The inputs affected by a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GapKind {
    /// No odometry is received.
    OdometryGap,
    /// The pose is not a number.
    NanPose,
    /// The planned path has no points.
    EmptyPath,
    /// The planner is in another scenario, such as parking.
    NotLaneDriving,
}

const GAPS: Keywords<GapKind> = &[
    ("odometry_gap", GapKind::OdometryGap),
    ("nan_pose", GapKind::NanPose),
    ("empty_path", GapKind::EmptyPath),
    ("not_lane_driving", GapKind::NotLaneDriving),
];

pub(super) fn disturbance(lanes: &NamedLanelets, fields: &Fields<'_>) -> Option<Disturbance> {
    let Some(name) = fields.required_text("kind") else {
        fields.accept_rest();
        return None;
    };
    let at = required_moment(fields, ["at_m", "at_s"]);
    let gap = GAPS.iter().find(|(known, _)| *known == name.text);
    let kind = match (name.text.as_str(), gap) {
        (_, Some((_, gap))) => {
            required_seconds(fields, "for_s").map(|for_s| DisturbanceKind::Gap(*gap, for_s))
        }
        ("time_jump", None) => {
            fields.required_number("by_s", -MAX_S..=MAX_S, "s").map(DisturbanceKind::TimeJump)
        }
        ("reroute", None) => plan(lanes, fields).map(DisturbanceKind::Reroute),
        _ => {
            let gaps: Vec<_> = GAPS.iter().map(|(known, _)| *known).collect();
            let remedy = format!("give one of {}, time_jump, reroute", gaps.join(", "));
            fields.refuse("kind", format!("unknown value {:?}", name.text), &remedy);
            fields.accept_rest();
            None
        }
    };
    Some(Disturbance { at: at?, kind: kind? })
}
