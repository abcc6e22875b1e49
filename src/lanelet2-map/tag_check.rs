//! Checks the tags that concern turn signals against the geometry of their lanelets: a wrong tag causes a
//! wrong signal, a missing tag none.

use std::collections::BTreeSet;
use std::fmt;

use derive_more::Display;

use super::fork::parting;
use super::geometry::polyline::headed;
use super::geometry::{Point, Pose, wrapped};
use super::lane_network::{LaneId, LaneNetwork, Lanelet, Roundabout, TurnDirection};

/// A bend by less than this is straight, degrees: drawn bounds are inaccurate.
const STRAIGHT_DEG: f64 = 5.0;
/// A bend by more than this is a turn, degrees.
const TURN_DEG: f64 = 60.0;
/// After a fork, lanelets up to this total length are one turn, metres.
const MAX_TURN_M: f64 = 50.0;
/// Points nearer than this to the previous point do not define a direction, metres.
const MIN_PIECE_M: f64 = 0.3;
/// A sharper bend is a corner rather than an arc, degrees.
const MAX_BEYOND_DEG: f64 = 15.0;

/// A flaw of a map at a lanelet.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFinding {
    /// Id of the lanelet.
    pub lane: LaneId,
    /// Start of its centreline in the map frame; `None` if it is not on the map.
    pub position: Option<Point>,
    /// The kind of flaw.
    pub flaw: MapFlaw,
}

/// A reason why the signal at a lanelet may be wrong or missing.
#[derive(Debug, Clone, PartialEq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum MapFlaw {
    #[display("tagged {}, but it bends {}", tag.name(), bend(*bend_deg))]
    OtherDirection {
        tag: TurnDirection,
        /// The bend from its start to its end, degrees, positive to the left.
        bend_deg: f64,
    },
    #[display(
        "its turn_direction {_0:?} names no direction: expected left, right or straight, in lower case"
    )]
    UnknownDirection(String),
    /// The stretch in which its turn is announced, according to its `turn_signal_distance`, begins before the
    /// end of a turn to the other side.
    #[display(
        "its turn_signal_distance of {distance_m} m reaches behind the end of lanelet {other}, which turns to the other side"
    )]
    ReachesBehindOtherTurn {
        /// The tag `turn_signal_distance`, metres.
        distance_m: f64,
        other: LaneId,
    },
    /// A turn is split: consecutive lanelets have the same tag.
    #[display("a turn tagged {} ({}) is split over the lanelets {}", tag.name(), bend(*bend_deg), listed(lanes))]
    SplitTurn {
        tag: TurnDirection,
        /// All of its lanelets, in driving direction.
        lanes: Vec<LaneId>,
        /// The bend from the start of the first to the end of the last, degrees, positive to the left.
        bend_deg: f64,
    },
    #[display("turns off by {} where the road forks after {after}, without a turn_direction", bend(*bend_deg))]
    UntaggedFork {
        /// The lanelet after which the road forks.
        after: LaneId,
        /// The bend, degrees, positive to the left.
        bend_deg: f64,
    },
    /// It leads off at a fork with a bend too small for a turn, and has no `turn_direction`.
    #[display(
        "leads off to the {} of {other} where the road forks after {after}, without a turn_direction",
        if *is_left { "left" } else { "right" }
    )]
    UntaggedLowFork {
        /// The lanelet after which the road forks.
        after: LaneId,
        /// The straighter lanelet of the two.
        other: LaneId,
        /// True if the lanelet lies to the left of the straighter one.
        is_left: bool,
    },
    #[display("a roundabout names it, but it is not on the map")]
    NotOnMap,
    #[display("a roundabout gives it a role, but it does not refer to the roundabout")]
    NoReference,
    #[display("refers to a roundabout that gives it no role")]
    NoRole,
    #[display("an entry that leads to no lanelet of its roundabout")]
    EntryLeadsNowhere,
    #[display("an exit to which no lanelet of its roundabout leads")]
    ExitFromNowhere,
    #[display("signals on entry for the exit {_0}, which its roundabout does not have")]
    UnknownExit(LaneId),
    /// An entry lists this exit both for the left and for the right.
    #[display("signals on entry both left and right for the exit {_0}")]
    ContradictingExit(LaneId),
    #[display("an exit with no enable_exit_turn_signal on the lanelet of the ring before it")]
    UntaggedExit,
}

/// Returns all flaws of a map, in the order of the lanelets.
pub fn check_tags(road: &LaneNetwork) -> Vec<MapFinding> {
    let mut findings = Vec::new();
    for lane in road.lanes() {
        let mut note = |flaw| findings.push(finding(road, lane.id, flaw));
        if lane.roundabouts.is_empty() {
            unknown_direction(lane).into_iter().for_each(&mut note);
            other_direction(lane).into_iter().for_each(&mut note);
            reaches_behind_other_turn(road, lane).into_iter().for_each(&mut note);
            split_turn(road, lane).into_iter().for_each(&mut note);
            let flaw = untagged_fork(road, lane).or_else(|| untagged_low_fork(road, lane));
            flaw.into_iter().for_each(&mut note);
        }
        exits_of_entry(road, lane).into_iter().for_each(&mut note);
    }
    for (index, element) in road.roundabouts().iter().enumerate() {
        findings.extend(members(road, index, element));
    }
    findings.sort_by_key(|finding| finding.lane);
    findings
}

