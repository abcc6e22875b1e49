//! Simulates a drive cycle by cycle: the inputs from the vehicle and its planner, without a decider.

use std::sync::Arc;
use std::time::Duration;

use super::motion::Motion;
use super::planner::{DrivePosition, offset_m};
use super::route_path::{RouteLaneChange, RoutePath, RoutePathError, metres_from};
use crate::config::Refused;
use crate::config::drive::{
    DisturbanceKind, DriveFile, DriveMoment, Expectation, GapKind, PlanKind, RoutePlan,
};
use crate::report::drive::Snapshot;
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::polyline::{back_pose, front_pose};
use lanelet2_map::lane_network::{LaneId, LaneNetwork};
use turn_signal::compat::DeciderCompat;
use turn_signal::decision::Decision;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::planner_input::{Odometry, PlannedPathPoint};
use turn_signal::route::{Route, RouteError};

/// The clock at the start, late enough for jumps backwards.
const START: MonoTime = MonoTime::from_millis(200_000_000);
/// Distance between the end of a drive without `until_m` and the end of its route path, metres.
const BEFORE_END_M: f64 = 0.5;
/// Reach of the planned path behind and ahead of the vehicle, metres.
const PATH_BEHIND_M: f64 = 8.0;
const PATH_AHEAD_M: f64 = 300.0;
/// Maximum distance of a new route from the vehicle, metres.
const NEAR_ROUTE_M: f64 = 5.0;
/// Distance after which a vehicle counts as departed, metres.
const DEPARTED_M: f64 = 0.1;

/// A drive scenario whose lanelets form a path, ready to be simulated.
#[derive(Debug, Clone)]
pub struct DriveSimulation {
    file: DriveFile,
    legs: Vec<Leg>,
}

#[derive(Debug, Clone)]
struct Leg {
    from: DriveMoment,
    route: Arc<Route>,
    goal: Pose,
    route_path: Arc<RoutePath>,
}

/// The inputs at one cycle.
#[derive(Debug, Clone)]
pub struct DriveCycle {
    /// Number of the cycle, from 0.
    pub index: usize,
    /// Time since the start, seconds, without jumps.
    pub at_s: f64,
    /// The clock of the inputs, which may jump.
    pub now: MonoTime,
    /// Position of the rear axle, metres along the route path.
    pub at_m: f64,
    /// The lanelet at that position.
    pub lane: Option<LaneId>,
    /// The true pose of the rear axle.
    pub pose: Pose,
    /// The true speed, m/s.
    pub speed_mps: f64,
    /// The odometry; `None` if none is received in this cycle.
    pub odometry: Option<Odometry>,
    /// The planned path, starting a few metres behind the vehicle.
    pub path: Vec<PlannedPathPoint>,
    /// The manoeuvres of the planner, in the order of its chain.
    pub manoeuvres: Vec<Manoeuvre>,
    /// The route in force.
    pub route: Arc<Route>,
    /// The end of the route.
    pub goal: Pose,
    /// True if the planner is in the lane-driving scenario.
    pub lane_driving: bool,
}

impl DriveCycle {
    /// Returns a snapshot of the cycle with its decision.
    pub fn snapshot<'a>(&self, compat: DeciderCompat, decision: &'a Decision) -> Snapshot<'a> {
        let Self { at_s, at_m, pose, speed_mps, lane, .. } = *self;
        Snapshot { compat, at_s, at_m, pose, speed_mps, lane, decision }
    }
}

impl DriveSimulation {
    /// Prepares a scenario. Fails if lanelets do not form a path, and names each with its location.
    pub fn new(file: DriveFile) -> Result<Self, Refused> {
        let changes: Vec<RouteLaneChange> =
            file.manoeuvres.iter().filter_map(|plan| change_of(&plan.kind)).collect();
        let mut legs = vec![leg(&file, &file.route, DriveMoment::AtS(0.0), 1, &changes)?];
        for (disturbance, number) in file.disturbances.iter().zip(2..) {
            if let DisturbanceKind::Reroute(route) = &disturbance.kind {
                legs.push(leg(&file, route, disturbance.at, number, &[])?);
            }
        }
        let simulation = Self { file, legs };
        simulation.check_reroutes()?;
        Ok(simulation)
    }

    /// Returns the simulated scenario.
    pub fn file(&self) -> &DriveFile {
        &self.file
    }

    /// Returns the lanelets of the scenario's map.
    pub fn road(&self) -> &LaneNetwork {
        &self.file.road
    }

