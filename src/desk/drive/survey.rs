//! Many drives over a map, held against its geometry: which turns are not signalled, too short, to the wrong side, or flicker.

use std::collections::BTreeMap;
use std::fmt;

use super::run::Run;
use super::simulation::DriveSimulation;
use crate::config::Refused;
use crate::config::drive::DriveFile;
use crate::core::map::geometry::Point;
use crate::core::map::geometry::polyline::{length_m, nearest};
use crate::core::map::geometry::required_end::required_end;
use crate::core::map::lane_network::{Lane, LaneId, LaneNetwork, TurnDirection};
use crate::core::map::tag_check::{MapFlaw, check_tags};
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::route::Segment;
use crate::core::turn_signal::side::Side;

/// A route ends once it is this long, metres, or has so many lanelets.
const ROUTE_M: f64 = 500.0;
const MOST_LANES: usize = 60;
/// Sections are judged this far from their ends, metres: distances are those along the middle of the lanes.
const MARGIN_M: f64 = 1.5;

/// What is wrong with the signal of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// Its side is not shown at all while it is required.
    Missed,
    /// It is shown during a part of the required section only.
    Short,
    /// The other side is shown while this one is required.
    Opposite,
    /// It goes off and on again on the way through the turn.
    Flickers,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Missed, Self::Short, Self::Opposite, Self::Flickers];

    /// What it is called.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Missed => "missed",
            Self::Short => "short",
            Self::Opposite => "opposite",
            Self::Flickers => "flickering",
        }
    }
}

/// A turn whose signal is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct WrongTurn {
    /// Its first lanelet.
    pub lane: LaneId,
    /// The side to which it turns.
    pub side: Side,
    /// Where it begins on its route, metres.
    pub at_m: f64,
    /// The first and the last lanelet of the route.
    pub way: [LaneId; 2],
    /// What is wrong.
    pub fault: Fault,
}

/// `lanelet 111, 59.0 m from 101 to 402: the turn to the left is missed`
impl fmt::Display for WrongTurn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { lane, side, at_m, way: [from, to], fault } = self;
        let what = match fault {
            Fault::Missed => "is not signalled",
            Fault::Short => "is signalled in a part of its required section only",
            Fault::Opposite => "has the signal to the other side",
            Fault::Flickers => "has a signal that goes off and on again",
        };
        let side = match side {
            Side::Left => "left",
            Side::Right => "right",
        };
        write!(f, "lanelet {lane}, at {at_m:.1} m from {from} to {to}: the turn to the {side} {what}")
    }
}

/// What a survey of a map has found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// Routes that were driven.
    pub routes: usize,
    /// Turns on them.
    pub turns: usize,
    /// Those that are wrong, in the order of the routes.
    pub wrong: Vec<WrongTurn>,
}

/// Drives so many routes over the map of a drive, with its speed and its settings. The routes are the same each time.
///
/// # Errors
/// A route whose lanelets do not form a path.
pub fn survey(file: &DriveFile, compat: DeciderCompat, routes: usize) -> Result<Survey, Refused> {
    let expected = expected_sides(&file.road);
    let mut survey = Survey::default();
    for lanes in self::routes(&file.road).take(routes) {
        let mut file = file.clone();
        file.route.segments =
            lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] }).collect();
        let turns = turns(&file, &lanes, &expected);
        let shown = shown(&DriveSimulation::new(file)?, compat);
        let [Some(from), Some(to)] = [lanes.first(), lanes.last()] else { continue };
        survey.routes += 1;
        survey.turns += turns.len();
        for turn in &turns {
            let fault = turn.fault(&turns, &shown);
            survey.wrong.extend(fault.map(|fault| WrongTurn {
                lane: turn.lane,
                side: turn.side,
                at_m: turn.start_m,
                way: [*from, *to],
                fault,
            }));
        }
    }
    Ok(survey)
}

/// Routes from all over the map, each over lanelets that follow each other, none twice, forever.
fn routes(road: &LaneNetwork) -> impl Iterator<Item = Vec<LaneId>> + '_ {
    let starts: Vec<LaneId> = road.lanes().map(|lane| lane.id).collect();
    // Knuth's generator: the choice is arbitrary, and the same each time.
    let mut state: u64 = 1;
    let mut next = move |count: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let count = u64::try_from(count).unwrap_or(u64::MAX).max(1);
        usize::try_from((state >> 33) % count).unwrap_or_default()
    };
    std::iter::repeat_with(move || {
        let mut lanes: Vec<LaneId> = starts.get(next(starts.len())).copied().into_iter().collect();
        let mut route_m = 0.0;
        while let Some(last) = lanes.last().copied().filter(|_| route_m < ROUTE_M && lanes.len() < MOST_LANES)
        {
            route_m += road.lane(last).map_or(0.0, Lane::length_m);
            let followers = road.followers(last);
            match followers.get(next(followers.len())) {
                Some(lane) if !lanes.contains(lane) => lanes.push(*lane),
                _ => break,
            }
        }
        lanes
    })
    .take_while({
        let is_empty = road.lanes().next().is_none();
        move |_| !is_empty
    })
}

