//! What the planner does in a drive scenario.

use super::Moment;
use super::reading::{LONGEST_S, Reading, metres, moment, number, word};
use super::setting::{from_to, lanes, offset, place_within};
use crate::config::values::Value;
use crate::config::values::fields::Fields;
use crate::config::values::place::Place;
use crate::core::turn_signal::road::LaneId;
use crate::core::turn_signal::signal::Side;

/// A manoeuvre as it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Which.
    pub kind: PlanKind,
    /// From when on the planner knows of it; `None` = from the start.
    pub known_from: Option<Moment>,
    /// Up to when; `None` = until 1 m after its end.
    pub known_to: Option<Moment>,
    /// From when on it is approved; `None` = as soon as it is known.
    pub approved_from: Option<Moment>,
    /// The planner's current lanelets; `None` = those of the way around the vehicle.
    pub lanes: Option<Vec<LaneId>>,
    /// Where it stands.
    pub place: Place,
}

/// Which manoeuvre, by places on the way, metres.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanKind {
    /// Around an obstacle and back.
    Avoidance {
        /// Ascending, at least one.
        lines: Vec<AvoidanceLine>,
    },
    /// Into the next lane.
    LaneChange {
        /// Which way.
        side: Side,
        /// Where steering begins.
        from_m: f64,
        /// Where it ends.
        to_m: f64,
        /// Where the bound is crossed.
        crossing_m: f64,
        /// The planner has a path for it.
        valid_path: bool,
        /// Not signalled while it waits.
        special: bool,
        /// Length kept for it before the lane ends.
        minimum_length_m: f64,
    },
    /// From the roadside.
    PullOut {
        /// Where it begins.
        from_m: f64,
        /// Where it ends.
        to_m: f64,
        /// Where the vehicle stands before, metres to the left of the way.
        offset_m: f64,
        /// It backs up until then, seconds.
        backwards_until_s: Option<f64>,
        /// The first part of its path ends there.
        first_part_end_m: Option<f64>,
    },
    /// To the roadside.
    PullOver {
        /// Where it begins.
        from_m: f64,
        /// Where it ends.
        to_m: f64,
        /// Where the vehicle stands afterwards, metres to the left of the way.
        offset_m: f64,
        /// From when on its path is decided; `None` = as soon as it is known.
        decided_from: Option<Moment>,
        /// Before that: the vehicle slows down from here on.
        deceleration_m: Option<f64>,
        /// Before that: it would stop here.
        stop_m: Option<f64>,
        /// Before that: the path ends here.
        stop_path_end_m: f64,
        /// The first part of its path ends there.
        first_part_end_m: Option<f64>,
    },
    /// To the side within the lane, never signalled.
    SideShift {
        /// Where it begins.
        from_m: f64,
        /// Where it ends.
        to_m: f64,
        /// Offset afterwards, metres.
        offset_m: f64,
    },
}

/// One shift of an avoidance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvoidanceLine {
    /// Where it begins, metres.
    pub from_m: f64,
    /// Where it ends, metres.
    pub to_m: f64,
    /// Offset afterwards, metres to the left.
    pub offset_m: f64,
}

impl PlanKind {
    /// Where its last movement ends, metres.
    pub fn end_m(&self) -> f64 {
        match self {
            Self::Avoidance { lines } => lines.last().map_or(0.0, |line| line.to_m),
            Self::LaneChange { to_m, .. }
            | Self::PullOut { to_m, .. }
            | Self::PullOver { to_m, .. }
            | Self::SideShift { to_m, .. } => *to_m,
        }
    }
}

#[derive(Clone, Copy)]
enum Word {
    Avoidance,
    LaneChange,
    PullOut,
    PullOver,
    SideShift,
}

const WORDS: [(&str, Word); 5] = [
    ("avoidance", Word::Avoidance),
    ("lane_change", Word::LaneChange),
    ("pull_out", Word::PullOut),
    ("pull_over", Word::PullOver),
    ("side_shift", Word::SideShift),
];

/// The list `manoeuvre`.
pub(super) fn plans(reading: &mut Reading, top: &mut Fields<'_>) -> Vec<Plan> {
    top.list(reading, "manoeuvre").iter().filter_map(|value| plan(reading, value)).collect()
}

