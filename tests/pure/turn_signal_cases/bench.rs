//! A gateway with nothing but the decider, on virtual time: a straight road of two lanes,
//! one of which has a lanelet tagged as a left turn from 60 to 80 m.

use std::sync::Arc;
use std::time::Duration;

use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::gateway::event::{Input, Output};
use lanelet2_map::geometry::Pose;
use turn_signal::decision::Decision;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::output::TurnSignalOutput;
use turn_signal::planner_input::{
    ControlPoint, Odometry, PlannedPathPoint, PlannerInput, PlannerRoute, PlanningFactor,
};

use super::drive::segments;
use crate::support::clock::{at, at_ms, millis};
use crate::support::files::MemoryFiles;
use crate::support::two_lanes;
use crate::support::virtual_gateway::VirtualGateway;

/// A decider with these keys in `[turn_signal]`, from 10 s on.
pub(crate) fn decider(keys: &str) -> VirtualGateway {
    let gateway = format!("[turn_signal]\nmap = \"map.osm\"\n{keys}\n");
    let files = MemoryFiles::new([("gateway.toml", gateway), ("map.osm", two_lanes::osm([0, 60, 80, 200]))]);
    VirtualGateway::starting_at(MonoTime::from_millis(10_000), files.settings().gateway)
}

/// Planner inputs go in, commands and decisions come out.
impl VirtualGateway {
    /// Odometry on the lane of lanelets 1 to 3.
    pub(crate) fn odometry(&mut self, x_m: f64, speed_mps: f64) {
        let odometry = Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps };
        self.handle(PlannerInput::Odometry { odometry, stamp: self.now.wall });
    }

    /// The clock jumps: no deadline is handled before it has.
    pub(crate) fn jump(&mut self, ms: u64) {
        self.now = at_ms(self.ms() + ms);
        self.handle(Input::Tick);
    }

    /// Odometry at one position, ten times a second.
    pub(crate) fn stay(&mut self, x_m: f64, speed_mps: f64, ms: u64) {
        for _ in 0..ms / 100 {
            self.odometry(x_m, speed_mps);
            self.pass_without_end(100);
        }
    }

    /// The turn commands, each with the time it was sent at, ms.
    pub(crate) fn turn_commands(&self) -> Vec<(u64, TurnCommand)> {
        self.stamped(|output| {
            let Output::TurnSignal(TurnSignalOutput::TurnCommand { command, stamp }) = output else {
                return None;
            };
            Some((*command, *stamp))
        })
    }

    pub(crate) fn hazard_commands(&self) -> Vec<(u64, HazardCommand)> {
        self.stamped(|output| {
            let Output::TurnSignal(TurnSignalOutput::HazardCommand { command, stamp }) = output else {
                return None;
            };
            Some((*command, *stamp))
        })
    }

    pub(crate) fn decisions(&self) -> Vec<(u64, Arc<Decision>)> {
        self.select(|output| {
            let Output::TurnSignal(TurnSignalOutput::Decision(decision)) = output else { return None };
            Some(Arc::clone(decision))
        })
    }

    pub(crate) fn turn(&self) -> Option<TurnCommand> {
        self.turn_commands().last().map(|(_, turn)| *turn)
    }

    pub(crate) fn hazard(&self) -> Option<HazardCommand> {
        self.hazard_commands().last().map(|(_, hazard)| *hazard)
    }

    /// A key of the decider's status.
    pub(crate) fn decider_value(&self, key: &str) -> String {
        self.value("turn_signal_decider", key)
    }

    /// The outputs that `pick` picks; the stamp of each is the time it came at.
    fn stamped<T>(&self, pick: impl Fn(&Output) -> Option<(T, WallStamp)>) -> Vec<(u64, T)> {
        let picked = self.outputs.iter().filter_map(|(mono, output)| Some((*mono, pick(output)?)));
        let checked = picked.map(|(mono, (value, stamp))| {
            assert_eq!(stamp, at(mono).wall);
            (millis(mono), value)
        });
        checked.collect()
    }
}

/// A route over these lanelets.
pub(crate) fn route(id: u128, lanes: &[i64]) -> PlannerInput {
    let (start, goal) = (Pose::default(), Pose::new(190.0, 0.0, 0.0));
    PlannerInput::Route(Arc::new(PlannerRoute { id, start, goal, segments: segments(lanes) }))
}

/// A planned path of this many points along the middle, a point each metre, from `x_m` on.
pub(crate) fn path(x_m: f64, points: u32) -> Vec<PlannedPathPoint> {
    let lane = |x: f64| {
        if x < 60.0 {
            1
        } else if x < 80.0 {
            2
        } else {
            3
        }
    };
    let point =
        |x: f64| PlannedPathPoint { pose: Pose::new(x, 0.0, 0.0), speed_mps: 5.0, lanes: vec![lane(x)] };
    (0..points).map(|index| point(x_m + f64::from(index))).collect()
}

/// A planning factor with control points at these positions along the road, each with its offset.
pub(crate) fn factor(behavior: u16, is_driving_forward: bool, points: &[(f64, f64)]) -> PlanningFactor {
    let point = |(x_m, shift_length_m): &(f64, f64)| ControlPoint {
        pose: Pose::new(*x_m, 0.0, 0.0),
        distance_m: 0.0,
        speed_mps: 0.0,
        shift_length_m: *shift_length_m,
    };
    let control_points = points.iter().map(point).collect();
    PlanningFactor { behavior, is_driving_forward, detail: "".into(), control_points }
}

/// A decider that has announced the turn for two seconds, standing 20 m before it.
pub(crate) fn announcing() -> VirtualGateway {
    let mut bench = decider("enabled = true");
    bench.handle(route(1, &[1, 2, 3]));
    bench.stay(36.0, 5.0, 2_000);
    assert_eq!(bench.turn(), Some(TurnCommand::Left));
    bench
}

/// The period of the commands.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);
