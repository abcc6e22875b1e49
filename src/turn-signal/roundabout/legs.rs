//! Entries and exits of roundabouts along the distance path
//! (docs/spec/turn-signal-decider.md, "Roundabout entry" and "Roundabout exit").

use std::collections::BTreeSet;

use crate::decision_context::DecisionContext;
use crate::turn_lane::TurnLane;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::polyline::{back_pose, front_pose};
use lanelet2_map::lane_network::{LaneId, Roundabout};

/// Entries and exits, each in the order of the path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoundaboutLegs {
    /// The entries of roundabouts.
    pub entries: Vec<RoundaboutEntry>,
    /// The exits of roundabouts.
    pub exits: Vec<RoundaboutExit>,
}

/// An entry of a roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundaboutEntry {
    /// The lanelet that leads into the roundabout.
    pub lane: TurnLane,
    /// The last lanelet of the roundabout on the route; `None` when the route leaves it at once.
    pub leaving: Option<Leaving>,
    /// Exits for which left is signalled on entry.
    pub exits_left: Vec<LaneId>,
    /// Exits for which right is signalled on entry.
    pub exits_right: Vec<LaneId>,
}

/// The last lanelet of a roundabout on the route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leaving {
    /// Id of the lanelet.
    pub lane: LaneId,
    /// Pose at its end.
    pub back: Pose,
}

/// An exit of a roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundaboutExit {
    /// The lanelet that leads out of the roundabout.
    pub lane: TurnLane,
    /// Pose from which it may be signalled: the start of the tagged lanelets before it, otherwise its own
    /// start.
    pub start: Pose,
    /// Tagged lanelets lie before it.
    pub is_tagged: bool,
    /// Pose behind the previous exit, or at the start of the ring on the route; `None` if the previous
    /// lanelet is not part of the ring.
    pub after_previous: Option<Pose>,
}

/// Returns the entries and exits along `lanes`, the ids of the distance path.
pub fn legs(context: &DecisionContext<'_>, lanes: &[LaneId]) -> RoundaboutLegs {
    let mut legs = RoundaboutLegs::default();
    let mut before: Option<LaneId> = None;
    for id in lanes {
        let previous = before.replace(*id);
        if context.road.roundabouts_of(*id).any(|element| element.entries.contains(id)) {
            let continues = !context.quirks.splits_turns
                && previous.is_some_and(|before| enters_with(context, before, *id));
            match (legs.entries.last_mut().filter(|_| continues), entry(context, *id)) {
                (Some(last), Some(next)) => {
                    last.join(next, context.parameters.roundabout_angle_threshold_deg);
                }
                (_, next) => legs.entries.extend(next),
            }
        }
        if context.road.roundabouts_of(*id).any(|element| element.exits.contains(id)) {
            legs.exits.extend(exit(context, *id));
        }
    }
    legs
}

/// Returns whether both lanelets lead into one roundabout, one after the other, as in a split entry (W7).
fn enters_with(context: &DecisionContext<'_>, before: LaneId, id: LaneId) -> bool {
    let both = |element: &Roundabout| element.entries.contains(&before) && element.entries.contains(&id);
    context.road.followers(before).contains(&id) && context.road.roundabouts_of(id).any(both)
}

impl RoundaboutEntry {
    fn join(&mut self, next: Self, threshold_deg: f64) {
        self.lane = self.lane.joined(&next.lane, threshold_deg);
        self.leaving = next.leaving;
        self.exits_left.extend(next.exits_left);
        self.exits_right.extend(next.exits_right);
    }
}

fn turn_lane(context: &DecisionContext<'_>, id: LaneId) -> Option<TurnLane> {
    TurnLane::new(context.road.lane(id)?, context.parameters.roundabout_angle_threshold_deg)
}

fn entry(context: &DecisionContext<'_>, id: LaneId) -> Option<RoundaboutEntry> {
    let lane = context.road.lane(id)?;
    // Upstream considers only the first element (W10).
    let considered = if context.quirks.overlooks_roundabout_exits { 1 } else { usize::MAX };
    let elements = || context.road.roundabouts_of(id).take(considered);
    let leaving = elements().find_map(|element| leaving(context, id, element));
    Some(RoundaboutEntry {
        lane: turn_lane(context, id)?,
        leaving,
        exits_left: lane.exits_signalled_left.clone(),
        exits_right: lane.exits_signalled_right.clone(),
    })
}

fn leaving(context: &DecisionContext<'_>, entry: LaneId, element: &Roundabout) -> Option<Leaving> {
    let mut last = entry;
    let mut visited = BTreeSet::from([entry]);
    while let Some(next) = context.route.next(context.road, last, context.quirks) {
        // A ring that closes on itself would otherwise be walked for ever.
        if !element.contains(next) || !visited.insert(next) {
            break;
        }
        last = next;
    }
    let lane = Some(last).filter(|last| *last != entry)?;
    Some(Leaving { lane, back: back_pose(&context.road.lane(lane)?.centerline)? })
}

fn exit(context: &DecisionContext<'_>, id: LaneId) -> Option<RoundaboutExit> {
    let lane = turn_lane(context, id)?;
    let tagged = |lane: LaneId| context.road.lane(lane).is_some_and(|lane| lane.enables_exit_signal);
    let farthest = farthest_back(context, id, tagged);
    let tagged_start = farthest.and_then(|far| front_pose(&context.road.lane(far)?.centerline));
    let elements: Vec<&Roundabout> =
        context.road.roundabouts_of(id).filter(|element| element.exits.contains(&id)).collect();
    let only_here = |lane: LaneId| {
        // Behind a lanelet from which another exit branches off, a signal would refer to that exit.
        let branches = context
            .road
            .followers(lane)
            .iter()
            .any(|next| *next != id && elements.iter().any(|element| element.exits.contains(next)));
        !branches && elements.iter().any(|element| element.internals.contains(&lane))
    };
    let after = farthest_back(context, id, only_here);
    let after_previous = after.and_then(|after| front_pose(&context.road.lane(after)?.centerline));
    Some(RoundaboutExit {
        start: tagged_start.unwrap_or(lane.front),
        is_tagged: tagged_start.is_some(),
        after_previous,
        lane,
    })
}

/// Returns the lanelet farthest back along the route for which the condition holds for it and all lanelets up
/// to `from` (excluded).
fn farthest_back(
    context: &DecisionContext<'_>,
    from: LaneId,
    holds: impl Fn(LaneId) -> bool,
) -> Option<LaneId> {
    let mut visited = BTreeSet::from([from]);
    let mut farthest = None;
    let mut here = from;
    let before_it = |here| context.route.previous(context.road, here, context.quirks);
    while let Some(before) = before_it(here).into_iter().find(|before| holds(*before)) {
        if !visited.insert(before) {
            break;
        }
        farthest = Some(before);
        here = before;
    }
    farthest
}
