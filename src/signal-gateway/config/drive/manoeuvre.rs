//! Manoeuvres of the planner in a drive scenario.

use super::reader::{DriveMoment, MAX_S, NamedLanelets, from_to, metres, moment};
use crate::config::reading::{Fields, Keywords, SourceLocation};
use lanelet2_map::lane_network::LaneId;
use turn_signal::side::Side;

/// A manoeuvre as specified in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct ManoeuvrePlan {
    /// Kind, with its positions.
    pub kind: PlanKind,
    /// Moment from which the planner knows of it; `None` = the start.
    pub known_from: Option<DriveMoment>,
    /// Moment until which the planner knows of it; `None` = 1 m after its end.
    pub known_to: Option<DriveMoment>,
    /// Moment from which it is approved; `None` = as soon as it is known.
    pub approved_from: Option<DriveMoment>,
    /// Current lanelets of the planner; `None` = the lanelets of the route path around the vehicle.
    pub lanes: Option<Vec<LaneId>>,
    /// Position in the file.
    pub location: SourceLocation,
}

/// The kind of a manoeuvre. Positions are metres along the route path, offsets metres to the left of it.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanKind {
    /// The vehicle passes an obstacle and returns: shifts in ascending order, at least one.
    Avoidance(Vec<PlannedShift>),
    /// Lane change into the next lane.
    LaneChange {
        /// Side of the next lane.
        side: Side,
        /// Position at which the steering begins.
        from_m: f64,
        /// Position at which it ends.
        to_m: f64,
        /// Position at which the bound is crossed.
        crossing_m: f64,
        /// True if the planner has a path for it.
        valid_path: bool,
        /// True if it is not signalled while it waits.
        special: bool,
        /// Length reserved for it before the end of the lane, metres.
        minimum_length_m: f64,
    },
    /// The vehicle leaves the roadside.
    PullOut {
        /// The shift, with the offset before it.
        shift: PlannedShift,
        /// Time until which the vehicle backs up, seconds.
        backwards_until_s: Option<f64>,
        /// End of the first part of its path.
        first_part_end_m: Option<f64>,
    },
    /// The vehicle stops at the roadside.
    PullOver {
        /// The shift, with the offset after it.
        shift: PlannedShift,
        /// Moment from which its path is decided; `None` = as soon as it is known.
        decided_from: Option<DriveMoment>,
        /// Before the decision: position from which the vehicle slows down.
        deceleration_m: Option<f64>,
        /// Before the decision: position at which it would stop.
        stop_m: Option<f64>,
        /// Before the decision: end of the path, metres.
        stop_path_end_m: f64,
        /// End of the first part of its path.
        first_part_end_m: Option<f64>,
    },
    /// A shift to the side within the lane, never signalled; the offset is the offset after it.
    SideShift(PlannedShift),
}

/// A change of the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedShift {
    /// Position of its start, metres.
    pub from_m: f64,
    /// Position of its end, metres.
    pub to_m: f64,
    /// Offset at the end that is away from the route path, metres to the left.
    pub offset_m: f64,
}

impl PlanKind {
    /// Returns the end of its last movement, metres.
    pub fn end_m(&self) -> f64 {
        match self {
            Self::Avoidance(lines) => lines.last().map_or(0.0, |line| line.to_m),
            Self::LaneChange { to_m, .. } => *to_m,
            Self::PullOut { shift, .. } | Self::PullOver { shift, .. } | Self::SideShift(shift) => shift.to_m,
        }
    }
}

const KINDS: Keywords<fn(&Fields<'_>) -> Option<PlanKind>> = &[
    ("avoidance", avoidance),
    ("lane_change", lane_change),
    ("pull_out", pull_out),
    ("pull_over", pull_over),
    ("side_shift", side_shift),
];

pub(super) fn plan(lanes: &NamedLanelets, fields: &Fields<'_>) -> Option<ManoeuvrePlan> {
    fields.require(&["kind"], "");
    let kind = fields.form("kind", KINDS)?(fields);
    let known_from = moment(fields, ["known_from_m", "known_from_s"]);
    let known_to = moment(fields, ["known_to_m", "known_to_s"]);
    let approved_from = moment(fields, ["approved_from_m", "approved_from_s"]);
    let lanes = lanes.lanes(fields);
    let location = fields.checker.source_location(fields.location());
    Some(ManoeuvrePlan { kind: kind?, known_from, known_to, approved_from, lanes, location })
}

fn avoidance(fields: &Fields<'_>) -> Option<PlanKind> {
    fields.require(&["lines"], "")?;
    let given: Vec<_> = fields.tables("lines").map(|fields| fields.read_all(shift)).collect();
    let lines: Vec<_> = given.into_iter().collect::<Option<_>>()?;
    let ascends = lines.iter().zip(lines.iter().skip(1)).all(|(one, next)| one.to_m <= next.from_m);
    if lines.is_empty() || !ascends {
        let remedy = "give lines one after the other: [{ from_m = 50, to_m = 80, offset_m = 1.5 }]";
        let reason = "the avoidance has no lines, or its lines overlap";
        return fields.checker.refused(fields.location(), reason, remedy);
    }
    Some(PlanKind::Avoidance(lines))
}

fn shift(fields: &Fields<'_>) -> Option<PlannedShift> {
    let (range, offset_m) = (from_to(fields), fields.required_number("offset_m", -50.0..=50.0, "m"));
    let (from_m, to_m) = range?;
    Some(PlannedShift { from_m, to_m, offset_m: offset_m? })
}

fn lane_change(fields: &Fields<'_>) -> Option<PlanKind> {
    fields.require(&["side"], "");
    let side = fields.keyword("side", &[("left", Side::Left), ("right", Side::Right)]);
    let range = from_to(fields);
    let crossing_m = match range {
        Some((from_m, to_m)) => fields.number("crossing_m", from_m..=to_m, "m"),
        None => metres(fields, "crossing_m"),
    };
    let valid_path = fields.flag("valid_path").unwrap_or(true);
    let special = fields.flag("special").unwrap_or_default();
    let minimum_length_m = fields.number("minimum_length_m", 0.0..=1000.0, "m").unwrap_or(0.0);
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

fn pull_out(fields: &Fields<'_>) -> Option<PlanKind> {
    let shift = shift(fields);
    let backwards_until_s = fields.number("backwards_until_s", 0.0..=MAX_S, "s");
    let first_part_end_m = metres(fields, "first_part_end_m");
    Some(PlanKind::PullOut { shift: shift?, backwards_until_s, first_part_end_m })
}

fn pull_over(fields: &Fields<'_>) -> Option<PlanKind> {
    let shift = shift(fields);
    let decided_from = moment(fields, ["decided_from_m", "decided_from_s"]);
    let [deceleration_m, stop_m, stop_path_end_m, first_part_end_m] =
        ["deceleration_m", "stop_m", "stop_path_end_m", "first_part_end_m"].map(|key| metres(fields, key));
    let shift = shift?;
    Some(PlanKind::PullOver {
        shift,
        decided_from,
        deceleration_m,
        stop_m,
        stop_path_end_m: stop_path_end_m.unwrap_or(shift.to_m),
        first_part_end_m,
    })
}

fn side_shift(fields: &Fields<'_>) -> Option<PlanKind> {
    shift(fields).map(PlanKind::SideShift)
}
