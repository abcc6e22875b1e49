//! Roads that are drawn piece by piece, as of routes that meet themselves: around a block, through a
//! teardrop, back over a place that was passed. The vehicle drives along the middle, and what it signals is
//! held against the pieces.

use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::polyline::{headed, length_m, nearest, without_repeats};
use lanelet2_map::geometry::required_end::required_end;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::DeciderCompat::{Improved, PathGenerator};
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::inputs::{Inputs, Timed};
use turn_signal::light_command::TurnCommand;
use turn_signal::planner_input::Odometry;
use turn_signal::route::{Route, Segment};
use turn_signal::side::Side;

use super::path_generator::ReferenceRule;

/// Half the width of the lane, metres.
pub(crate) const HALF_WIDTH_M: f64 = 1.75;
/// The front of the sample vehicle before its rear axle, metres.
const FRONT_M: f64 = 3.79;
/// Nothing is announced farther ahead than 30 m and 3 s.
const CONSTANT_M: f64 = 30.0;
const SEARCH_S: f64 = 3.0;
/// What the middle of the lanes and the smoothed path differ by, metres.
const MARGIN_M: f64 = 1.5;
/// Of turns that begin within this distance, either may be signalled, metres.
const SAME_START_M: f64 = 3.0;
const CYCLE: Duration = Duration::from_millis(100);
/// A signal may last so long to be seen, s.
const MINIMUM_S: f64 = 1.6;

/// A piece of road: a lanelet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Piece {
    /// Length, metres.
    Straight(f64),
    /// Radius, metres; degrees, positive to the left; what it is tagged.
    Arc(f64, f64, TurnDirection),
}
use Piece::{Arc, Straight};
use TurnDirection::{Left, None as Untagged, Right};

impl Piece {
    pub(crate) fn length_m(self) -> f64 {
        match self {
            Straight(length_m) => length_m,
            Arc(radius_m, degrees, _) => radius_m * degrees.abs().to_radians(),
        }
    }
}

/// A road that is driven from its first lanelet to its last.
pub(crate) struct DrawnRoad {
    pub(crate) road: LaneNetwork,
    pub(crate) route: Route,
    /// Its turns: side, start, end of the required section, end, metres.
    pub(crate) turns: Vec<(Side, [f64; 3])>,
    poses: Vec<Pose>,
}

impl DrawnRoad {
    /// These pieces, whose lanelets have these ids. Each leads to the next one, and those of `joints` to the
    /// start of another one as well.
    pub(crate) fn new(pieces: &[Piece], ids: &[LaneId], joints: &[[usize; 2]]) -> Self {
        let (mut lanes, mut middle, mut turns, mut start_m) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
        for (index, (piece, poses)) in pieces.iter().zip(drawn(pieces)).enumerate() {
            let side = |by_m: f64| poses.iter().map(|pose| pose.point_at(0.0, by_m)).collect::<Vec<_>>();
            let centerline = side(0.0);
            let direction = if let Arc(.., direction) = piece { *direction } else { Untagged };
            let end_m = start_m + length_m(&centerline);
            let tags = [(Left, Side::Left), (Right, Side::Right)];
            if let Some((_, side)) = tags.into_iter().find(|(tag, _)| *tag == direction) {
                let required = required_end(&centerline, 15.0).unwrap();
                let required_m = start_m + nearest(&centerline, required.position).unwrap().arc_m;
                turns.push((side, [start_m, required_m, end_m]));
            }
            start_m = end_m;
            let joined = joints.iter().filter(|[from, _]| *from == index).map(|[_, to]| *to);
            let next = Some(index + 1).filter(|next| *next < pieces.len());
            lanes.push(Lanelet {
                id: ids[index],
                left_bound: side(HALF_WIDTH_M),
                right_bound: side(-HALF_WIDTH_M),
                followers: next.into_iter().chain(joined).map(|next| ids[next]).collect(),
                turn_direction: direction,
                centerline: centerline.clone(),
                ..Lanelet::default()
            });
            middle.extend(centerline);
        }
        let poses = headed(&without_repeats(&middle));
        let route = route_from(1, poses[0], ids).with_goal(*poses.last().unwrap());
        Self { road: LaneNetwork::new(lanes, Vec::new()), route, poses, turns }
    }

    /// The pose on the middle of the road, metres from its start.
    fn at(&self, at_m: f64) -> Pose {
        let mut rest_m = at_m;
        for pair in self.poses.windows(2) {
            let piece_m = pair[0].position.distance_m(pair[1].position);
            if rest_m <= piece_m {
                return Pose {
                    position: pair[0].position.toward(pair[1].position, rest_m / piece_m),
                    ..pair[0]
                };
            }
            rest_m -= piece_m;
        }
        *self.poses.last().unwrap()
    }

    fn length_m(&self) -> f64 {
        length_m(&self.poses.iter().map(|pose| pose.position).collect::<Vec<_>>())
    }

