//! The path generator a second time, written from docs/spec/turn-signal-decider.md, "Path generator", with a
//! geometry of its own. Random drives get the same commands from both.

use std::collections::BTreeMap;

use lanelet2_map::geometry::{Point, Pose, wrapped};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};
use turn_signal::light_command::TurnCommand;
use turn_signal::parameters::DeciderParameters;
use turn_signal::planner_input::Odometry;
use turn_signal::route::Route;

use super::aligned::by_the_rule;

/// Numbers of buckets of the hash table, more than any route here needs.
const BUCKETS: [usize; 4] = [13, 29, 59, 127];
/// The two may differ where a comparison is decided by less than this, metres, radians or degrees.
const ROUNDING: f64 = 1e-6;

/// The rule, with what it remembers.
pub(crate) struct ReferenceRule<'a> {
    road: &'a LaneNetwork,
    parameters: &'a DeciderParameters,
    front_m: f64,
    place: Option<(LaneId, Pose)>,
    /// The aligned starts found so far, each with its margin.
    aligned: BTreeMap<LaneId, (Option<Point>, f64)>,
    /// The least by which a comparison was decided in this cycle.
    margin: f64,
}

/// A walk over lanelets: along the route's own graph, and beyond it along the map's.
#[derive(Clone, Copy)]
struct Walk {
    is_forwards: bool,
    goes_beyond: bool,
    length_m: f64,
}

/// A place on a line.
struct Foot {
    arc_m: f64,
    distance_m: f64,
    yaw_rad: f64,
}

fn foot(line: &[Point], from: Point) -> Foot {
    let mut best = Foot { arc_m: 0.0, distance_m: f64::INFINITY, yaw_rad: 0.0 };
    let mut before_m = 0.0;
    for pair in line.windows(2) {
        let [ahead, aside] = [pair[1].x_m - pair[0].x_m, pair[1].y_m - pair[0].y_m];
        let length_m = ahead.hypot(aside);
        if length_m == 0.0 {
            continue;
        }
        let along = ((from.x_m - pair[0].x_m) * ahead + (from.y_m - pair[0].y_m) * aside) / length_m;
        let along_m = along.max(0.0).min(length_m);
        let at = [pair[0].x_m + ahead * along_m / length_m, pair[0].y_m + aside * along_m / length_m];
        let distance_m = (from.x_m - at[0]).hypot(from.y_m - at[1]);
        if distance_m < best.distance_m {
            best = Foot { arc_m: before_m + along_m, distance_m, yaw_rad: aside.atan2(ahead) };
        }
        before_m += length_m;
    }
    best
}

fn ring(lane: &Lanelet) -> Vec<Point> {
    let mut ring: Vec<Point> = lane.left_bound.clone();
    ring.extend(lane.right_bound.iter().rev());
    ring.extend(lane.left_bound.first());
    ring
}

/// Whether a point is inside: the ring winds around it.
fn is_inside(ring: &[Point], point: Point) -> bool {
    let direction = |at: &Point| (at.y_m - point.y_m).atan2(at.x_m - point.x_m);
    let turned: f64 = ring.windows(2).map(|pair| wrapped(direction(&pair[1]) - direction(&pair[0]))).sum();
    turned.abs() > std::f64::consts::PI
}

/// The ids in the order in which the table holds them.
fn in_table(ids: &[LaneId]) -> Vec<LaneId> {
    let mut sizes = BUCKETS.into_iter();
    let (mut list, mut buckets) = (Vec::new(), 0);
    let insert = |list: &mut Vec<LaneId>, id: LaneId, buckets: usize| {
        let bucket = |id: LaneId| id.cast_unsigned() % buckets as u64;
        let at = list.iter().position(|other| bucket(*other) == bucket(id)).unwrap_or(0);
        list.insert(at, id);
    };
    for id in ids {
        if list.len() == buckets {
            buckets = sizes.next().unwrap();
            for held in std::mem::take(&mut list) {
                insert(&mut list, held, buckets);
            }
        }
        insert(&mut list, *id, buckets);
    }
    list
}

