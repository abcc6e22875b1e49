//! Turns at intersections (docs/spec/turn-signal-decider.md, "Intersection turns"): the relevant lanelets,
//! the pose at which each comes within range, the next turn among several.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use super::decision_context::DecisionContext;
use super::distance_path::DistancePath;
use super::junction::JunctionAhead;
use super::section::{Section, SectionPlace};
use super::side::Side;
use super::subject::SignalSubject;
use super::turn_lane::TurnLane;
use crate::light_command::TurnCommand;
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathFrame;
use lanelet2_map::lane_network::{LaneId, TurnDirection};

mod stop_rule;

/// Default time for which a vehicle may stand, farther away than the search distance at standstill, and still
/// announce the turn.
pub const STANDING_LIMIT: Duration = Duration::from_secs(20);

/// The poses at which the turns in range came within range.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IntersectionMemory {
    starts: BTreeMap<LaneId, AnnouncedTurn>,
    /// Improved: the announced turns that are passed. A route that comes by again would otherwise announce
    /// them once more (W20).
    passed: BTreeSet<LaneId>,
    shortened: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct AnnouncedTurn {
    /// Pose of the rear axle when the turn came within range.
    start: Pose,
    /// Distance from there to the turn, metres.
    before_m: f64,
    /// Its signal no longer waits for a junction.
    is_shown: bool,
    /// It has been counted as waiting for a junction.
    is_counted: bool,
    /// Time since which the vehicle stands with the turn out of range; `None` if it does not.
    waits_since: Option<MonoTime>,
}

/// Returns the turns on the distance path, in order. `manoeuvre` is the command of the planner's manoeuvres,
/// for the stop rule.
pub fn turns(context: &DecisionContext<'_>, path: &DistancePath, manoeuvre: TurnCommand) -> Vec<TurnLane> {
    let lanes = &path.lanes;
    let threshold_deg = context.parameters.intersection_angle_threshold_deg;
    let all = context.quirks.has_stop_rule
        && manoeuvre.side().is_some_and(|side| stop_rule::stands_at_turn(context, lanes, side));
    let mut turns: Vec<TurnLane> = Vec::new();
    let mut before: Option<LaneId> = None;
    for (id, span_m) in lanes.iter().zip(&path.spans_m) {
        let previous = before.replace(*id);
        let Some(lane) = context.road.lane(*id).filter(|lane| lane.roundabouts.is_empty()) else { continue };
        let turns_here = matches!(lane.turn_direction, TurnDirection::Left | TurnDirection::Right);
        if !turns_here && !all {
            continue;
        }
        let Some(turn) = TurnLane::new(lane, threshold_deg) else { continue };
        let turn =
            TurnLane { span_m: (!context.quirks.ignores_height_and_continuity).then_some(*span_m), ..turn };
        let continues = |last: &TurnLane| {
            !context.quirks.splits_turns
                && last.direction == turn.direction
                && previous.is_some_and(|before| context.road.followers(before).contains(id))
        };
        match turns.last_mut().filter(|last| continues(last) && ends_at(last, &turn)) {
            Some(last) => *last = last.joined(&turn, threshold_deg),
            None => turns.push(turn),
        }
    }
    turns
}

/// Returns whether `next` begins where `last` ends.
fn ends_at(last: &TurnLane, next: &TurnLane) -> bool {
    last.back.position.distance_m(next.front.position) < JOINT_M
}

/// Minimum length of a turn that remains when it is first met, metres; a shorter remainder is not announced,
/// since the signal would only be seen behind it.
const LAST_METRES_M: f64 = 3.0;

/// Lanelets that meet share points; a larger distance lies between others, metres.
const JOINT_M: f64 = 0.5;

impl IntersectionMemory {
    /// Returns the record of the next turn, if one is in range.
    pub fn section(&mut self, context: &DecisionContext<'_>, turns: &[TurnLane]) -> Option<Section> {
        if !context.quirks.memory_survives_route {
            let is_on_path = |id: &LaneId| turns.iter().any(|turn| turn.id == *id);
            self.starts.retain(|id, _| is_on_path(id));
            self.passed.retain(is_on_path);
        }
        let records = turns.iter().filter_map(|turn| self.record(context, turn)).collect();
        let next = next_in_queue(&context.path_frame, records)?;
        if let SignalSubject::Turn(id) = next.subject
            && let Some(announced) = self.starts.get_mut(&id).filter(|_| next.waits())
        {
            self.shortened += u64::from(!std::mem::replace(&mut announced.is_counted, true));
        }
        Some(next)
    }