fn plan(reading: &mut Reading, value: &Value) -> Option<Plan> {
    let mut fields = Fields::of(reading, value)?;
    fields.must_have(reading, "kind")?;
    let kind = match word(reading, &mut fields, "kind", &WORDS)? {
        Word::Avoidance => avoidance(reading, &mut fields),
        Word::LaneChange => lane_change(reading, &mut fields),
        Word::PullOut => pull_out(reading, &mut fields),
        Word::PullOver => pull_over(reading, &mut fields),
        Word::SideShift => side_shift(reading, &mut fields),
    };
    let known_from = moment(reading, &mut fields, ["known_from_m", "known_from_s"]);
    let known_to = moment(reading, &mut fields, ["known_to_m", "known_to_s"]);
    let approved_from = moment(reading, &mut fields, ["approved_from_m", "approved_from_s"]);
    let lanes = lanes(reading, &mut fields);
    fields.done(reading);
    Some(Plan { kind: kind?, known_from, known_to, approved_from, lanes, place: reading.place(&value.spot) })
}

fn avoidance(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<PlanKind> {
    fields.must_have(reading, "lines")?;
    let given = fields.list(reading, "lines");
    let lines: Vec<_> = given.iter().filter_map(|value| line(reading, value)).collect();
    let ascends = lines.iter().zip(lines.iter().skip(1)).all(|(one, next)| one.to_m <= next.from_m);
    if lines.len() < given.len() {
        return None;
    }
    if lines.is_empty() || !ascends {
        let remedy = "give lines one after the other: [{ from_m = 50, to_m = 80, offset_m = 1.5 }]";
        reading.refuse(fields.spot(), "the lines of the avoidance are none, or overlap", remedy);
        return None;
    }
    Some(PlanKind::Avoidance { lines })
}

fn line(reading: &mut Reading, value: &Value) -> Option<AvoidanceLine> {
    let mut fields = Fields::of(reading, value)?;
    let range = from_to(reading, &mut fields);
    let offset_m = offset(reading, &mut fields);
    fields.done(reading);
    let (from_m, to_m) = range?;
    Some(AvoidanceLine { from_m, to_m, offset_m: offset_m? })
}

fn lane_change(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<PlanKind> {
    fields.must_have(reading, "side");
    let side = word(reading, fields, "side", &[("left", Side::Left), ("right", Side::Right)]);
    let range = from_to(reading, fields);
    let crossing_m = range.and_then(|range| place_within(reading, fields, "crossing_m", range));
    let valid_path = fields.truth_or(reading, "valid_path", true);
    let special = fields.truth_or(reading, "special", false);
    let minimum_length_m = number(reading, fields, "minimum_length_m", 0.0..=1000.0, "m").unwrap_or(0.0);
    let (from_m, to_m) = range?;
    Some(PlanKind::LaneChange {
        side: side?,
        from_m,
        to_m,
        crossing_m: crossing_m.unwrap_or(f64::midpoint(from_m, to_m)),
        valid_path,
        special,
        minimum_length_m,
    })
}

fn pull_out(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reading, fields);
    let offset_m = offset(reading, fields);
    let backwards_until_s = number(reading, fields, "backwards_until_s", 0.0..=LONGEST_S, "s");
    let first_part_end_m = metres(reading, fields, "first_part_end_m");
    let (from_m, to_m) = range?;
    Some(PlanKind::PullOut { from_m, to_m, offset_m: offset_m?, backwards_until_s, first_part_end_m })
}

fn pull_over(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reading, fields);
    let offset_m = offset(reading, fields);
    let decided_from = moment(reading, fields, ["decided_from_m", "decided_from_s"]);
    let deceleration_m = metres(reading, fields, "deceleration_m");
    let stop_m = metres(reading, fields, "stop_m");
    let stop_path_end_m = metres(reading, fields, "stop_path_end_m");
    let first_part_end_m = metres(reading, fields, "first_part_end_m");
    let (from_m, to_m) = range?;
    Some(PlanKind::PullOver {
        from_m,
        to_m,
        offset_m: offset_m?,
        decided_from,
        deceleration_m,
        stop_m,
        stop_path_end_m: stop_path_end_m.unwrap_or(to_m),
        first_part_end_m,
    })
}

fn side_shift(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reading, fields);
    let offset_m = offset(reading, fields);
    let (from_m, to_m) = range?;
    Some(PlanKind::SideShift { from_m, to_m, offset_m: offset_m? })
}
