//! Judges whether the signal of a turn is right where it is required.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Serialize;

use crate::config::drive::DriveFile;
use gateway_base::names::named_by_variant;
use lanelet2_map::geometry::Point;
use lanelet2_map::geometry::polyline::{length_m, nearest};
use lanelet2_map::geometry::required_end::required_end;
use lanelet2_map::lane_network::{LaneId, TurnDirection};
use lanelet2_map::tag_check::MapFlaw;
use turn_signal::side::Side;

/// Margin of a section that is not judged, metres: distances are measured along the middle of the lanes.
const MARGIN_M: f64 = 1.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SignalFault {
    /// The side is not signalled at all while it is required.
    Missed,
    /// The side is signalled only in a part of the required section.
    Short,
    /// The opposite side is signalled while this side is required.
    Opposite,
    /// The signal goes off and on again within the turn.
    Flickering,
}

named_by_variant!(SignalFault);

impl SignalFault {
    /// All faults, in the order of reports.
    pub(crate) const ALL: [Self; 4] = [Self::Missed, Self::Short, Self::Opposite, Self::Flickering];
}

/// The side to which a lanelet turns, and the flaw of the map if its tag does not say so.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExpectedSide {
    pub(super) side: Side,
    pub(super) flaw: Option<MapFlaw>,
}

#[derive(Debug, Clone)]
pub(super) struct JudgedTurn {
    pub(super) lane: LaneId,
    pub(super) side: Side,
    /// Start of the turn, metres from the start of the route.
    pub(super) start_m: f64,
    /// Range where its signal is required: from the front reaching its start to the rear axle reaching the
    /// end of the required section.
    required_m: Range<f64>,
    /// Flaw of the map at one of its lanelets, or at a lanelet that forms one turn with them.
    pub(super) flaw: Option<MapFlaw>,
}

/// Returns the turns of a route; consecutive lanelets to the same side form one turn.
pub(super) fn turns(
    file: &DriveFile,
    lanes: &[LaneId],
    expected: &BTreeMap<LaneId, ExpectedSide>,
) -> Vec<JudgedTurn> {
    let front_m = file.decider.vehicle.front_m();
    let threshold_deg = file.decider.parameters.intersection_angle_threshold_deg;
    let flaws = flaws(file, lanes, expected);
    let mut start_m = 0.0;
    let mut turns = Vec::new();
    let side = |lane: &LaneId| expected.get(lane).map(|expected| expected.side);
    for group in lanes.chunk_by(|one, next| side(one) == side(next)) {
        let lanes = group.iter().filter_map(|id| file.road.lane(*id));
        let middle: Vec<Point> = lanes.flat_map(|lane| &lane.centerline).copied().collect();
        if let ([lane, ..], Some(side)) = (group, group.first().and_then(side)) {
            let end = required_end(&middle, threshold_deg).and_then(|end| nearest(&middle, end.position));
            let required_m = start_m - front_m..start_m + end.map_or(0.0, |end| end.arc_m);
            let flaw = group.iter().find_map(|lane| flaws.get(lane).copied().cloned());
            turns.push(JudgedTurn { lane: *lane, side, start_m, required_m, flaw });
        }
        start_m += length_m(&middle);
    }
    turns
}

/// Returns for each lanelet of a route the flaw of the map that makes its signal wrong: its own, or the flaw
/// of an adjacent lanelet with the same tag, which the decider treats as the same turn.
fn flaws<'a>(
    file: &DriveFile,
    lanes: &[LaneId],
    expected: &'a BTreeMap<LaneId, ExpectedSide>,
) -> BTreeMap<LaneId, &'a MapFlaw> {
    let turn_direction = |lane: &LaneId| file.road.lane(*lane).map(|lane| lane.turn_direction);
    let is_one_turn = |one: &LaneId, next: &LaneId| {
        matches!(turn_direction(one), Some(TurnDirection::Left | TurnDirection::Right))
            && turn_direction(one) == turn_direction(next)
    };
    let tagged_alike = lanes.chunk_by(is_one_turn);
    let flawed = tagged_alike.filter_map(|group| {
        let flaw = group.iter().find_map(|lane| expected.get(lane)?.flaw.as_ref())?;
        Some(group.iter().map(move |lane| (*lane, flaw)))
    });
    flawed.flatten().collect()
}

impl JudgedTurn {
    /// Returns the fault of the signal, given the signalled side (`shown`) at each position of the rear axle
    /// in metres; `None` if there is no fault.
    pub(super) fn fault(&self, turns: &[Self], shown: &[(f64, Option<Side>)]) -> Option<SignalFault> {
        let other_is_required =
            |at_m: f64| turns.iter().any(|turn| turn.side != self.side && turn.is_required(at_m, -MARGIN_M));
        let required =
            shown.iter().filter(|(at_m, _)| self.is_required(*at_m, MARGIN_M) && !other_is_required(*at_m));
        let required: Vec<Option<Side>> = required.map(|(_, side)| *side).collect();
        let is_shown = |side: &Option<Side>| *side == Some(self.side);
        if required.is_empty() {
            return None;
        }
        if required.iter().any(|side| side.is_some_and(|side| side != self.side)) {
            return Some(SignalFault::Opposite);
        }
        if !required.iter().any(is_shown) {
            return Some(SignalFault::Missed);
        }
        if !required.iter().all(is_shown) {
            return Some(SignalFault::Short);
        }
        let through = shown.iter().filter(|(at_m, _)| self.is_required(*at_m, 0.0));
        let through: Vec<bool> = through.map(|(_, side)| is_shown(side)).collect();
        let comes_on = through.windows(2).filter(|pair| matches!(pair, [false, true])).count();
        (comes_on > 1).then_some(SignalFault::Flickering)
    }

    /// Returns true if the signal is required, but for a margin at both ends.
    fn is_required(&self, at_m: f64, margin_m: f64) -> bool {
        at_m >= self.required_m.start + margin_m && at_m <= self.required_m.end - margin_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(side: Side, required_m: Range<f64>) -> JudgedTurn {
        JudgedTurn { lane: 7, side, start_m: required_m.start + 4.0, required_m, flaw: None }
    }

    /// Returns the signalled side at each metre from 0 to 99.
    fn shown(side: impl Fn(u8) -> Option<Side>) -> Vec<(f64, Option<Side>)> {
        (0..100).map(|at_m| (f64::from(at_m), side(at_m))).collect()
    }

    #[test]
    fn each_fault_is_found_and_a_right_signal_has_none() {
        use Side::{Left, Right};
        let of = |side: &dyn Fn(u8) -> Option<Side>| {
            let left = turn(Left, 40.0..60.0);
            left.fault(&[left.clone(), turn(Right, 70.0..80.0)], &shown(side))
        };
        let during = |range: Range<u8>| move |at_m| range.contains(&at_m).then_some(Left);
        assert_eq!(of(&during(10..65)), None);
        assert_eq!(of(&during(41..60)), None, "within the tolerance");
        assert_eq!(of(&during(61..70)), Some(SignalFault::Missed));
        assert_eq!(of(&during(48..65)), Some(SignalFault::Short));
        assert_eq!(of(&|at_m| Some(if at_m < 50 { Left } else { Right })), Some(SignalFault::Opposite));
        let near = turn(Left, 40.0..72.0);
        let both = shown(|at_m| Some(if at_m < 68 { Left } else { Right }));
        assert_eq!(
            near.fault(&[near.clone(), turn(Right, 69.0..80.0)], &both),
            None,
            "where both are required either may be shown"
        );
        assert_eq!(turn(Left, 200.0..220.0).fault(&[], &both), None, "not driven");
    }
}