fn finding(road: &LaneNetwork, lane: LaneId, flaw: MapFlaw) -> MapFinding {
    let position = road.lane(lane).and_then(|lane| lane.centerline.first().copied());
    MapFinding { lane, position, flaw }
}

/// Returns the bend from start to end, degrees, positive to the left; bends of more than half a circle are
/// not wrapped.
fn bend_deg(lane: &Lanelet) -> f64 {
    let mut points: Vec<Point> = Vec::new();
    for point in &lane.centerline {
        if points.last().is_none_or(|last| last.distance_m(*point) >= MIN_PIECE_M) {
            points.push(*point);
        }
    }
    let poses = headed(&points);
    // The last pose has the heading of the previous one.
    let pieces = poses.get(..poses.len().saturating_sub(1)).unwrap_or_default();
    let turning = |pair: &[Pose]| match pair {
        [from, to] => wrapped(to.yaw_rad - from.yaw_rad).to_degrees(),
        _ => 0.0,
    };
    let turnings: Vec<f64> = pieces.windows(2).map(turning).collect();
    // A piece is a chord: the ends of an arc face half a corner beyond the first and the last piece.
    let ends = turnings.first().into_iter().chain(turnings.last());
    let beyond_deg: f64 = ends.map(|deg| (deg / 2.0).clamp(-MAX_BEYOND_DEG, MAX_BEYOND_DEG)).sum();
    turnings.iter().sum::<f64>() + beyond_deg
}

fn other_direction(lane: &Lanelet) -> Option<MapFlaw> {
    let (tag, bend_deg) = (lane.turn_direction, bend_deg(lane));
    let is_wrong = match tag {
        TurnDirection::None => false,
        TurnDirection::Straight => bend_deg.abs() > TURN_DEG,
        TurnDirection::Left => bend_deg < -STRAIGHT_DEG,
        TurnDirection::Right => bend_deg > STRAIGHT_DEG,
    };
    is_wrong.then_some(MapFlaw::OtherDirection { tag, bend_deg })
}

fn unknown_direction(lane: &Lanelet) -> Option<MapFlaw> {
    let value = lane.unknown_direction.clone()?;
    Some(MapFlaw::UnknownDirection(value))
}

/// Returns the nearest turn to the other side that ends within the lane's own search distance before it.
fn reaches_behind_other_turn(road: &LaneNetwork, lane: &Lanelet) -> Option<MapFlaw> {
    let opposite = match lane.turn_direction {
        TurnDirection::Left => TurnDirection::Right,
        TurnDirection::Right => TurnDirection::Left,
        TurnDirection::None | TurnDirection::Straight => return None,
    };
    let distance_m = lane.turn_signal_distance_m?;
    // Visits the lanelets before it, by their distance to it; each once, so that a ring ends.
    let (mut pending, mut visited) = (vec![(0.0, lane.id)], BTreeSet::from([lane.id]));
    let mut nearest: Option<(f64, LaneId)> = None;
    while let Some((before_m, here)) = pending.pop() {
        for before in road.predecessors(here).iter().filter_map(|id| road.lane(*id)) {
            if before.turn_direction == opposite {
                nearest = nearest.filter(|(least_m, _)| *least_m <= before_m).or(Some((before_m, before.id)));
            } else if before_m + before.length_m() < distance_m && visited.insert(before.id) {
                pending.push((before_m + before.length_m(), before.id));
            }
        }
    }
    nearest.map(|(_, other)| MapFlaw::ReachesBehindOtherTurn { distance_m, other })
}

fn split_turn(road: &LaneNetwork, first: &Lanelet) -> Option<MapFlaw> {
    let tag = first.turn_direction;
    let continues = |id: &LaneId| {
        road.lane(*id).is_some_and(|lane| lane.turn_direction == tag && lane.roundabouts.is_empty())
    };
    if !matches!(tag, TurnDirection::Left | TurnDirection::Right)
        || road.predecessors(first.id).iter().any(continues)
    {
        return None;
    }
    let (mut lanes, mut visited) = (vec![first.id], BTreeSet::from([first.id]));
    while let Some(next) = lanes.last().and_then(|last| road.followers(*last).iter().find(|id| continues(id)))
    {
        if !visited.insert(*next) {
            break;
        }
        lanes.push(*next);
    }
    if lanes.len() < 2 {
        return None;
    }
    let bend_deg = lanes.iter().filter_map(|id| road.lane(*id)).map(bend_deg).sum();
    Some(MapFlaw::SplitTurn { tag, lanes, bend_deg })
}

