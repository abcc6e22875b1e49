//! Disturbances of a drive scenario.

use super::reader::{MAX_S, Moment, Reader, keyword, required, required_moment};
use super::route::{RoutePlan, plan};
use crate::config::reading::fields::Fields;
use crate::config::reading::value::Value;

/// Something that goes wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Place or time at which it begins.
    pub at: Moment,
    /// Kind of the disturbance.
    pub kind: DisturbanceKind,
}

/// The kind of a disturbance; times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub enum DisturbanceKind {
    /// No odometry comes.
    OdometryGap {
        /// Duration, seconds.
        for_s: f64,
    },
    /// The pose is not a number.
    NanPose {
        /// Duration, seconds.
        for_s: f64,
    },
    /// The planned path has no points.
    EmptyPath {
        /// Duration, seconds.
        for_s: f64,
    },
    /// The planner does something else, such as parking.
    NotLaneDriving {
        /// Duration, seconds.
        for_s: f64,
    },
    /// The clock jumps once.
    TimeJump {
        /// Size of the jump, seconds, negative back.
        by_s: f64,
    },
    /// Another route holds from then on.
    Reroute(RoutePlan),
}

#[derive(Clone, Copy)]
enum Keyword {
    OdometryGap,
    NanPose,
    EmptyPath,
    NotLaneDriving,
    TimeJump,
    Reroute,
}

const KEYWORDS: [(&str, Keyword); 6] = [
    ("odometry_gap", Keyword::OdometryGap),
    ("nan_pose", Keyword::NanPose),
    ("empty_path", Keyword::EmptyPath),
    ("not_lane_driving", Keyword::NotLaneDriving),
    ("time_jump", Keyword::TimeJump),
    ("reroute", Keyword::Reroute),
];

/// The list `disturbance`.
pub(super) fn disturbances(reader: &mut Reader, top: &mut Fields<'_>) -> Vec<Disturbance> {
    top.list(reader, "disturbance").iter().filter_map(|value| disturbance(reader, value)).collect()
}

fn disturbance(reader: &mut Reader, value: &Value) -> Option<Disturbance> {
    let mut fields = Fields::of(reader, value)?;
    fields.must_have(reader, "kind")?;
    let kind = keyword(reader, &mut fields, "kind", &KEYWORDS)?;
    let at = required_moment(reader, &mut fields, ["at_m", "at_s"]);
    let mut lasting =
        |make: fn(f64) -> DisturbanceKind| required(reader, &mut fields, "for_s", 0.0..=MAX_S, "s").map(make);
    let kind = match kind {
        Keyword::OdometryGap => lasting(|for_s| DisturbanceKind::OdometryGap { for_s }),
        Keyword::NanPose => lasting(|for_s| DisturbanceKind::NanPose { for_s }),
        Keyword::EmptyPath => lasting(|for_s| DisturbanceKind::EmptyPath { for_s }),
        Keyword::NotLaneDriving => lasting(|for_s| DisturbanceKind::NotLaneDriving { for_s }),
        Keyword::TimeJump => required(reader, &mut fields, "by_s", -MAX_S..=MAX_S, "s")
            .map(|by_s| DisturbanceKind::TimeJump { by_s }),
        Keyword::Reroute => plan(reader, &mut fields).map(DisturbanceKind::Reroute),
    };
    fields.done(reader);
    Some(Disturbance { at: at?, kind: kind? })
}
