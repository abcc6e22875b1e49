//! The whole vehicle: requests and command frames in, frames and events out.

use std::collections::VecDeque;
use std::time::Duration;

use rand_pcg::Pcg32;

use super::driver::Driver;
use super::encoder::ReportedState;
use super::faults::ActiveFaults;
use super::flasher::Flasher;
use super::missing_signal::missing_signal;
use super::motion::{MotionState, VehicleMotion};
use super::output::{VehicleEvent, VehicleOutput, Who};
use super::plan::{PlannedMessage, VehiclePlan};
use super::receiver::CommandReceiver;
use super::request::{SimulatedFault, SimulationRequest};
use super::transmission::Transmission;
use can_signal::can::error_frame::class;
use can_signal::can::{BusIndex, ErrorFrame, Frame};
use can_signal::validation::meaning::Meaning;
use gateway_base::time::MonoTime;
use gateway_core::command::arbitration::VehicleRequest;
use gateway_core::vehicle_lights::state::{Sides, TurnCode};

/// Stream of the random generator for the faults.
const RANDOM_STREAM: u64 = 0x5EED;

/// Behaviour of the vehicle in addition to its profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimulationSettings {
    /// Delay between a command frame and the lights.
    pub reaction: Duration,
    /// Time for which a command holds after its last frame; `None` means five periods of its message.
    pub command_timeout: Option<Duration>,
    /// Flash period, half of it lit. A side with a defective bulb flashes at twice the rate.
    pub flash_period: Duration,
    /// Seed of the random faults.
    pub seed: u64,
}

impl Default for SimulationSettings {
    /// Returns a reaction time of 50 ms and 90 flashes per minute.
    fn default() -> Self {
        Self {
            reaction: Duration::from_millis(50),
            command_timeout: None,
            flash_period: Duration::from_nanos(666_666_667),
            seed: 0,
        }
    }
}

/// A simulated vehicle on its buses.
#[derive(Debug, Clone)]
pub struct SimulatedVehicle {
    messages: Vec<PlannedMessage>,
    transmissions: Vec<Transmission>,
    receivers: Vec<CommandReceiver>,
    simulation: SimulationSettings,
    driver: Driver,
    motion: VehicleMotion,
    doors: Vec<String>,
    /// A bit for each door, 1 = open.
    open_doors: u16,
    flasher: Flasher,
    faults: ActiveFaults,
    random: Pcg32,
    /// Origin of the request that the lights follow.
    who: Who,
    /// Request that takes effect after the reaction time, with the time of its effect.
    pending: Option<((TurnCode, Who), MonoTime)>,
    bus_off_until: Option<MonoTime>,
    buses: Vec<BusIndex>,
    request: VehicleRequest,
    lit: Sides,
    scheduled: VecDeque<(MonoTime, SimulationRequest)>,
    outputs: VecDeque<VehicleOutput>,
}

impl SimulatedVehicle {
    /// Creates a parked vehicle in autonomous mode with all lights off and all doors closed. The first frames
    /// are due from now on, 1 ms apart.
    pub fn new(plan: VehiclePlan, simulation: SimulationSettings, now: MonoTime) -> Self {
        let starts = (0_u64..).map(|index| now.after(Duration::from_millis(index)));
        let transmissions = plan.messages.iter().zip(starts);
        let transmissions = transmissions.map(|(message, start)| Transmission::new(message, start)).collect();
        let receive = |message| CommandReceiver::new(message, simulation.command_timeout);
        let received_on = plan.command.messages.iter().map(|message| message.permission.bus());
        let mut buses: Vec<_> = plan.messages.iter().map(|message| message.bus).chain(received_on).collect();
        buses.sort_unstable();
        buses.dedup();
        let mut vehicle = Self {
            transmissions,
            receivers: plan.command.messages.iter().map(receive).collect(),
            driver: Driver::new(plan.ending, simulation.flash_period),
            motion: VehicleMotion::new(plan.dimensions),
            doors: plan.doors,
            open_doors: 0,
            messages: plan.messages,
            flasher: Flasher::new(simulation.flash_period),
            faults: ActiveFaults::default(),
            random: Pcg32::new(simulation.seed, RANDOM_STREAM),
            who: Who::Nobody,
            pending: None,
            bus_off_until: None,
            buses,
            request: VehicleRequest::default(),
            lit: Sides::default(),
            scheduled: VecDeque::new(),
            outputs: VecDeque::new(),
            simulation,
        };
        vehicle.settle(now);
        vehicle
    }

