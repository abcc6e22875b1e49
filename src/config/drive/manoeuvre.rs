//! Manoeuvres of the planner in a drive scenario.

use super::reader::{
    MAX_S, Moment, Reader, from_to, keyword, lanes, metres, moment, number, offset, place_within,
};
use crate::config::reading::fields::Fields;
use crate::config::reading::location::SourceLocation;
use crate::config::reading::value::Value;
use crate::core::map::lane_network::LaneId;
use crate::core::turn_signal::signal::Side;

/// A manoeuvre as it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Kind of the manoeuvre, with its places.
    pub kind: PlanKind,
    /// From when on the planner knows of it; `None` = from the start.
    pub known_from: Option<Moment>,
    /// Up to when; `None` = until 1 m after its end.
    pub known_to: Option<Moment>,
    /// From when on it is approved; `None` = as soon as it is known.
    pub approved_from: Option<Moment>,
    /// The planner's current lanelets; `None` = those of the way around the vehicle.
    pub lanes: Option<Vec<LaneId>>,
    /// Its place in the file.
    pub location: SourceLocation,
}

/// The kind of a manoeuvre, with places in metres along the way.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanKind {
    /// Around an obstacle and back.
    Avoidance {
        /// Ascending, at least one.
        lines: Vec<AvoidanceLine>,
    },
    /// Into the next lane.
    LaneChange {
        /// The side it changes to.
        side: Side,
        /// Place at which steering begins.
        from_m: f64,
        /// Place at which it ends.
        to_m: f64,
        /// Place at which the bound is crossed.
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
        /// Place at which it begins.
        from_m: f64,
        /// Place at which it ends.
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
        /// Place at which it begins.
        from_m: f64,
        /// Place at which it ends.
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
        /// Place at which it begins.
        from_m: f64,
        /// Place at which it ends.
        to_m: f64,
        /// Offset afterwards, metres.
        offset_m: f64,
    },
}

/// One shift of an avoidance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvoidanceLine {
    /// Place at which it begins, metres.
    pub from_m: f64,
    /// Place at which it ends, metres.
    pub to_m: f64,
    /// Offset afterwards, metres to the left.
    pub offset_m: f64,
}

impl PlanKind {
    /// Place at which its last movement ends, metres.
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
enum Keyword {
    Avoidance,
    LaneChange,
    PullOut,
    PullOver,
    SideShift,
}

const KEYWORDS: [(&str, Keyword); 5] = [
    ("avoidance", Keyword::Avoidance),
    ("lane_change", Keyword::LaneChange),
    ("pull_out", Keyword::PullOut),
    ("pull_over", Keyword::PullOver),
    ("side_shift", Keyword::SideShift),
];

/// The list `manoeuvre`.
pub(super) fn plans(reader: &mut Reader, top: &mut Fields<'_>) -> Vec<Plan> {
    top.list(reader, "manoeuvre").iter().filter_map(|value| plan(reader, value)).collect()
}

fn plan(reader: &mut Reader, value: &Value) -> Option<Plan> {
    let mut fields = Fields::of(reader, value)?;
    fields.must_have(reader, "kind")?;
    let kind = match keyword(reader, &mut fields, "kind", &KEYWORDS)? {
        Keyword::Avoidance => avoidance(reader, &mut fields),
        Keyword::LaneChange => lane_change(reader, &mut fields),
        Keyword::PullOut => pull_out(reader, &mut fields),
        Keyword::PullOver => pull_over(reader, &mut fields),
        Keyword::SideShift => side_shift(reader, &mut fields),
    };
    let known_from = moment(reader, &mut fields, ["known_from_m", "known_from_s"]);
    let known_to = moment(reader, &mut fields, ["known_to_m", "known_to_s"]);
    let approved_from = moment(reader, &mut fields, ["approved_from_m", "approved_from_s"]);
    let lanes = lanes(reader, &mut fields);
    fields.done(reader);
    Some(Plan {
        kind: kind?,
        known_from,
        known_to,
        approved_from,
        lanes,
        location: reader.source_location(&value.location),
    })
}

fn avoidance(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<PlanKind> {
    fields.must_have(reader, "lines")?;
    let given = fields.list(reader, "lines");
    let lines: Vec<_> = given.iter().filter_map(|value| line(reader, value)).collect();
    let ascends = lines.iter().zip(lines.iter().skip(1)).all(|(one, next)| one.to_m <= next.from_m);
    if lines.len() < given.len() {
        return None;
    }
    if lines.is_empty() || !ascends {
        let remedy = "give lines one after the other: [{ from_m = 50, to_m = 80, offset_m = 1.5 }]";
        reader.refuse(fields.location(), "the lines of the avoidance are none, or overlap", remedy);
        return None;
    }
    Some(PlanKind::Avoidance { lines })
}

fn line(reader: &mut Reader, value: &Value) -> Option<AvoidanceLine> {
    let mut fields = Fields::of(reader, value)?;
    let range = from_to(reader, &mut fields);
    let offset_m = offset(reader, &mut fields);
    fields.done(reader);
    let (from_m, to_m) = range?;
    Some(AvoidanceLine { from_m, to_m, offset_m: offset_m? })
}

fn lane_change(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<PlanKind> {
    fields.must_have(reader, "side");
    let side = keyword(reader, fields, "side", &[("left", Side::Left), ("right", Side::Right)]);
    let range = from_to(reader, fields);
    let crossing_m = range.and_then(|range| place_within(reader, fields, "crossing_m", range));
    let valid_path = fields.truth_or(reader, "valid_path", true);
    let special = fields.truth_or(reader, "special", false);
    let minimum_length_m = number(reader, fields, "minimum_length_m", 0.0..=1000.0, "m").unwrap_or(0.0);
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

fn pull_out(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reader, fields);
    let offset_m = offset(reader, fields);
    let backwards_until_s = number(reader, fields, "backwards_until_s", 0.0..=MAX_S, "s");
    let first_part_end_m = metres(reader, fields, "first_part_end_m");
    let (from_m, to_m) = range?;
    Some(PlanKind::PullOut { from_m, to_m, offset_m: offset_m?, backwards_until_s, first_part_end_m })
}

fn pull_over(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reader, fields);
    let offset_m = offset(reader, fields);
    let decided_from = moment(reader, fields, ["decided_from_m", "decided_from_s"]);
    let deceleration_m = metres(reader, fields, "deceleration_m");
    let stop_m = metres(reader, fields, "stop_m");
    let stop_path_end_m = metres(reader, fields, "stop_path_end_m");
    let first_part_end_m = metres(reader, fields, "first_part_end_m");
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

fn side_shift(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<PlanKind> {
    let range = from_to(reader, fields);
    let offset_m = offset(reader, fields);
    let (from_m, to_m) = range?;
    Some(PlanKind::SideShift { from_m, to_m, offset_m: offset_m? })
}
