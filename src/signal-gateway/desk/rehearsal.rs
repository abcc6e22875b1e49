//! A gateway with simulated surroundings, in one process and on virtual time: a drive with its planner, and a
//! simulated vehicle that obeys the frames and reports its lights.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::drive::simulation::{Cycles, DriveCycle, DriveSimulation};
use can_signal::can::{CanInput, LinkState};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{SampleId, WriterId};
use gateway_core::command::output::CommandOutput;
use gateway_core::control_mode::ControlMode;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
use lanelet2_map::geometry::wrapped;
use turn_signal::light_command::EnumOrUnknown;
use turn_signal::planner_input::{PlannerInput, PlannerRoute};
use vehicle_bringup::simulated_vehicle::plan::VehiclePlan;
use vehicle_bringup::simulated_vehicle::request::SimulationRequest;
use vehicle_bringup::simulated_vehicle::{SimulatedVehicle, SimulationSettings, VehicleOutput};

const LAP_GAP: Duration = Duration::from_millis(100);
/// Fraction of the path's heading rate that the vehicle adopts in one cycle.
const PATH_SHARE: f64 = 0.2;

pub struct Rehearsal<'a> {
    gateway: Gateway,
    surroundings: Option<Surroundings<'a>>,
    outputs: VecDeque<Output>,
    start: WallStamp,
    now: Now,
    end: MonoTime,
}

/// Surroundings of the gateway: a vehicle, and a repeated drive with its planner.
pub struct Surroundings<'a> {
    vehicle: SimulatedVehicle,
    drive: &'a DriveSimulation,
    cycles: Cycles<'a>,
    next: Option<DriveCycle>,
    lap: MonoTime,
    laps_left: u32,
    samples: i64,
    heading_rate_radps: f64,
}

impl<'a> Surroundings<'a> {
    /// Creates a vehicle with timed requests, and a drive that is repeated `laps` times.
    pub fn new(
        plan: VehiclePlan,
        script: impl IntoIterator<Item = (MonoTime, SimulationRequest)>,
        drive: &'a DriveSimulation,
        laps: u32,
    ) -> Self {
        let mut vehicle = SimulatedVehicle::new(plan, SimulationSettings::default(), MonoTime::ZERO);
        for (at, request) in script {
            vehicle.schedule(at, request);
        }
        let mut cycles = drive.cycles();
        let next = cycles.next();
        if let Some(first) = &next {
            // The drive begins at full speed.
            vehicle.follow(first.speed_mps, 0.0, Duration::ZERO, MonoTime::ZERO);
        }
        Self {
            vehicle,
            drive,
            cycles,
            next,
            lap: MonoTime::ZERO,
            laps_left: laps.saturating_sub(1),
            samples: 0,
            heading_rate_radps: 0.0,
        }
    }

    fn cycle_at(&self) -> Option<MonoTime> {
        let cycle = self.next.as_ref()?;
        Some(self.lap.after(Duration::try_from_secs_f64(cycle.at_s).unwrap_or_default()))
    }
}

impl<'a> Rehearsal<'a> {
    /// Creates a gateway with all links up. Its stamps begin at `start`, and it ends after `length`.
    pub fn new(
        settings: GatewaySettings,
        surroundings: Option<Surroundings<'a>>,
        start: WallStamp,
        length: Duration,
    ) -> Self {
        let now = Now { mono: MonoTime::ZERO, wall: start };
        let gateway = Gateway::new(settings, LinkState::Up, now);
        let end = MonoTime::ZERO.after(length);
        Self { gateway, surroundings, outputs: VecDeque::new(), start, now, end }
    }

    pub fn gateway(&self) -> &Gateway {
        &self.gateway
    }

    /// Returns the time of the last step.
    pub fn now(&self) -> Now {
        self.now
    }