    /// Returns the cycles from the start to the end. Each call returns the same cycles.
    pub fn cycles(&self) -> Cycles<'_> {
        let file = &self.file;
        Cycles {
            simulation: self,
            motion: Motion::new(&file.speed, &file.stops, file.start_m),
            index: 0,
            leg: 0,
            moved_m: 0.0,
            departed: false,
            begun: vec![None; file.disturbances.len()],
            is_over: false,
        }
    }

    /// Returns the expectations at a cycle for one `compat`, with their indices in the file.
    pub fn expected(
        &self,
        cycle: &DriveCycle,
        compat: DeciderCompat,
    ) -> impl Iterator<Item = (usize, &Expectation)> {
        let (at_m, at_s) = (cycle.at_m, cycle.at_s);
        let all = self.file.expectations.iter().enumerate();
        all.filter(move |(_, expected)| {
            expected.compats.contains(&compat) && expected.interval.contains(at_m, at_s)
        })
    }

    fn check_reroutes(&self) -> Result<(), Refused> {
        let file = &self.file;
        let Some(first) = self.legs.first() else { return Ok(()) };
        let reroutes =
            file.disturbances.iter().filter_map(|disturbance| match (&disturbance.kind, disturbance.at) {
                (DisturbanceKind::Reroute(route), DriveMoment::AtM(at_m)) => Some((route, at_m)),
                _ => None,
            });
        // Only the first reroute, since positions on later routes depend on earlier reroutes.
        for ((route, at_m), leg) in reroutes.zip(self.legs.iter().skip(1)).take(1) {
            let position = first.route_path.pose(at_m, |at_m| offset_m(file, at_m)).position;
            let (_, far_m) = leg.route_path.nearest(position);
            if far_m > NEAR_ROUTE_M {
                let reason = format!("at {at_m} m the vehicle is {far_m:.1} m away from the new route");
                return Err(refused(route, reason, "name the lanelets where the vehicle is as well"));
            }
        }
        Ok(())
    }
}

fn change_of(kind: &PlanKind) -> Option<RouteLaneChange> {
    let PlanKind::LaneChange { side, from_m, to_m, .. } = *kind else { return None };
    Some(RouteLaneChange { side, from_m, to_m })
}

fn refused(route: &RoutePlan, reason: impl Into<String>, remedy: &str) -> Refused {
    Refused(vec![route.location.problem(reason, remedy)])
}

fn leg(
    file: &DriveFile,
    plan: &RoutePlan,
    from: DriveMoment,
    number: u128,
    changes: &[RouteLaneChange],
) -> Result<Leg, Refused> {
    let of_lanes = |error: RoutePathError| {
        let remedy = match error {
            RoutePathError::Gap { .. } => {
                "name every lanelet of the route, and the lanes beside where it changes lanes"
            }
            RoutePathError::ChangeOutside { .. } => {
                "move the lane_change there, or name more lanes in the segments"
            }
            RoutePathError::NoLength(_) => "correct its bounds in the map",
        };
        refused(plan, error.to_string(), remedy)
    };
    let road = Arc::clone(&file.road);
    let end = |at: usize, pose: fn(&[_]) -> Option<Pose>| {
        let segment = plan.segments.get(at)?;
        pose(&road.lane(segment.preferred)?.centerline)
    };
    let start = plan.start.or_else(|| end(0, front_pose)).unwrap_or_default();
    let last = plan.segments.len().saturating_sub(1);
    let goal = plan.goal.or_else(|| end(last, back_pose)).unwrap_or_default();
    let route = Route::new(plan.id.unwrap_or(number), start, plan.segments.clone());
    let route = route
        .map_err(|error: RouteError| refused(plan, error.to_string(), "correct the segments"))?
        .with_goal(goal);
    let route_path = if file.points.is_empty() {
        RoutePath::of_route(Arc::clone(&road), &plan.segments, changes).map_err(of_lanes)?
    } else {
        RoutePath::of_points(Arc::clone(&road), file.points.clone(), route.lanes().collect())
    };
    Ok(Leg { from, route: Arc::new(route), goal, route_path: Arc::new(route_path) })
}

/// The cycles of a simulation, in order.
#[derive(Debug, Clone)]
pub struct Cycles<'a> {
    simulation: &'a DriveSimulation,
    motion: Motion<'a>,
    index: usize,
    leg: usize,
    moved_m: f64,
    departed: bool,
    /// Start of each disturbance, seconds; `None` before it.
    begun: Vec<Option<f64>>,
    is_over: bool,
}

impl Iterator for Cycles<'_> {
    type Item = DriveCycle;

    fn next(&mut self) -> Option<DriveCycle> {
        if self.is_over {
            return None;
        }
        let file = &self.simulation.file;
        let at_s = self.time_s();
        if self.index > 0 {
            self.motion.advance(at_s - self.motion.at_s);
            self.departed |= self.motion.at_m > file.start_m + DEPARTED_M;
        }
        self.change_legs();
        let end_m = file.until_m.unwrap_or_else(|| self.path_end_m() - BEFORE_END_M);
        if self.motion.at_m > end_m || at_s > file.until.as_secs_f64() + 1e-9 {
            self.is_over = true;
            return None;
        }
        let cycle = self.cycle(at_s);
        self.index += 1;
        cycle
    }
}

