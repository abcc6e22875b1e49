//! What goes wrong in a drive scenario.

use super::Moment;
use super::reading::{LONGEST_S, Reading, required, required_moment, word};
use super::route::{RoutePlan, plan};
use crate::config::values::Value;
use crate::config::values::fields::Fields;

/// Something that goes wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Trouble {
    /// When it begins.
    pub at: Moment,
    /// What it is.
    pub kind: TroubleKind,
}

/// What goes wrong; times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub enum TroubleKind {
    /// No odometry comes.
    OdometryGap {
        /// How long.
        for_s: f64,
    },
    /// The pose is no number.
    NanPose {
        /// How long.
        for_s: f64,
    },
    /// The planned path has no points.
    EmptyPath {
        /// How long.
        for_s: f64,
    },
    /// The planner does something else, such as parking.
    NotLaneDriving {
        /// How long.
        for_s: f64,
    },
    /// The clock jumps once.
    TimeJump {
        /// How far, negative back.
        by_s: f64,
    },
    /// Another route holds from then on.
    Reroute(RoutePlan),
}

#[derive(Clone, Copy)]
enum Word {
    OdometryGap,
    NanPose,
    EmptyPath,
    NotLaneDriving,
    TimeJump,
    Reroute,
}

const WORDS: [(&str, Word); 6] = [
    ("odometry_gap", Word::OdometryGap),
    ("nan_pose", Word::NanPose),
    ("empty_path", Word::EmptyPath),
    ("not_lane_driving", Word::NotLaneDriving),
    ("time_jump", Word::TimeJump),
    ("reroute", Word::Reroute),
];

/// The list `trouble`.
pub(super) fn troubles(reading: &mut Reading, top: &mut Fields<'_>) -> Vec<Trouble> {
    top.list(reading, "trouble").iter().filter_map(|value| trouble(reading, value)).collect()
}

fn trouble(reading: &mut Reading, value: &Value) -> Option<Trouble> {
    let mut fields = Fields::of(reading, value)?;
    fields.must_have(reading, "kind")?;
    let kind = word(reading, &mut fields, "kind", &WORDS)?;
    let at = required_moment(reading, &mut fields, ["at_m", "at_s"]);
    let mut lasting = |make: fn(f64) -> TroubleKind| {
        required(reading, &mut fields, "for_s", 0.0..=LONGEST_S, "s").map(make)
    };
    let kind = match kind {
        Word::OdometryGap => lasting(|for_s| TroubleKind::OdometryGap { for_s }),
        Word::NanPose => lasting(|for_s| TroubleKind::NanPose { for_s }),
        Word::EmptyPath => lasting(|for_s| TroubleKind::EmptyPath { for_s }),
        Word::NotLaneDriving => lasting(|for_s| TroubleKind::NotLaneDriving { for_s }),
        Word::TimeJump => required(reading, &mut fields, "by_s", -LONGEST_S..=LONGEST_S, "s")
            .map(|by_s| TroubleKind::TimeJump { by_s }),
        Word::Reroute => plan(reading, &mut fields).map(TroubleKind::Reroute),
    };
    fields.done(reading);
    Some(Trouble { at: at?, kind: kind? })
}
