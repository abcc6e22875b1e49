//! Where each side is to be shown in a drive, from its file and its map alone, without any decider.

use std::ops::Range;

use lanelet2_map::fork::leads_left;
use lanelet2_map::geometry::Point;
use lanelet2_map::geometry::polyline::{length_m, nearest};
use lanelet2_map::geometry::required_end::required_end;
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use signal_gateway::config::drive::{DriveFile, ManoeuvrePlan, PlanKind, PlannedShift};
use turn_signal::route::Segment;
use turn_signal::side::Side;

/// The front of the sample vehicle before its rear axle, metres.
pub(super) const FRONT_M: f64 = 3.79;
/// Sections are checked this far from their ends, metres: distances are those along the middle of the lanes.
const MARGIN_M: f64 = 1.5;
/// Of manoeuvres that begin within this distance, either may be signalled, metres.
const SAME_START_M: f64 = 3.0;
/// Nothing is announced farther ahead than this at the speeds of these drives, metres.
const FARTHEST_M: f64 = 80.0;

/// Where a side is to be shown: from the front at the start of a required section to the rear axle at its
/// end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) side: Side,
    from_m: f64,
    required_to_m: f64,
    /// End of the desired section.
    to_m: f64,
    /// It may go without a signal: it ends where a hatched marking begins or ends.
    is_optional: bool,
}

impl Stretch {
    fn new(side: Side, from_m: f64, required_to_m: f64, to_m: f64) -> Self {
        Self { side, from_m: from_m - FRONT_M, required_to_m, to_m, is_optional: false }
    }

    /// Surely required at a position.
    pub(super) fn requires_at(&self, at_m: f64) -> bool {
        !self.is_optional && (self.from_m + MARGIN_M..=self.required_to_m - MARGIN_M).contains(&at_m)
    }

    /// Perhaps required at a position.
    pub(super) fn may_require_at(&self, at_m: f64) -> bool {
        (self.from_m - SAME_START_M..=self.required_to_m + MARGIN_M).contains(&at_m)
    }

    /// Perhaps wanted at a position.
    pub(super) fn may_want_at(&self, at_m: f64) -> bool {
        (self.from_m - FARTHEST_M..=self.to_m + MARGIN_M).contains(&at_m)
    }
}

/// The stretches of all manoeuvres that the file plans, and of the turns and roundabouts of its route.
pub(super) fn stretches(file: &DriveFile) -> Vec<Stretch> {
    let lanes = lanes(file);
    let planned = file.manoeuvres.iter().flat_map(|plan| planned(plan, &file.road, &lanes));
    planned.chain(turns(file)).chain(roundabouts(file)).collect()
}

/// The lanelets of the route, each with the position of its start.
pub(super) fn lanes(file: &DriveFile) -> Vec<(f64, &Lanelet)> {
    let mut from_m = 0.0;
    let lane = |segment: &Segment| {
        let lane = file.road.lane(segment.preferred).unwrap();
        let start_m = from_m;
        from_m += lane.length_m();
        (start_m, lane)
    };
    file.route.segments.iter().map(lane).collect()
}

/// One turn for consecutive lanelets of one direction.
fn turns(file: &DriveFile) -> Vec<Stretch> {
    let side = |lane: &Lanelet| match lane.turn_direction {
        TurnDirection::Left => Some(Side::Left),
        TurnDirection::Right => Some(Side::Right),
        TurnDirection::None | TurnDirection::Straight => None,
    };
    let threshold_deg = file.decider.parameters.intersection_angle_threshold_deg;
    let lanes = lanes(file);
    let stretch = |lanes: &[(f64, &Lanelet)]| {
        let middle: Vec<Point> = lanes.iter().flat_map(|(_, lane)| lane.centerline.iter().copied()).collect();
        Some(bend(lanes.first()?.0, &middle, side(lanes.first()?.1)?, threshold_deg))
    };
    lanes.chunk_by(|(_, one), (_, next)| side(one) == side(next)).filter_map(stretch).collect()
}

fn bend(from_m: f64, middle: &[Point], side: Side, threshold_deg: f64) -> Stretch {
    let end = required_end(middle, threshold_deg).unwrap();
    let required_m = nearest(middle, end.position).unwrap().arc_m;
    Stretch::new(side, from_m, from_m + required_m, from_m + length_m(middle))
}