impl Cycles<'_> {
    fn time_s(&self) -> f64 {
        f64::from(u32::try_from(self.index).unwrap_or(u32::MAX)) / self.simulation.file.planning_hz
    }

    fn path_end_m(&self) -> f64 {
        self.simulation.legs.get(self.leg).map_or(0.0, |leg| leg.route_path.length_m() - self.moved_m)
    }

    fn drive_position<'a>(&self, simulation: &'a DriveSimulation, leg: &'a Leg) -> DrivePosition<'a> {
        DrivePosition {
            file: &simulation.file,
            route_path: &leg.route_path,
            moved_m: self.moved_m,
            at_m: self.motion.at_m,
            at_s: self.motion.at_s,
            departed: self.departed,
        }
    }

    /// Switches to the next route when it is due, at the same point of the map.
    fn change_legs(&mut self) {
        let simulation = self.simulation;
        while let (Some(leg), Some(next)) = (simulation.legs.get(self.leg), simulation.legs.get(self.leg + 1))
        {
            let position = self.drive_position(simulation, leg);
            if !position.has_come(next.from) {
                return;
            }
            let here = leg.route_path.pose(position.at_m + self.moved_m, |_| 0.0).position;
            self.moved_m = next.route_path.nearest(here).0 - position.at_m;
            self.leg += 1;
        }
    }

    fn cycle(&mut self, at_s: f64) -> Option<DriveCycle> {
        let simulation = self.simulation;
        let file = &simulation.file;
        let leg = simulation.legs.get(self.leg)?;
        let position = self.drive_position(simulation, leg);
        let moved_m = self.moved_m;
        let offset = |path_m: f64| offset_m(file, path_m - moved_m);
        let pose = leg.route_path.pose(position.at_m + moved_m, offset);
        let speed_mps = self.motion.speed_mps();
        let mut clock_s = at_s;
        let mut odometry = Some(Odometry { pose, speed_mps });
        let (mut has_path, mut lane_driving) = (true, true);
        for (disturbance, begun) in file.disturbances.iter().zip(&mut self.begun) {
            if begun.is_none() && position.has_come(disturbance.at) {
                *begun = Some(at_s);
            }
            let Some(begun_s) = *begun else { continue };
            match disturbance.kind {
                DisturbanceKind::Gap(_, for_s) if at_s >= begun_s + for_s - 1e-9 => {}
                DisturbanceKind::Gap(GapKind::OdometryGap, _) => odometry = None,
                DisturbanceKind::Gap(GapKind::NanPose, _) => {
                    let pose = Pose::new(f64::NAN, f64::NAN, f64::NAN);
                    odometry = odometry.map(|odometry| Odometry { pose, ..odometry });
                }
                DisturbanceKind::Gap(GapKind::EmptyPath, _) => has_path = false,
                DisturbanceKind::Gap(GapKind::NotLaneDriving, _) => lane_driving = false,
                DisturbanceKind::TimeJump(by_s) => clock_s += by_s,
                DisturbanceKind::Reroute(_) => {}
            }
        }
        let path = if has_path { path(&position, speed_mps) } else { Vec::new() };
        Some(DriveCycle {
            index: self.index,
            at_s,
            now: clock(clock_s),
            at_m: position.at_m,
            lane: leg.route_path.lane_at(position.at_m + moved_m),
            pose,
            speed_mps,
            odometry,
            path,
            manoeuvres: position.manoeuvres(),
            route: Arc::clone(&leg.route),
            goal: leg.goal,
            lane_driving,
        })
    }
}

fn path(position: &DrivePosition<'_>, speed_mps: f64) -> Vec<PlannedPathPoint> {
    let (path, here_m) = (position.route_path, position.at_m + position.moved_m);
    let to_m = (here_m + PATH_AHEAD_M).min(path.length_m());
    let point = |path_m| PlannedPathPoint {
        pose: path.pose(path_m, |path_m| offset_m(position.file, path_m - position.moved_m)),
        speed_mps,
        lanes: path.lane_at(path_m).into_iter().collect(),
    };
    metres_from((here_m - PATH_BEHIND_M).max(0.0)).take_while(|path_m| *path_m <= to_m).map(point).collect()
}

fn clock(at_s: f64) -> MonoTime {
    let by = Duration::from_secs_f64(at_s.abs());
    if at_s < 0.0 { START.before(by) } else { START.after(by) }
}
