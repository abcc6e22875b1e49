//! The whole decider treats left and right alike: on a mirrored road every command is the other one.

use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::polyline::{at_arc, headed};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use proptest::prelude::*;
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::inputs::{Inputs, Timed};
use turn_signal::light_command::TurnCommand;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::avoidance::{Avoidance, AvoidanceLine};
use turn_signal::manoeuvre::lane_change::LaneChange;
use turn_signal::planner_input::Odometry;
use turn_signal::shift::{ShiftLine, ShiftedPath};
use turn_signal::side::Side;

use super::drive::{inputs, lane_change, route_from};
use super::path_generator::{ROUTE, consecutive_turn};

/// A pose mirrored at the x axis.
fn mirrored_pose(pose: Pose) -> Pose {
    Pose { position: mirrored_point(&pose.position), yaw_rad: -pose.yaw_rad }
}

fn mirrored_point(point: &Point) -> Point {
    Point::new(point.x_m, -point.y_m)
}

fn mirrored_lane(lane: &Lanelet) -> Lanelet {
    let line = |points: &[Point]| points.iter().map(mirrored_point).collect();
    Lanelet {
        centerline: line(&lane.centerline),
        left_bound: line(&lane.right_bound),
        right_bound: line(&lane.left_bound),
        turn_direction: match lane.turn_direction {
            TurnDirection::Left => TurnDirection::Right,
            TurnDirection::Right => TurnDirection::Left,
            TurnDirection::None => TurnDirection::None,
            TurnDirection::Straight => TurnDirection::Straight,
        },
        left: lane.right,
        right: lane.left,
        ..lane.clone()
    }
}

/// The manoeuvres besides the turns, along the route.
#[derive(Debug, Clone)]
struct Events {
    side: Side,
    lane_change_m: Option<[f64; 2]>,
    avoidance_m: Option<[f64; 2]>,
}

/// A drive along the route, or its mirror image.
struct Drive {
    centerline: Vec<Pose>,
    is_mirrored: bool,
}

impl Drive {
    fn pose_at(&self, arc_m: f64) -> Pose {
        let points: Vec<Point> = self.centerline.iter().map(|pose| pose.position).collect();
        let position = at_arc(&points, arc_m).unwrap();
        let ahead = at_arc(&points, arc_m + 0.1).unwrap();
        let pose = Pose { position, yaw_rad: (ahead.y_m - position.y_m).atan2(ahead.x_m - position.x_m) };
        if self.is_mirrored { mirrored_pose(pose) } else { pose }
    }

    fn side(&self, side: Side) -> Side {
        if self.is_mirrored { side.opposite() } else { side }
    }

    fn lane_change(&self, events: &Events, ego_m: f64) -> Option<Manoeuvre> {
        let [from_m, to_m] = events.lane_change_m.filter(|[_, to_m]| ego_m <= *to_m)?;
        let [start, crossing, end] =
            [from_m, (from_m + to_m) / 2.0, to_m].map(|arc_m| Some(self.pose_at(arc_m)));
        let change = lane_change(self.side(events.side), start, end);
        Some(Manoeuvre::LaneChange(LaneChange { crossing, ..change }))
    }