    /// Returns the number of signals so far that waited for a junction offering their side.
    pub const fn shortened(&self) -> u64 {
        self.shortened
    }

    /// Clears the memory. Must be called when the route changes.
    pub fn clear(&mut self) {
        self.starts.clear();
        self.passed.clear();
    }

    fn record(&mut self, context: &DecisionContext<'_>, turn: &TurnLane) -> Option<Section> {
        let path_frame = &context.path_frame;
        let front_m = turn.from_base_m(path_frame, turn.front) - path_frame.front_m();
        // A vehicle that is before the turn again has backed up, or was repositioned.
        if self.passed.contains(&turn.id) && (front_m <= 0.0 || !self.passed.remove(&turn.id)) {
            return None;
        }
        let rest_m = turn.from_base_m(path_frame, turn.back);
        if rest_m < 0.0 {
            let was_announced = self.starts.remove(&turn.id).is_some();
            if was_announced && !context.quirks.ignores_height_and_continuity {
                self.passed.insert(turn.id);
            }
            return None;
        }
        let search_m = turn
            .search_distance_m
            .unwrap_or_else(|| context.parameters.intersection_search_m(context.speed_mps));
        let in_range = front_m < search_m;
        if !in_range && (context.quirks.drops_announced_turns || !self.still_announced(context, turn.id)) {
            return None;
        }
        let is_at_its_end = front_m < 0.0 && rest_m < LAST_METRES_M && !self.starts.contains_key(&turn.id);
        if is_at_its_end && !context.quirks.ignores_height_and_continuity {
            return None;
        }
        let before_m = front_m + path_frame.front_m();
        let announced = AnnouncedTurn {
            start: context.ego(),
            before_m,
            is_shown: false,
            is_counted: false,
            waits_since: None,
        };
        let announced = self.starts.entry(turn.id).or_insert(announced);
        if in_range {
            announced.waits_since = None;
        }
        let junction = junction_ahead(context, turn, front_m, announced.is_shown);
        let waits = junction.is_some_and(|junction| junction.waits());
        announced.is_shown |= !waits;
        // A vehicle that has backed up approaches from farther away.
        let has_backed_up = before_m > announced.before_m && !context.quirks.ignores_height_and_continuity;
        if has_backed_up || waits {
            (announced.start, announced.before_m) = (context.ego(), before_m);
        }
        let section = turn.section(SignalSubject::Turn(turn.id), turn.signal(), announced.start);
        let place = turn.span_m.map(|span_m| SectionPlace { span_m, announced_before_m: announced.before_m });
        Some(Section { place, junction, ..section })
    }

    /// Returns whether a turn out of range stays announced, which ends when the vehicle has stood too long
    /// (W1).
    fn still_announced(&mut self, context: &DecisionContext<'_>, id: LaneId) -> bool {
        let Some(announced) = self.starts.get_mut(&id) else { return false };
        if !context.stands() {
            announced.waits_since = None;
            return true;
        }
        let since = *announced.waits_since.get_or_insert(context.now);
        let stays = context.now.since(since) <= context.standing_limit;
        if !stays {
            self.starts.remove(&id);
        }
        stays
    }
}

/// Returns the last junction before a turn that offers its side and is not passed yet; `front_m` is the
/// distance of the front to the turn.
fn junction_ahead(
    context: &DecisionContext<'_>,
    turn: &TurnLane,
    front_m: f64,
    is_shown: bool,
) -> Option<JunctionAhead> {
    let (rule, [start_m, _]) = (context.junction_rule?, turn.span_m?);
    let side = turn.signal().side().filter(|_| front_m > 0.0)?;
    let way = context.offered_before(side, start_m)?;
    let (speed_mps, seen_m) = (context.speed_mps, context.parameters.minimum_search_distance_m);
    Some(JunctionAhead { way, verdict: rule.verdict(front_m, speed_mps, seen_m, is_shown) })
}

/// Returns the first record whose required end lies ahead; the last one in any case.
pub(super) fn next_in_queue(path_frame: &PathFrame<'_>, records: Vec<Section>) -> Option<Section> {
    let last = records.last().copied();
    records.into_iter().find(|record| record.distances(path_frame).required_end_m >= 0.0).or(last)
}

/// The next turn while it is signalled, as in Autoware's planning factor
/// (docs/spec/turn-signal-decider.md, "Next-turn output").
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnAhead {
    /// The side of the turn.
    pub side: Side,
    /// The front is past the start of the turn.
    pub active: bool,
    /// Pose at the start of the turn.
    pub pose: Pose,
    /// Distance from the front to the start of the turn, metres.
    pub distance_m: f64,
}