    /// The first place at which the path generator's command is not that of its rule, at this speed.
    pub(crate) fn differing(&self, speed_mps: f64) -> Option<String> {
        let settings = DeciderSettings::deployed(PathGenerator);
        let front_m = settings.vehicle.front_m();
        let mut rule = ReferenceRule::new(&self.road, &settings.parameters, front_m);
        let mut decider = Decider::new(settings.clone());
        let step_m = speed_mps * CYCLE.as_secs_f64();
        let places = (0..100_000).map(|step| f64::from(step) * step_m);
        places.take_while(|at_m| *at_m < self.length_m()).find_map(|at_m| {
            let value = Odometry { pose: self.at(at_m), speed_mps };
            let now = MonoTime::from_millis(50_000);
            let shown = decider.decide(&inputs(Timed { at: now, value }, &self.road, &self.route), now).turn;
            let expected = rule.command(&self.route, value)?;
            (shown != expected).then(|| format!("path_generator: {shown:?} at {at_m:.2} m, not {expected:?}"))
        })
    }

    /// What is shown along `ways`: each from one position to another, at this speed.
    pub(crate) fn drive(&self, speed_mps: f64, ways: &[[f64; 2]]) -> Vec<(f64, TurnCommand)> {
        let mut decider = Decider::new(DeciderSettings::deployed(Improved));
        let mut now = MonoTime::from_millis(50_000);
        let mut shown = Vec::new();
        for [from_m, to_m] in ways {
            let step_m = speed_mps * CYCLE.as_secs_f64() * (to_m - from_m).signum();
            let mut at_m = *from_m;
            while (to_m - at_m) * step_m.signum() > 0.0 {
                now = now.after(CYCLE);
                let value = Odometry { pose: self.at(at_m), speed_mps: speed_mps.copysign(step_m) };
                let decision =
                    decider.decide(&inputs(Timed { at: now, value }, &self.road, &self.route), now);
                shown.push((at_m, decision.turn));
                at_m += step_m;
            }
        }
        shown
    }

    /// The first law that is broken from its start to its end: every turn is signalled while it is required,
    /// and no side long before or after a turn to it.
    pub(crate) fn broken(&self, speed_mps: f64) -> Option<String> {
        let shown = self.drive(speed_mps, &[[1.0, self.length_m() - 1.0]]);
        shown.into_iter().find_map(|(at_m, turn)| self.broken_at(at_m, turn, speed_mps))
    }

    fn broken_at(&self, at_m: f64, turn: TurnCommand, speed_mps: f64) -> Option<String> {
        let required = |before_m: f64, behind_m: f64| {
            self.turns.iter().filter(move |(_, [start_m, required_m, _])| {
                (start_m - FRONT_M - before_m..=required_m + behind_m).contains(&at_m)
            })
        };
        let is_shown = |(side, _): &(Side, _)| turn.side() == Some(*side);
        if let Some((side, _)) = required(-MARGIN_M, -MARGIN_M).next()
            && !required(SAME_START_M, MARGIN_M).any(is_shown)
        {
            return Some(format!("{turn:?} at {at_m:.1} m, in a turn {side:?}, of {:?}", self.turns));
        }
        let side = turn.side()?;
        let announced_m = FRONT_M + CONSTANT_M + SEARCH_S * speed_mps + MARGIN_M;
        let is_wanted = |(of, [start_m, _, end_m]): &(Side, [f64; 3])| {
            *of == side && (start_m - announced_m..=end_m + MARGIN_M + MINIMUM_S * speed_mps).contains(&at_m)
        };
        let is_wanted = self.turns.iter().any(is_wanted);
        (!is_wanted).then(|| format!("{turn:?} at {at_m:.1} m, turns {:?}", self.turns))
    }
}

/// The poses of each piece, one after the other.
pub(crate) fn drawn(pieces: &[Piece]) -> Vec<Vec<Pose>> {
    let mut here = Pose::default();
    let next = |piece: &Piece| {
        let poses = drawn_from(here, *piece);
        here = *poses.last().unwrap();
        poses
    };
    pieces.iter().map(next).collect()
}

/// A pose every half metre, or every three degrees.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // some hundred steps
fn drawn_from(from: Pose, piece: Piece) -> Vec<Pose> {
    match piece {
        Straight(piece_m) => {
            let steps = (piece_m * 2.0).ceil();
            (0..=steps as u32)
                .map(|step| Pose { position: from.point_at(piece_m * f64::from(step) / steps, 0.0), ..from })
                .collect()
        }
        Arc(radius_m, degrees, _) => {
            let steps = (degrees.abs() / 3.0).ceil();
            let side = degrees.signum();
            let pose = |step: u32| {
                let turned = (degrees * f64::from(step) / steps).to_radians();
                let (ahead_m, left_m) =
                    (radius_m * turned.abs().sin(), side * radius_m * (1.0 - turned.cos()));
                Pose { position: from.point_at(ahead_m, left_m), yaw_rad: from.yaw_rad + turned }
            };
            (0..=steps as u32).map(pose).collect()
        }
    }
}

/// Segments of one lanelet each.
pub(crate) fn segments(lanes: &[LaneId]) -> Vec<Segment> {
    lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] }).collect()
}

/// A route over single lanelets.
pub(crate) fn route_from(id: u128, start: Pose, lanes: &[LaneId]) -> Route {
    Route::new(id, start, segments(lanes)).unwrap()
}

/// Inputs with odometry, map and route alone.
pub(crate) fn inputs<'a>(odometry: Timed<Odometry>, road: &'a LaneNetwork, route: &'a Route) -> Inputs<'a> {
    Inputs {
        odometry: Some(odometry),
        road: Some(road),
        route: Some(route),
        planned_path: None,
        manoeuvres: &[],
        lane_driving: true,
    }
}