    /// Around something on the other side than the lane change; `ego_m` comes with every cycle.
    fn avoidance(&self, events: &Events) -> Option<(f64, impl Fn(f64) -> Manoeuvre)> {
        let [from_m, to_m] = events.avoidance_m?;
        let offset_m = match self.side(events.side.opposite()) {
            Side::Left => 1.5,
            Side::Right => -1.5,
        };
        let shift_at = move |arc_m: f64| offset_m * ((arc_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
        let arcs = (0..70).map(|step| f64::from(step) * 2.0);
        let aside = |arc_m: f64| {
            let pose = self.pose_at(arc_m);
            Pose { position: pose.point_at(0.0, shift_at(arc_m)), ..pose }
        };
        let shifts_m = arcs.clone().map(shift_at).collect();
        let path = ShiftedPath::new(arcs.map(aside).collect(), shifts_m).unwrap();
        let [start, end] = [from_m, to_m].map(aside);
        let [start_index, end_index] = [start, end].map(|pose| path.nearest_index(pose.position));
        let line = ShiftLine { start_index, end_index, start, end };
        let line = AvoidanceLine { id: 7, line, start_shift_m: 0.0, end_shift_m: offset_m };
        let at = move |ego_m: f64| {
            Manoeuvre::Avoidance(Avoidance {
                path: path.clone(),
                lines: vec![line],
                ego_index: path.nearest_index(self.pose_at(ego_m).position),
                deviation_m: 0.0,
                current_shift_m: shift_at(ego_m),
                lanes: ROUTE.to_vec(),
                approved: true,
            })
        };
        Some((to_m, at))
    }

    fn commands(&self, compat: DeciderCompat, speeds_mps: &[f64], events: &Events) -> Vec<TurnCommand> {
        let road = consecutive_turn();
        let lanes = ROUTE.map(|id| road.lane(id).unwrap().clone());
        let road = if self.is_mirrored {
            LaneNetwork::new(lanes.iter().map(mirrored_lane), Vec::new())
        } else {
            road
        };
        let route = route_from(1, self.pose_at(0.0), &ROUTE);
        let mut decider = Decider::new(DeciderSettings::deployed(compat));
        let avoidance = self.avoidance(events);
        let (mut now, mut ego_m) = (MonoTime::from_millis(1000), 0.0);
        let mut commands = Vec::new();
        for speed_mps in speeds_mps {
            now = now.after(Duration::from_millis(400));
            ego_m = f64::min(ego_m + speed_mps * 0.4, 135.0);
            let manoeuvres = [
                avoidance.as_ref().filter(|(to_m, _)| ego_m <= *to_m).map(|(_, at)| at(ego_m)),
                self.lane_change(events, ego_m),
            ];
            let manoeuvres: Vec<_> =
                manoeuvres.into_iter().flatten().map(|value| Timed { at: now, value }).collect();
            let odometry = Odometry { pose: self.pose_at(ego_m), speed_mps: *speed_mps };
            let odometry = Timed { at: now, value: odometry };
            let inputs = Inputs { manoeuvres: &manoeuvres, ..inputs(odometry, &road, &route) };
            commands.push(decider.decide(&inputs, now).turn);
        }
        commands
    }
}

fn centerline() -> Vec<Pose> {
    let road = consecutive_turn();
    let centerlines = ROUTE.iter().flat_map(|id| road.lane(*id).unwrap().centerline.clone());
    headed(&centerlines.collect::<Vec<_>>())
}

fn other(signal: TurnCommand) -> TurnCommand {
    signal.side().map_or(signal, |side| side.opposite().into())
}

fn stretch() -> impl Strategy<Value = Option<[f64; 2]>> {
    proptest::option::of(
        (5.0..90.0_f64, 10.0..40.0_f64).prop_map(|(from_m, long_m)| [from_m, from_m + long_m]),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mirrored_road_has_mirrored_commands(
        speeds_mps in proptest::collection::vec(prop_oneof![3 => 1.0..9.0_f64, 1 => Just(0.0)], 55..70),
        left in any::<bool>(), lane_change_m in stretch(), avoidance_m in stretch(),
    ) {
        let side = if left { Side::Left } else { Side::Right };
        let events = Events { side, lane_change_m, avoidance_m };
        let [plain, mirror] = [false, true].map(|is_mirrored| Drive { centerline: centerline(), is_mirrored });
        for compat in [Upstream, Improved] {
            let signals = plain.commands(compat, &speeds_mps, &events);
            let mirrored: Vec<TurnCommand> =
                mirror.commands(compat, &speeds_mps, &events).into_iter().map(other).collect();
            prop_assert_eq!(&signals, &mirrored, "{:?}", compat);
            prop_assert!(signals.iter().any(|signal| signal.side().is_some()), "the first turn at least");
        }
    }
}