fn untagged_fork(road: &LaneNetwork, branch: &Lanelet) -> Option<MapFlaw> {
    if branch.turn_direction != TurnDirection::None {
        return None;
    }
    let after = *road.predecessors(branch.id).iter().find(|id| road.followers(**id).len() > 1)?;
    let (mut bend, mut length_m, mut last) = (bend_deg(branch), branch.length_m(), branch);
    // A turn can be drawn as several lanelets without a junction in between.
    while bend.abs() <= TURN_DEG {
        let [next] = last.followers[..] else { return None };
        let next = road.lane(next).filter(|next| {
            next.turn_direction == TurnDirection::None
                && next.roundabouts.is_empty()
                && road.predecessors(next.id).len() == 1
        })?;
        length_m += next.length_m();
        // A lanelet without length would otherwise be followed for ever.
        if length_m > MAX_TURN_M || next.length_m() <= 0.0 || next.id == branch.id {
            return None;
        }
        bend += bend_deg(next);
        last = next;
    }
    Some(MapFlaw::UntaggedFork { after, bend_deg: bend })
}

/// Returns a branch that diverges from a straighter one, by an angle that may or may not be meant as a turn.
fn untagged_low_fork(road: &LaneNetwork, branch: &Lanelet) -> Option<MapFlaw> {
    if branch.turn_direction != TurnDirection::None {
        return None;
    }
    let straighter =
        |other: &&Lanelet| other.id != branch.id && bend_deg(other).abs() < bend_deg(branch).abs();
    road.predecessors(branch.id).iter().find_map(|after| {
        let others = road.followers(*after).iter().filter_map(|id| road.lane(*id)).filter(straighter);
        others.into_iter().find_map(|other| {
            let is_left = parting(branch, other)?.is_left;
            Some(MapFlaw::UntaggedLowFork { after: *after, other: other.id, is_left })
        })
    })
}

/// Returns the exits listed by an entry that are not exits of its roundabouts.
fn exits_of_entry(road: &LaneNetwork, lane: &Lanelet) -> Vec<MapFlaw> {
    let (left, right) = (&lane.exits_signalled_left, &lane.exits_signalled_right);
    let is_exit = |exit: LaneId| road.roundabouts_of(lane.id).any(|element| element.exits.contains(&exit));
    let unknown = left.iter().chain(right).filter(|exit| !is_exit(**exit));
    let unknown = unknown.map(|exit| MapFlaw::UnknownExit(*exit));
    let both = left.iter().filter(|exit| right.contains(exit));
    unknown.chain(both.map(|exit| MapFlaw::ContradictingExit(*exit))).collect()
}

/// Returns the flaws of the members of a roundabout, and of lanelets that refer to it without being members.
fn members(road: &LaneNetwork, index: usize, element: &Roundabout) -> Vec<MapFinding> {
    let mut findings = Vec::new();
    let named: BTreeSet<LaneId> =
        element.entries.iter().chain(&element.exits).chain(&element.internals).copied().collect();
    for id in &named {
        match road.lane(*id) {
            None => findings.push(finding(road, *id, MapFlaw::NotOnMap)),
            Some(lane) if !lane.roundabouts.contains(&index) => {
                findings.push(finding(road, *id, MapFlaw::NoReference));
            }
            Some(_) => {}
        }
    }
    let refers = road.lanes().filter(|lane| lane.roundabouts.contains(&index) && !named.contains(&lane.id));
    findings.extend(refers.map(|lane| finding(road, lane.id, MapFlaw::NoRole)));
    let is_inside = |id: &LaneId| element.internals.contains(id) || element.exits.contains(id);
    for entry in element.entries.iter().filter(|id| road.lane(**id).is_some()) {
        let leads_on = |id: &LaneId| is_inside(id) || element.entries.contains(id);
        if !road.followers(*entry).iter().any(leads_on) {
            findings.push(finding(road, *entry, MapFlaw::EntryLeadsNowhere));
        }
    }
    for exit in element.exits.iter().filter(|id| road.lane(**id).is_some()) {
        let before = || road.predecessors(*exit).iter().filter(|before| element.contains(**before));
        let is_tagged = |id: &LaneId| road.lane(*id).is_some_and(|lane| lane.enables_exit_signal);
        if before().next().is_none() {
            findings.push(finding(road, *exit, MapFlaw::ExitFromNowhere));
        } else if !before().any(is_tagged) {
            findings.push(finding(road, *exit, MapFlaw::UntaggedExit));
        }
    }
    findings
}

/// Returns a bend as text, e.g. `90° to the right`.
fn bend(bend_deg: f64) -> String {
    let side = if bend_deg < 0.0 { "right" } else { "left" };
    format!("{:.0}° to the {side}", bend_deg.abs())
}

/// Returns the names of lanelets, in the given order.
fn listed(lanes: &[LaneId]) -> String {
    lanes.iter().map(LaneId::to_string).collect::<Vec<_>>().join(", ")
}

/// Writes e.g. `lanelet 201 at (23.4, 12.0) m: tagged left, but it bends 90° to the right`.
impl fmt::Display for MapFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "lanelet {}", self.lane)?;
        if let Some(Point { x_m, y_m, .. }) = self.position {
            write!(f, " at ({x_m:.1}, {y_m:.1}) m")?;
        }
        write!(f, ": {}", self.flaw)
    }
}

#[cfg(test)]
mod tests;
