//! A drive along the straight road with turns, roundabouts and manoeuvres added by hand, since on a straight
//! lanelet the whole of it is required section.

use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::path::{Path, PathFrame};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::{DeciderCompat, DeciderQuirks};
use turn_signal::decider::{Decider, DeciderSettings, Observed};
use turn_signal::decision::{Basis, Decision};
use turn_signal::decision_context::DecisionContext;
use turn_signal::light_command::TurnCommand;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use turn_signal::min_duration::MinDurations;
use turn_signal::parameters::DeciderParameters;
use turn_signal::route::Route;
use turn_signal::section::Section;
use turn_signal::side::Side;
use turn_signal::turn_lane::TurnLane;

pub(crate) use crate::pure::drive_scenarios::random_drives::drives::drawn_road::{
    HALF_WIDTH_M, inputs, route_from, segments,
};

use super::line::{NEAREST, at, line};

/// A lane change that is driven.
pub(crate) fn lane_change(side: Side, start: Option<Pose>, end: Option<Pose>) -> LaneChange {
    LaneChange {
        side,
        phase: LaneChangePhase::Running,
        start,
        crossing: None,
        end,
        previous_path: Vec::new(),
        minimum_length_m: 0.0,
    }
}

/// A straight lanelet from `from` to `to`.
pub(crate) fn straight_lane(id: i64, from: f64, to: f64) -> Lanelet {
    let side = |y: f64| vec![Point::new(from, y), Point::new(to, y)];
    Lanelet {
        id,
        centerline: side(0.0),
        left_bound: side(HALF_WIDTH_M),
        right_bound: side(-HALF_WIDTH_M),
        ..Lanelet::default()
    }
}

/// A turn on [`from`, `to`] whose required section ends at `required_end`.
pub(crate) fn turn(id: i64, direction: TurnDirection, from: f64, to: f64, required_end: f64) -> TurnLane {
    TurnLane {
        id,
        direction,
        search_distance_m: None,
        front: at(from),
        back: at(to),
        required_end: at(required_end),
        centerline: vec![at(from).position, at(to).position],
        span_m: None,
    }
}

/// A turn where a record lies.
pub(crate) fn turn_of(record: &Section, id: i64) -> TurnLane {
    let direction = match record.turn {
        TurnCommand::Left => TurnDirection::Left,
        TurnCommand::Right => TurnDirection::Right,
        TurnCommand::Disable | TurnCommand::NoCommand => TurnDirection::Straight,
    };
    let x = |pose: Pose| pose.position.x_m;
    turn(id, direction, x(record.required_start), x(record.desired_end), x(record.required_end))
}

/// A road to drive on, the vehicle, and a decider that goes along.
pub(crate) struct Drive {
    pub(crate) road: LaneNetwork,
    pub(crate) route: Route,
    pub(crate) parameters: DeciderParameters,
    pub(crate) settings: DeciderSettings,
    pub(crate) observed: Observed,
    pub(crate) decider: Decider,
    path: Path,
    now: MonoTime,
}

impl Drive {
    /// One long lanelet, nothing else.
    pub(crate) fn new(compat: DeciderCompat) -> Self {
        Self::on(LaneNetwork::new([straight_lane(1, -60.0, 300.0)], Vec::new()), &[1], compat)
    }

    /// This road and route, along the same line.
    pub(crate) fn on(road: LaneNetwork, route: &[i64], compat: DeciderCompat) -> Self {
        let settings = DeciderSettings::deployed(compat);
        Self {
            road,
            route: route_from(1, Pose::new(-50.0, 0.0, 0.0), route),
            parameters: DeciderParameters::DEPLOYED,
            decider: Decider::new(settings.clone()),
            settings,
            observed: Observed::default(),
            path: line(-60, 300),
            now: MonoTime::from_millis(1_000_000),
        }
    }

    /// Without minimum durations, to test sections alone.
    pub(crate) fn at_once(mut self) -> Self {
        self.settings.min_durations = MinDurations::NONE;
        self.decider = Decider::new(self.settings.clone());
        self
    }

    pub(crate) fn wait(&mut self, time: Duration) {
        self.now = self.now.after(time);
    }

    pub(crate) fn context(&self, ego: Pose, speed_mps: f64) -> DecisionContext<'_> {
        DecisionContext {
            road: &self.road,
            route: &self.route,
            path_frame: PathFrame::new(&self.path, ego, self.settings.vehicle.front_m(), NEAREST),
            way: None,
            speed_mps,
            parameters: &self.parameters,
            vehicle: &self.settings.vehicle,
            quirks: DeciderQuirks::of(self.settings.compat),
            standing_limit: self.settings.standing_limit,
            junction_rule: None,
            now: self.now,
        }
    }

    /// One cycle with the rear axle at `x_m`.
    pub(crate) fn step(&mut self, x_m: f64, speed_mps: f64, manoeuvres: &[Manoeuvre]) -> Decision {
        let mut decider = self.decider.clone();
        let observed = self.observed.clone();
        let decision = decider.decide_on(&self.context(at(x_m), speed_mps), manoeuvres, |_| observed);
        self.decider = decider;
        decision
    }

    /// Position from which the intersection candidate of a decision with the rear axle at `x_m` may be
    /// signalled; `None` without a candidate.
    pub(crate) fn announced_m(&self, decision: &Decision, x_m: f64) -> Option<f64> {
        let Basis::Candidates(resolution) = &decision.basis else { return None };
        let [intersection, ..] = &resolution.evaluated;
        let start_m = intersection.distances?.desired_start_m + x_m + self.settings.vehicle.front_m();
        Some((start_m * 1e6).round() / 1e6)
    }

    /// A drive through `xs` at one speed. The time between samples is that of the distance.
    pub(crate) fn through(
        &mut self,
        xs: impl IntoIterator<Item = f64>,
        speed_mps: f64,
        manoeuvres: impl Fn(f64) -> Vec<Manoeuvre>,
    ) -> Vec<(f64, TurnCommand)> {
        let mut before: Option<f64> = None;
        let mut signals = Vec::new();
        for x in xs {
            let moved = before.replace(x).map_or(0.0, |before| x - before);
            self.wait(Duration::from_secs_f64(moved / speed_mps));
            let decision = self.step(x, speed_mps, &manoeuvres(x));
            signals.push((x, decision.turn));
        }
        signals
    }
}