    /// Performs a request. `now` must not be earlier than in a previous call.
    pub fn request(&mut self, request: SimulationRequest, now: MonoTime) {
        self.perform(request, now);
        self.settle(now);
    }

    /// Schedules a request; requests for the same time are performed in the order of the calls.
    pub fn schedule(&mut self, at: MonoTime, request: SimulationRequest) {
        let position = self.scheduled.iter().position(|(other, _)| *other > at);
        self.scheduled.insert(position.unwrap_or(self.scheduled.len()), (at, request));
    }

    /// Moves at the given speed and heading rate, reached within a time, in place of earlier requests:
    /// forward in drive, backward in reverse. Call [`Self::settle`] afterwards.
    pub fn follow(&mut self, speed_mps: f64, heading_rate_radps: f64, within: Duration, now: MonoTime) {
        self.motion.follow(speed_mps, heading_rate_radps, within, now);
    }

    /// Handles a frame of another participant.
    pub fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) {
        if self.faults.ignores_commands || self.is_off_the_bus() {
            return;
        }
        for receiver in &mut self.receivers {
            let effect = receiver.on_frame(bus, frame, now);
            self.outputs.extend(effect.event.map(VehicleOutput::Happened));
            if effect.presses && self.driver.mode.grants().hazard {
                self.driver.press_hazard(None, Who::Command, now);
            }
        }
        self.settle(now);
    }

    /// Performs everything that is due at `now`.
    pub fn settle(&mut self, now: MonoTime) {
        while self.scheduled.front().is_some_and(|(at, _)| now >= *at) {
            if let Some((_, request)) = self.scheduled.pop_front() {
                self.perform(request, now);
            }
        }
        self.driver.settle(now);
        if self.bus_off_until.is_some_and(|until| now >= until) {
            self.bus_off_until = None;
            self.send_error_frames(class::RESTARTED);
            self.happened(VehicleEvent::BusOff(false));
        }
        let timed_out = self.receivers.iter_mut().filter_map(|receiver| receiver.settle(now));
        self.outputs.extend(timed_out.map(VehicleOutput::Happened));
        self.follow_commands();
        self.follow_requests(now);
        let lit = self.flasher.lit(self.faults.broken, now);
        if std::mem::replace(&mut self.lit, lit) != lit {
            self.happened(VehicleEvent::Lamps { left: lit.left, right: lit.right });
        }
        self.send(now);
    }

    /// Returns the next output; `None` when there is none.
    pub fn poll_output(&mut self) -> Option<VehicleOutput> {
        self.outputs.pop_front()
    }

    /// Returns the next instant at which [`Self::settle`] is due without an event.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let sends = self.transmissions.iter().filter_map(Transmission::next_deadline);
        let commands = self.receivers.iter().filter_map(CommandReceiver::next_deadline);
        let pending = self.pending.map(|(_, at)| at);
        let edge = self.flasher.next_edge(self.faults.broken, now);
        let false_report = self.false_report().and_then(|flasher| flasher.next_edge(Sides::default(), now));
        let scheduled = self.scheduled.front().map(|(at, _)| *at);
        let others =
            [scheduled, self.driver.next_deadline(), pending, edge, false_report, self.bus_off_until];
        sends.chain(commands).chain(others.into_iter().flatten()).min()
    }

    /// Returns the lights that flash and the origin of their request.
    pub fn lights(&self) -> (TurnCode, Who) {
        (self.flasher.code, self.who)
    }

    /// Returns the motion.
    pub fn motion(&self, now: MonoTime) -> MotionState {
        self.motion.state(now)
    }

    fn perform(&mut self, request: SimulationRequest, now: MonoTime) {
        let missing = missing_signal(&request, &self.messages);
        self.outputs.extend(missing.map(VehicleEvent::NotPossible).map(VehicleOutput::Happened));
        let mut performed = Ok(());
        match request {
            SimulationRequest::Stalk(turn) => self.driver.stalk(turn, now),
            SimulationRequest::Tap(turn) => self.driver.tap(turn, now),
            SimulationRequest::Hazard(on) => self.driver.press_hazard(on, Who::Driver, now),
            SimulationRequest::Mode(mode) => self.driver.mode = mode,
            SimulationRequest::Gear(gear) => performed = self.motion.engage(gear, now),
            SimulationRequest::Speed { speed_mps } => performed = self.motion.drive(speed_mps, now),
            SimulationRequest::Steer { tire_rad } => self.motion.steer(tire_rad, now),
            SimulationRequest::Brake => self.motion.brake(now),
            SimulationRequest::Door { is_open, name } => {
                performed = self.move_doors(is_open, name.as_deref());
            }
            SimulationRequest::Fault(SimulatedFault::BusOff(duration)) => {
                if self.bus_off_until.replace(now.after(duration)).is_none() {
                    self.send_error_frames(class::BUS_OFF);
                    self.happened(VehicleEvent::BusOff(true));
                }
            }
            SimulationRequest::Fault(fault) => self.faults.add(fault),
            SimulationRequest::Clear => self.faults = ActiveFaults::default(),
        }
        let refused = performed.err().map(VehicleEvent::NotPossible);
        self.outputs.extend(refused.map(VehicleOutput::Happened));
    }

    fn happened(&mut self, event: VehicleEvent) {
        self.outputs.push_back(VehicleOutput::Happened(event));
    }

    /// Opens or closes the door with a name, or all doors.
    fn move_doors(&mut self, is_open: bool, name: Option<&str>) -> Result<(), &'static str> {
        let moved = self.doors.iter().enumerate();
        let moved = moved.filter(|(_, door)| name.is_none_or(|name| name == *door));
        let bits = moved.fold(0, |bits, (position, _)| bits | 1 << position);
        self.open_doors = if is_open { self.open_doors | bits } else { self.open_doors & !bits };
        if bits == 0 { Err("no signal reports a door with that name") } else { Ok(()) }
    }

    fn is_off_the_bus(&self) -> bool {
        self.faults.is_silent || self.bus_off_until.is_some()
    }

    /// Combines the requests of all command messages, as far as the control mode permits them.
    fn follow_commands(&mut self) {
        let grants = self.driver.mode.grants();
        let mut request = VehicleRequest::default();
        for receiver in &self.receivers {
            request.turn = request.turn.or(receiver.request.turn.filter(|_| grants.turn));
            request.hazard = request.hazard.or(receiver.request.hazard.filter(|_| grants.hazard));
        }
        if std::mem::replace(&mut self.request, request) != request {
            self.happened(VehicleEvent::Commanded { turn: request.turn, hazard: request.hazard });
        }
    }

    /// Sets the requested lights: immediately for the driver, after the reaction time for a command.
    fn follow_requests(&mut self, now: MonoTime) {
        let (code, who) = self.driver.requested_lights(self.request);
        if (code, who) == self.lights() {
            self.pending = None;
            return;
        }
        let known = self.pending.filter(|(pending, _)| *pending == (code, who));
        let by_hand = who == Who::Driver || self.who == Who::Driver;
        let new = if by_hand { now } else { now.after(self.simulation.reaction) };
        let at = known.map_or(new, |(_, at)| at);
        self.pending = (now < at).then_some(((code, who), at));
        if self.pending.is_some() {
            return;
        }
        self.flasher.set(code, now);
        self.who = who;
        self.happened(VehicleEvent::Lights { code, who });
    }

    fn send(&mut self, now: MonoTime) {
        let state = self.state(now);
        let off_the_bus = self.is_off_the_bus();
        for (message, transmission) in self.messages.iter().zip(&mut self.transmissions) {
            let faults = self.faults.of(&message.name);
            for frame in transmission.settle(message, &state, faults, &mut self.random, now) {
                if !off_the_bus {
                    self.outputs.push_back(VehicleOutput::Frame { bus: message.bus, frame });
                }
            }
        }
    }

    fn state(&self, now: MonoTime) -> ReportedState {
        let false_report = self.false_report();
        ReportedState {
            code: false_report.map_or(self.flasher.code, |flasher| flasher.code),
            lit: false_report.map_or(self.lit, |flasher| flasher.lit(Sides::default(), now)),
            stalk: self.driver.stalk_position(),
            button: self.driver.is_button_pressed(),
            quality: self.faults.quality.unwrap_or(Meaning::Defined(())),
            broken: self.faults.broken,
            mode: self.driver.mode,
            driver: self.driver.driver(),
            readings: self.motion.readings(now),
            open_doors: self.open_doors,
        }
    }

    /// Returns the flasher of a false report, whose lamps must flash to be valid; `None` without that fault.
    fn false_report(&self) -> Option<Flasher> {
        let mut flasher = Flasher::new(self.simulation.flash_period);
        flasher.set(self.faults.false_report?, MonoTime::ZERO);
        Some(flasher)
    }

    fn send_error_frames(&mut self, class: u32) {
        let error = ErrorFrame::new(class, &[]);
        self.outputs.extend(self.buses.iter().map(|bus| VehicleOutput::Error { bus: *bus, error }));
    }
}