    /// Returns the time at which the next step is due; `None` after the end.
    pub fn next_time(&self) -> Option<MonoTime> {
        let vehicle =
            self.surroundings.as_ref().and_then(|around| around.vehicle.next_deadline(self.now.mono));
        let cycle = self.surroundings.as_ref().and_then(Surroundings::cycle_at);
        let next = [Some(self.gateway.next_deadline()), vehicle, cycle].into_iter().flatten().min()?;
        Some(next.max(self.now.mono)).filter(|next| *next <= self.end)
    }

    /// Performs everything due at [`Self::next_time`].
    pub fn step(&mut self) {
        let Some(mono) = self.next_time() else { return };
        self.now = Now { mono, wall: self.start.after(mono.since(MonoTime::ZERO)) };
        if let Some(around) = &mut self.surroundings {
            around.step(&mut self.gateway, self.now);
        }
        self.gateway.handle(Input::Tick, self.now);
        while let Some(output) = self.gateway.poll_output() {
            if let (Output::Command(CommandOutput::Transmit { frame, .. }), Some(around)) =
                (&output, &mut self.surroundings)
            {
                around.vehicle.frame_arrived(frame.bus(), frame.frame(), self.now.mono);
                self.gateway.handle(CommandInput::Sent(frame.clone()), self.now);
            }
            self.outputs.push_back(output);
        }
    }

    /// Returns the oldest waiting output of the gateway; `None` if there is none.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }
}

impl Surroundings<'_> {
    /// Passes due planner cycles and vehicle frames to the gateway.
    fn step(&mut self, gateway: &mut Gateway, now: Now) {
        while self.cycle_at().is_some_and(|at| at <= now.mono) {
            let Some(cycle) = self.next.take() else { break };
            self.samples += 1;
            let sample = SampleId { writer: WriterId::default(), sequence: self.samples };
            let mode = EnumOrUnknown::Known(ControlMode::Autonomous);
            gateway.handle(CommandInput::ControlMode { sample, mode, stamp: now.wall }, now);
            for input in planner_inputs(&cycle, now.wall) {
                gateway.handle(input, now);
            }
            self.next = self.cycles.next();
            if self.next.is_none() && self.laps_left > 0 {
                self.laps_left -= 1;
                self.cycles = self.drive.cycles();
                self.next = self.cycles.next();
                self.lap = now.mono.after(LAP_GAP);
            } else if let Some(next) = &self.next {
                let within_s = next.at_s - cycle.at_s;
                // The path has corners, but a car turns smoothly.
                let of_path_radps = wrapped(next.pose.yaw_rad - cycle.pose.yaw_rad) / within_s;
                self.heading_rate_radps += (of_path_radps - self.heading_rate_radps) * PATH_SHARE;
                let within = Duration::try_from_secs_f64(within_s).unwrap_or_default();
                self.vehicle.follow(next.speed_mps, self.heading_rate_radps, within, now.mono);
            }
        }
        self.vehicle.settle(now.mono);
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Frame { bus, frame } => {
                    gateway.handle(CanInput::Frame { bus, frame, stamp: now.wall }, now);
                }
                VehicleOutput::Error { bus, error } => {
                    gateway.handle(CanInput::ErrorFrame { bus, error }, now);
                }
                VehicleOutput::Happened(_) => {}
            }
        }
    }
}

/// Returns the messages of the planner in a cycle of the drive; the route comes with the first cycle.
fn planner_inputs(cycle: &DriveCycle, stamp: WallStamp) -> impl Iterator<Item = PlannerInput> {
    let route = (cycle.index == 0).then(|| {
        let (route, goal) = (&cycle.route, cycle.goal);
        let (id, start, segments) = (route.id(), route.start(), route.segments().to_vec());
        PlannerInput::Route(Arc::new(PlannerRoute { id, start, goal, segments }))
    });
    let odometry = cycle.odometry.map(|odometry| PlannerInput::Odometry { odometry, stamp });
    let path = PlannerInput::PlannedPath(cycle.path.as_slice().into());
    [route, odometry, Some(path)].into_iter().flatten()
}
