//! A drive along the straight road with turns, roundabouts and manoeuvres put on it by hand, since on
//! a straight lanelet the whole of it is required section.

use std::time::Duration;

use signal_gateway::core::map::geometry::path::{Path, PathFrame};
use signal_gateway::core::map::geometry::{Point, Pose};
use signal_gateway::core::map::lane_network::{Lane, LaneNetwork, TurnDirection};
use signal_gateway::core::time::MonoTime;
use signal_gateway::core::turn_signal::compat::{DeciderCompat, UpstreamQuirks};
use signal_gateway::core::turn_signal::decider::{Decider, Observed, Settings};
use signal_gateway::core::turn_signal::decision::{Basis, Decision};
use signal_gateway::core::turn_signal::decision_context::DecisionContext;
use signal_gateway::core::turn_signal::manoeuvre::Manoeuvre;
use signal_gateway::core::turn_signal::min_duration::MinDurations;
use signal_gateway::core::turn_signal::parameters::Parameters;
use signal_gateway::core::turn_signal::route::Route;
use signal_gateway::core::turn_signal::section::Section;
use signal_gateway::core::turn_signal::signal::Signal;
use signal_gateway::core::turn_signal::turn_lane::TurnLane;

use super::line::{NEAREST, at, line};

/// Half the width of the lane, metres.
pub(crate) const HALF_WIDTH_M: f64 = 1.75;

/// A straight lanelet from `from` to `to`.
pub(crate) fn straight_lane(id: i64, from: f64, to: f64) -> Lane {
    let side = |y: f64| vec![Point::new(from, y), Point::new(to, y)];
    Lane {
        id,
        centerline: side(0.0),
        left_bound: side(HALF_WIDTH_M),
        right_bound: side(-HALF_WIDTH_M),
        ..Lane::default()
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
    }
}

/// A turn where a record lies.
pub(crate) fn turn_of(record: &Section, id: i64) -> TurnLane {
    let direction = match record.turn {
        Signal::Left => TurnDirection::Left,
        Signal::Right => TurnDirection::Right,
        Signal::Disable | Signal::NoCommand => TurnDirection::Straight,
    };
    let x = |pose: Pose| pose.position.x_m;
    turn(id, direction, x(record.required_start), x(record.desired_end), x(record.required_end))
}

/// A road to drive on, the vehicle, and a decider that goes along.
pub(crate) struct Drive {
    pub(crate) road: LaneNetwork,
    pub(crate) route: Route,
    pub(crate) parameters: Parameters,
    pub(crate) settings: Settings,
    pub(crate) seen: Observed,
    pub(crate) decider: Decider,
    path: Path,
    now: MonoTime,
}

impl Drive {
    /// One long lanelet, nothing else.
    pub(crate) fn new(mode: DeciderCompat) -> Self {
        Self::on(LaneNetwork::new([straight_lane(1, -60.0, 300.0)], Vec::new()), &[1], mode)
    }

    /// This road and route, along the same line.
    pub(crate) fn on(road: LaneNetwork, route: &[i64], mode: DeciderCompat) -> Self {
        let settings = Settings::deployed(mode);
        Self {
            road,
            route: Route::single_file(1, Pose::new(-50.0, 0.0, 0.0), route).unwrap(),
            parameters: Parameters::DEPLOYED,
            decider: Decider::new(settings.clone()),
            settings,
            seen: Observed::default(),
            path: line(-60, 300),
            now: MonoTime::from_millis(1_000_000),
        }
    }

    /// Every change at once, to look at sections alone.
    pub(crate) fn at_once(mut self) -> Self {
        self.settings.min_durations = MinDurations::NONE;
        self.decider = Decider::new(self.settings.clone());
        self
    }

    pub(crate) fn wait(&mut self, time: Duration) {
        self.now = self.now.after(time);
    }

    pub(crate) fn scene(&self, ego: Pose, speed_mps: f64) -> DecisionContext<'_> {
        DecisionContext {
            road: &self.road,
            route: &self.route,
            path_frame: PathFrame::new(&self.path, ego, self.settings.vehicle.front_m(), NEAREST),
            speed_mps,
            parameters: &self.parameters,
            vehicle: &self.settings.vehicle,
            quirks: UpstreamQuirks::of(self.settings.compat),
            now: self.now,
        }
    }

    /// One cycle with the rear axle at `x_m`.
    pub(crate) fn step(&mut self, x_m: f64, speed_mps: f64, manoeuvres: &[Manoeuvre]) -> Decision {
        let mut decider = self.decider.clone();
        let seen = self.seen.clone();
        let decision = decider.decide_on(&self.scene(at(x_m), speed_mps), manoeuvres, |_| seen);
        self.decider = decider;
        decision
    }

    /// Where the intersection candidate of a decision with the rear axle at `x_m` may be signalled from; `None`
    /// without a candidate.
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
    ) -> Vec<(f64, Signal)> {
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