/// Entries with a side, and exits.
fn roundabouts(file: &DriveFile) -> Vec<Stretch> {
    let parameters = &file.decider.parameters;
    let lanes = lanes(file);
    let mut found = Vec::new();
    for (index, (from_m, lane)) in lanes.iter().enumerate() {
        let bend = |side| {
            let threshold_deg = parameters.roundabout_angle_threshold_deg;
            bend(*from_m, &lane.centerline, side, threshold_deg)
        };
        for element in file.road.roundabouts_of(lane.id) {
            if element.entries.contains(&lane.id) {
                let inside = lanes.iter().skip(index + 1).take_while(|(_, lane)| element.contains(lane.id));
                let Some((last_m, last)) = inside.last() else { continue };
                let side = if lane.exits_signalled_left.contains(&last.id) {
                    Some(Side::Left)
                } else if lane.exits_signalled_right.contains(&last.id) {
                    Some(Side::Right)
                } else {
                    parameters.roundabout_on_entry
                };
                let lasting_m = parameters.roundabout_entry_persists.then(|| last_m + last.length_m());
                let lasting = |entry: Stretch| Stretch { to_m: lasting_m.unwrap_or(entry.to_m), ..entry };
                found.extend(side.map(bend).map(lasting));
            }
            if element.exits.contains(&lane.id) {
                found.extend(parameters.roundabout_on_exit.map(bend));
            }
        }
    }
    found
}

/// A way to a side that is not taken leads off the route between two positions.
pub(super) fn offers(
    road: &LaneNetwork,
    lanes: &[(f64, &Lanelet)],
    side: Side,
    within_m: Range<f64>,
) -> bool {
    lanes.windows(2).any(|pair| {
        let [(_, before), (at_m, taken)] = pair else { return false };
        let others = before.followers.iter().filter(|id| **id != taken.id).filter_map(|id| road.lane(*id));
        within_m.contains(at_m)
            && others.into_iter().any(|other| leads_left(other, taken) == Some(side == Side::Left))
    })
}

fn planned(plan: &ManoeuvrePlan, road: &LaneNetwork, lanes: &[(f64, &Lanelet)]) -> Vec<Stretch> {
    let lane_at = |at_m: f64| lanes.iter().rev().find(|(from_m, _)| *from_m <= at_m).map(|(_, lane)| *lane);
    let is_hatched = |at_m: f64, side: Side| {
        lane_at(at_m).is_some_and(|lane| match side {
            Side::Left => lane.left.is_hatched_only(),
            Side::Right => lane.right.is_hatched_only(),
        })
    };
    let side = |offset_m: f64| if offset_m > 0.0 { Side::Left } else { Side::Right };
    let whole = |side, from_m, to_m| Stretch::new(side, from_m, to_m, to_m);
    match &plan.kind {
        PlanKind::Avoidance(lines) => {
            let mut before_m = 0.0;
            let mut stretch = |line: &PlannedShift| {
                let moved_m = line.offset_m - std::mem::replace(&mut before_m, line.offset_m);
                // Over a hatched marking, and back from it, is not signalled.
                let over = if line.offset_m == 0.0 { side(-moved_m) } else { side(moved_m) };
                let hatched = [-MARGIN_M, MARGIN_M].map(|by_m| is_hatched(line.to_m + by_m, over));
                let stretch = whole(side(moved_m), line.from_m, line.to_m);
                (hatched != [true, true])
                    .then_some(Stretch { is_optional: hatched[0] || hatched[1], ..stretch })
            };
            lines.iter().filter_map(&mut stretch).collect()
        }
        PlanKind::LaneChange { side, from_m, to_m, crossing_m, .. } => {
            vec![Stretch::new(*side, *from_m, *crossing_m, *to_m)]
        }
        PlanKind::PullOut { shift, .. } => {
            let side = side(-shift.offset_m);
            // Before a junction that offers its side its signal ends early.
            let is_optional = offers(road, lanes, side, shift.from_m..f64::INFINITY);
            vec![Stretch { is_optional, ..whole(side, shift.from_m, shift.to_m) }]
        }
        PlanKind::PullOver { shift, .. } => vec![whole(side(shift.offset_m), shift.from_m, shift.to_m)],
        PlanKind::SideShift(_) => Vec::new(),
    }
}