impl<'a> ReferenceRule<'a> {
    pub(crate) fn new(road: &'a LaneNetwork, parameters: &'a DeciderParameters, front_m: f64) -> Self {
        Self { road, parameters, front_m, place: None, aligned: BTreeMap::new(), margin: f64::INFINITY }
    }

    /// The command of the next cycle; `None` if rounding decides.
    pub(crate) fn command(&mut self, route: &Route, odometry: Odometry) -> Option<TurnCommand> {
        self.margin = f64::INFINITY;
        let lane = self.lane(route, odometry.pose);
        self.place = Some((lane, odometry.pose));
        let path = self.path(route, lane, odometry.pose);
        let command = self.of_path(route, &path, odometry);
        (self.margin > ROUNDING).then_some(command)
    }

    fn decided(&mut self, difference: f64) -> bool {
        self.margin = self.margin.min(difference.abs());
        difference > 0.0
    }

    fn of(&self, id: LaneId) -> &'a Lanelet {
        self.road.lane(id).unwrap()
    }

    fn length_m(&self, id: LaneId) -> f64 {
        let line = &self.of(id).centerline;
        line.windows(2).map(|pair| (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m)).sum()
    }

    /// The lanelet of the vehicle.
    fn lane(&mut self, route: &Route, ego: Pose) -> LaneId {
        let all: Vec<LaneId> = route.lanes().collect();
        let (before, at) = self.place.unwrap_or_else(|| (self.nearest(&all, ego, false).unwrap(), ego));
        let mut met = Vec::new();
        let walk = |is_forwards| Walk { is_forwards, goes_beyond: false, length_m: 100.0 };
        let mut around = self.walk(route, (before, at), walk(false), &mut met);
        around.push(before);
        met.push(before);
        around.extend(self.walk(route, (before, at), walk(true), &mut met));
        self.nearest(&around, ego, true).or_else(|| self.nearest(&around, ego, false)).unwrap()
    }

    fn nearest(&mut self, lanes: &[LaneId], ego: Pose, is_limited: bool) -> Option<LaneId> {
        let mut ranked: Vec<(f64, f64, LaneId)> = Vec::new();
        for id in lanes {
            let (ring, middle) = (ring(self.of(*id)), foot(&self.of(*id).centerline, ego.position));
            let border_m = foot(&ring, ego.position).distance_m;
            let distance_m = if is_inside(&ring, ego.position) { 0.0 } else { border_m };
            let turned_rad = wrapped(middle.yaw_rad - ego.yaw_rad).abs();
            let limits = self.parameters.nearest;
            if !is_limited || distance_m <= limits.distance_m && turned_rad <= limits.yaw_rad {
                ranked.push((distance_m, turned_rad, *id));
            }
        }
        ranked.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
        ranked.dedup_by_key(|(.., id)| *id);
        if let [first, second, ..] = ranked[..] {
            let by_distance = second.0 - first.0;
            self.decided(if by_distance > 0.0 { by_distance } else { second.1 - first.1 });
        }
        ranked.first().map(|(.., id)| *id)
    }

    /// The lanelets after or before a place, the nearest first after, last before.
    fn walk(
        &self,
        route: &Route,
        (from, at): (LaneId, Pose),
        walk: Walk,
        met: &mut Vec<LaneId>,
    ) -> Vec<LaneId> {
        let listed: Vec<LaneId> =
            route.segments().iter().flat_map(|segment| segment.lanes.iter().copied()).collect();
        let of_route = in_table(&listed);
        let along_m = foot(&self.of(from).centerline, at.position).arc_m;
        let mut covered_m = if walk.is_forwards { self.length_m(from) - along_m } else { along_m };
        let (mut here, mut lanes) = (from, Vec::new());
        while covered_m < walk.length_m {
            let on_map =
                if walk.is_forwards { self.road.followers(here) } else { self.road.predecessors(here) };
            let on_route = of_route.iter().find(|id| listed.contains(&here) && on_map.contains(id));
            let beyond = on_map.first().filter(|_| walk.goes_beyond);
            let Some(next) = on_route.or(beyond).copied().filter(|next| !met.contains(next)) else { break };
            met.push(next);
            covered_m += self.length_m(next);
            lanes.push(next);
            here = next;
        }
        if !walk.is_forwards {
            lanes.reverse();
        }
        lanes
    }

    /// The lanelets of the path.
    fn path(&mut self, route: &Route, lane: LaneId, ego: Pose) -> Vec<LaneId> {
        let walk = |is_forwards, length_m: f64| Walk {
            is_forwards,
            goes_beyond: true,
            length_m: length_m + self.front_m,
        };
        let mut met = Vec::new();
        let mut lanes = self.walk(route, (lane, ego), walk(false, 5.0), &mut met);
        let behind = lanes.len();
        lanes.push(lane);
        met.push(lane);
        lanes.extend(self.walk(route, (lane, ego), walk(true, 300.0), &mut met));

        let starts_m: Vec<f64> = (0..=lanes.len())
            .map(|count| lanes.iter().take(count).map(|id| self.length_m(*id)).sum())
            .collect();
        let ego_m = starts_m[behind] + foot(&self.of(lane).centerline, ego.position).arc_m;
        let last = route.segments().last().unwrap().preferred;
        let mut to_m = ego_m + 300.0;
        if let (Some(at), Some(goal)) = (lanes.iter().position(|id| *id == last), route.goal()) {
            to_m = to_m.min(starts_m[at] + foot(&self.of(last).centerline, goal.position).arc_m);
        }
        to_m = to_m.min(starts_m[lanes.len()] - self.front_m);
        let mut path = Vec::new();
        for (index, id) in lanes.iter().enumerate() {
            let begins = self.decided(to_m - starts_m[index]);
            if begins && self.decided(starts_m[index + 1] - (ego_m - 5.0)) {
                path.push(*id);
            }
        }
        path
    }

    fn of_path(&mut self, route: &Route, path: &[LaneId], odometry: Odometry) -> TurnCommand {
        let preferred = |at: Option<&turn_signal::route::Segment>| at.unwrap().preferred;
        let [first, last] = [route.segments().first(), route.segments().last()].map(preferred);
        let ego = odometry.pose.position;
        let mut own = TurnCommand::NoCommand;
        let mut before_m = None;
        for (index, id) in path.iter().enumerate() {
            let (lane, followers) = (self.of(*id), self.road.followers(*id));
            let is_met = path[..index].contains(id);
            let goes_on = *id != last
                && followers.first() != Some(&first)
                && followers.iter().any(|next| route.contains(*next));
            if is_met || !goes_on {
                continue;
            }
            let command = match lane.turn_direction {
                TurnDirection::Left => TurnCommand::Left,
                TurnDirection::Right => TurnCommand::Right,
                TurnDirection::Straight => TurnCommand::Disable,
                TurnDirection::None => TurnCommand::NoCommand,
            };
            let is_tagged = command != TurnCommand::NoCommand;
            if let Some(gap_m) = before_m {
                if is_tagged {
                    let of_speed_m = self.parameters.intersection_search_m(odometry.speed_mps);
                    let search_m = lane.turn_signal_distance_m.unwrap_or(of_speed_m);
                    return if self.decided(gap_m - search_m) { TurnCommand::NoCommand } else { command };
                }
                before_m = Some(gap_m + self.length_m(*id));
                continue;
            }
            let ring = ring(lane);
            self.decided(foot(&ring, ego).distance_m);
            if !is_inside(&ring, ego) {
                continue;
            }
            let along_m = foot(&lane.centerline, ego).arc_m;
            if is_tagged {
                own = command;
                let threshold_deg = self.parameters.intersection_angle_threshold_deg;
                let found = || by_the_rule(&lane.centerline, threshold_deg);
                let (start, margin_deg) = *self.aligned.entry(*id).or_insert_with(found);
                self.decided(margin_deg);
                let Some(start) = start else { continue };
                if !self.decided(along_m - foot(&lane.centerline, start).arc_m) {
                    return command;
                }
            }
            before_m = Some(self.length_m(*id) - along_m - self.front_m);
        }
        own
    }
}