/// The side to which each lanelet turns: by its tag, unless its geometry says otherwise, as `check` finds.
fn expected_sides(road: &LaneNetwork) -> BTreeMap<LaneId, Side> {
    let by_tag = |lane: &Lane| match lane.turn_direction {
        TurnDirection::Left => Some((lane.id, Side::Left)),
        TurnDirection::Right => Some((lane.id, Side::Right)),
        TurnDirection::None | TurnDirection::Straight => None,
    };
    let plain = road.lanes().filter(|lane| lane.roundabouts.is_empty());
    let mut sides: BTreeMap<LaneId, Side> = plain.filter_map(by_tag).collect();
    for finding in check_tags(road) {
        if let MapFlaw::OtherDirection { bend_deg, .. } | MapFlaw::UntaggedFork { bend_deg, .. } =
            finding.flaw
        {
            sides.insert(finding.lane, if bend_deg > 0.0 { Side::Left } else { Side::Right });
        }
    }
    sides
}

/// A turn on a route.
#[derive(Debug, Clone, Copy)]
struct Turn {
    lane: LaneId,
    side: Side,
    /// Its start, metres from the start of the route.
    start_m: f64,
    /// Where its signal is required: from the front at its start to the rear axle at the end of the required section.
    required_m: [f64; 2],
}

/// The turns of a route; several lanelets to one side that follow each other are one.
fn turns(file: &DriveFile, lanes: &[LaneId], expected: &BTreeMap<LaneId, Side>) -> Vec<Turn> {
    let front_m = file.decider.vehicle.front_m();
    let threshold_deg = file.decider.parameters.intersection_angle_threshold_deg;
    let mut start_m = 0.0;
    let mut turns = Vec::new();
    for group in lanes.chunk_by(|one, next| expected.get(one) == expected.get(next)) {
        let middle: Vec<Point> = group
            .iter()
            .filter_map(|id| file.road.lane(*id))
            .flat_map(|lane| lane.centerline.iter().copied())
            .collect();
        if let ([lane, ..], Some(side)) = (group, group.first().and_then(|lane| expected.get(lane))) {
            let end = required_end(&middle, threshold_deg).and_then(|end| nearest(&middle, end.position));
            let required_m = [start_m - front_m, start_m + end.map_or(0.0, |end| end.arc_m)];
            turns.push(Turn { lane: *lane, side: *side, start_m, required_m });
        }
        start_m += length_m(&middle);
    }
    turns
}

/// The side that is shown at each position of the rear axle, metres.
fn shown(simulation: &DriveSimulation, compat: DeciderCompat) -> Vec<(f64, Option<Side>)> {
    let mut run = Run::new(simulation, compat);
    simulation.cycles().map(|cycle| (cycle.at_m, run.step(&cycle).turn.side())).collect()
}

impl Turn {
    fn fault(&self, turns: &[Self], shown: &[(f64, Option<Side>)]) -> Option<Fault> {
        let [from_m, to_m] = self.required_m;
        let within = |at_m: f64, margin_m: f64| at_m >= from_m + margin_m && at_m <= to_m - margin_m;
        let other_is_required = |at_m: f64| {
            let is_near =
                |turn: &Self| at_m >= turn.required_m[0] - MARGIN_M && at_m <= turn.required_m[1] + MARGIN_M;
            turns.iter().any(|turn| turn.side != self.side && is_near(turn))
        };
        let required: Vec<Option<Side>> = shown
            .iter()
            .filter(|(at_m, _)| within(*at_m, MARGIN_M) && !other_is_required(*at_m))
            .map(|(_, side)| *side)
            .collect();
        let is_shown = |side: &Option<Side>| *side == Some(self.side);
        if required.is_empty() {
            return None;
        }
        if required.iter().any(|side| side.is_some_and(|side| side != self.side)) {
            return Some(Fault::Opposite);
        }
        if !required.iter().any(is_shown) {
            return Some(Fault::Missed);
        }
        if !required.iter().all(is_shown) {
            return Some(Fault::Short);
        }
        let through: Vec<bool> =
            shown.iter().filter(|(at_m, _)| within(*at_m, 0.0)).map(|(_, side)| is_shown(side)).collect();
        let comes_on = through.windows(2).filter(|pair| matches!(pair, [false, true])).count();
        (comes_on > 1).then_some(Fault::Flickers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(side: Side, required_m: [f64; 2]) -> Turn {
        Turn { lane: 7, side, start_m: required_m[0] + 4.0, required_m }
    }

    /// What is shown at each metre from 0 to 99.
    fn shown(side: impl Fn(u8) -> Option<Side>) -> Vec<(f64, Option<Side>)> {
        (0..100).map(|at_m| (f64::from(at_m), side(at_m))).collect()
    }

    #[test]
    fn each_fault_is_found_and_a_right_signal_has_none() {
        use Side::{Left, Right};
        let of = |side: &dyn Fn(u8) -> Option<Side>| {
            let left = turn(Left, [40.0, 60.0]);
            left.fault(&[left, turn(Right, [70.0, 80.0])], &shown(side))
        };
        let during = |range: std::ops::Range<u8>| move |at_m| range.contains(&at_m).then_some(Left);
        assert_eq!(of(&during(10..65)), None);
        assert_eq!(of(&during(41..60)), None, "within the tolerance");
        assert_eq!(of(&during(61..70)), Some(Fault::Missed));
        assert_eq!(of(&during(48..65)), Some(Fault::Short));
        assert_eq!(of(&|at_m| Some(if at_m < 50 { Left } else { Right })), Some(Fault::Opposite));
        let near = turn(Left, [40.0, 72.0]);
        let both = shown(|at_m| Some(if at_m < 68 { Left } else { Right }));
        assert_eq!(
            near.fault(&[near, turn(Right, [69.0, 80.0])], &both),
            None,
            "where both are required either may be shown"
        );
        assert_eq!(turn(Left, [200.0, 220.0]).fault(&[], &both), None, "not driven");
    }
}
