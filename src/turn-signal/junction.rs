//! Junctions that offer a side which the route does not take
//! (docs/spec/turn-signal-decider.md, "Junctions that are not taken"): before such a junction, other drivers
//! would mistake the signal of a later turn to that side for a turn there.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use super::country::Country;
use super::distance_path::DistancePath;
use super::side::Side;
use lanelet2_map::fork::{leads_left, parting};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};

/// The conditions on which a turn's signal waits until a junction is passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JunctionRule {
    /// The country's rule `turn_distance_m`: the law's minimum distance from the front to the turn, metres;
    /// `None` without such a rule.
    pub turn_distance_m: Option<f64>,
    /// Minimum time for which a signal is shown before its turn.
    pub least_time: Duration,
}

/// A way to a side at a junction where the route takes another way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OfferedWay {
    /// The lanelet that leads to that side.
    pub lane: LaneId,
    /// The side to which it leads.
    pub side: Side,
}

/// A junction ahead that offers the side of a later turn as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JunctionAhead {
    /// The way that is not taken.
    pub way: OfferedWay,
    /// The verdict on the turn's signal.
    pub verdict: JunctionVerdict,
}

/// The verdict on a turn's signal before a junction that offers its side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JunctionVerdict {
    /// The signal waits until the junction is passed.
    Waits,
    /// The signal is shown: the law demands this distance before the turn, metres.
    LawDemands(f64),
    /// The signal is shown: less than this distance before the turn, metres, it would be seen too late.
    SeenTooLate(f64),
}

/// A junction ahead, with the law if the law decides.
#[derive(Debug, Clone, PartialEq)]
pub struct JunctionRemark {
    /// The junction, and the verdict on the signal.
    pub ahead: JunctionAhead,
    /// The country whose law demands the signal; `None` if the signal waits, or is shown to be seen in time.
    pub country: Option<Arc<Country>>,
}

impl JunctionAhead {
    /// Returns whether the signal waits until it is passed.
    pub fn waits(&self) -> bool {
        self.verdict == JunctionVerdict::Waits
    }
}

impl JunctionRule {
    /// Returns the verdict on a signal whose turn is `turn_m` ahead of the front, metres; `seen_m` is the
    /// distance that it takes to be seen at any speed, metres.
    pub fn verdict(&self, turn_m: f64, speed_mps: f64, seen_m: f64, is_shown: bool) -> JunctionVerdict {
        let seen_m = seen_m.max(speed_mps * self.least_time.as_secs_f64());
        match self.turn_distance_m.filter(|legal_m| *legal_m >= seen_m) {
            Some(legal_m) if is_shown || turn_m <= legal_m => JunctionVerdict::LawDemands(legal_m),
            None if is_shown || turn_m <= seen_m => JunctionVerdict::SeenTooLate(seen_m),
            Some(_) | None => JunctionVerdict::Waits,
        }
    }
}

/// Returns the last junction on the distance path that offers `side` and is not taken, among the junctions
/// that the front of the vehicle has not passed and that begin before another position; both positions are
/// arc lengths on the path, metres.
pub fn last_offered(
    road: &LaneNetwork,
    path: &DistancePath,
    side: Side,
    [front_m, until_m]: [f64; 2],
) -> Option<OfferedWay> {
    let mut last = None;
    for (index, pair) in path.lanes.windows(2).enumerate() {
        let ([before, taken], Some([from_m, _])) = (pair, path.spans_m.get(index + 1)) else { continue };
        if *from_m >= until_m {
            break;
        }
        let (Some(other), Some(lane)) = (offered(road, *before, *taken, side), road.lane(*taken)) else {
            continue;
        };
        let passed_m = if lane.turn_direction == TurnDirection::Straight {
            end_of_crossing_m(road, path, index + 1)
        } else {
            from_m + parting(other, lane).map_or_else(|| lane.length_m(), |parting| parting.at_m)
        };
        if front_m < passed_m {
            last = Some(OfferedWay { lane: other.id, side });
        }
    }
    last
}

/// Returns the follower of `before` that leads to `side` of the lanelet `taken`, and is not taken.
fn offered(road: &LaneNetwork, before: LaneId, taken: LaneId, side: Side) -> Option<&Lanelet> {
    let followers = road.followers(before);
    let taken = road.lane(taken).filter(|lane| followers.len() > 1 && followers.contains(&lane.id))?;
    let others = followers.iter().filter(|id| **id != taken.id).filter_map(|id| road.lane(*id));
    others.into_iter().find(|other| leads_left(other, taken) == Some(side == Side::Left))
}

/// Returns the end of the lanelets that lead straight over a crossing, starting at an index of the path,
/// metres.
fn end_of_crossing_m(road: &LaneNetwork, path: &DistancePath, index: usize) -> f64 {
    let leads_straight =
        |id: &LaneId| road.lane(*id).is_some_and(|lane| lane.turn_direction == TurnDirection::Straight);
    let crossing = path.lanes.iter().zip(&path.spans_m).skip(index);
    crossing.take_while(|(id, _)| leads_straight(id)).last().map_or(0.0, |(_, [_, end_m])| *end_m)
}

impl JunctionRemark {
    /// Returns a key for programs: `waits`, `law` or `seen_too_late`.
    pub const fn key(&self) -> &'static str {
        match self.ahead.verdict {
            JunctionVerdict::Waits => "waits",
            JunctionVerdict::LawDemands(_) => "law",
            JunctionVerdict::SeenTooLate(_) => "seen_too_late",
        }
    }

    /// Returns the minimum distance by which the signal is shown, metres; `None` while it waits.
    pub const fn least_m(&self) -> Option<f64> {
        match self.ahead.verdict {
            JunctionVerdict::Waits => None,
            JunctionVerdict::LawDemands(least_m) | JunctionVerdict::SeenTooLate(least_m) => Some(least_m),
        }
    }
}

/// Writes for example `the signal waits until the way to the left on 12, which is not taken, is passed`.
impl fmt::Display for JunctionRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OfferedWay { lane, side } = self.ahead.way;
        let side = side.name();
        let law = self.country.as_ref().map_or("the law".to_owned(), |country| country.law());
        match self.ahead.verdict {
            JunctionVerdict::Waits => {
                write!(
                    f,
                    "the signal waits until the way to the {side} on {lane}, which is not taken, is passed"
                )
            }
            JunctionVerdict::LawDemands(least_m) => write!(
                f,
                "shown before the way to the {side} on {lane}, which is not taken, since the law demands it {least_m} m \
                 before the turn ({law})"
            ),
            JunctionVerdict::SeenTooLate(least_m) => write!(
                f,
                "shown before the way to the {side} on {lane}, which is not taken, since it would be seen too late \
                 less than {least_m:.0} m before the turn"
            ),
        }
    }
}
