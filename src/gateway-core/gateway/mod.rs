//! The gateway: two machines, each on its own clock, and the only place where they are joined.
//!
//! - **Perception** (buses, vehicle lights, traffic lights, decider) runs in the order of stamps, so a
//!   recording of a drive replays byte for byte: [`Gateway::handle_perception`],
//!   [`Gateway::next_perception_deadline`].
//! - **Commands** run in real time, so frames to the vehicle do not wait for perception:
//!   [`Gateway::handle_command`], [`Gateway::settle_commands`], [`Gateway::next_command_deadline`].
//!
//! Perception passes to commands: the frames and lost links of each bus, the decider's commands, and each
//! time they settle the reports of the vehicle's lights and the state of the buses. Commands return the
//! origin of each received frame.
//!
//! In virtual time, both share one clock: [`Gateway::handle`], [`Gateway::next_deadline`]. Drain
//! [`Gateway::poll_output`] after each call of either kind.

use std::collections::VecDeque;

use crate::command::control_mode::ModeState;
use crate::command::flow::CommandFlow;
use crate::command::input::CommandInput;
use crate::command::origin::CommandOrigin;
use crate::command::sender::FrameOrigin;
use crate::command::{Reported, Turn};
use crate::control_mode::ControlMode;
use crate::gateway::event::{Input, Output};
use crate::vehicle_lights::VehicleLights;
use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_status::VehicleStatus;
use crate::vehicle_status::state::{Judged, StatusReason};
use can_signal::can::{Bus, CanInput, LinkState};
use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::{MonoTime, Now};
use headlines::Headlines;
use perception::{Effect, Perception};
pub use settings::GatewaySettings;
use turn_signal::light_command::EnumOrUnknown;
use turn_signal::output::TurnSignalOutput;
pub use wall_clock::WALL_CLOCK_TASK;
use wall_clock::WallClock;

pub mod black_box;
pub mod call;
pub mod catalogue;
pub mod event;
mod headlines;
pub mod history;
mod late_reports;
pub mod live;
pub mod live_time;
mod perception;
mod settings;
pub mod snapshot;
mod traffic_lights_with_unit;
mod wall_clock;

/// Both machines and their outputs.
#[derive(Debug, Clone)]
pub struct Gateway {
    perception: Perception,
    commands: Option<CommandFlow>,
    command_headlines: Headlines,
    /// `None` in virtual time.
    wall_clock: Option<WallClock>,
    outputs: VecDeque<Output>,
}

impl Gateway {
    /// Creates a gateway that has received nothing and whose links are all in state `link`; its first outputs
    /// are the diagnostics of this state.
    pub fn new(settings: GatewaySettings, link: LinkState, now: Now) -> Self {
        let links = vec![link; settings.buses.len()];
        Self::with_links(settings, &links, now)
    }

    /// Like [`Self::new`], but with the link state of each bus in the order of the settings; a bus that
    /// `links` omits starts as [`LinkState::Missing`].
    pub fn with_links(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let commands = settings.command.clone();
        let mut gateway = Self {
            perception: Perception::new(settings, links, now),
            commands: commands.map(|(settings, binding)| CommandFlow::new(settings, binding, now)),
            command_headlines: Headlines::default(),
            wall_clock: None,
            outputs: VecDeque::new(),
        };
        gateway.handle(Input::Tick, now);
        gateway
    }

    /// Continues with other settings, at the time of the last call for perception or later. Values, decisions
    /// and counts are kept as far as both settings include them, and all statuses are published.
    ///
    /// Node, buses and their interfaces, the running flows and the commands must be the same, which the
    /// reader of the other configuration checks.
    pub fn reconfigure(&mut self, settings: GatewaySettings, now: Now) {
        self.perception.reconfigure(settings, now);
        let changed = self.perceive(now);
        self.diagnose(changed, now);
    }

    /// Passes one input to both machines, on one clock; `now` must not precede an earlier call.
    pub fn handle(&mut self, input: impl Into<Input>, now: Now) {
        if self.take(input.into(), now) {
            self.settle(now);
        }
    }

    /// Like [`Self::handle`], but for CAN input, which is borrowed rather than moved.
    #[inline]
    pub fn handle_can(&mut self, input: &CanInput, now: Now) {
        if self.take_can(input, now) {
            self.settle(now);
        }
    }

    /// Returns when to call [`Self::handle`] with [`Input::Tick`] if no input comes earlier.
    #[inline]
    pub fn next_deadline(&self) -> MonoTime {
        self.next_command_deadline().into_iter().fold(self.next_perception_deadline(), MonoTime::min)
    }

    /// Passes one input to perception only; `now`, in the order of stamps, must not precede an earlier call.
    /// Commands are informed of it and act on it at [`Self::settle_commands`].
    pub fn handle_perception(&mut self, input: impl Into<Input>, now: Now) {
        if self.take(input.into(), now) {
            let changed = self.perceive(now);
            self.diagnose(changed, now);
        }
    }

    /// Returns when to call [`Self::handle_perception`] with [`Input::Tick`] if no input comes earlier.
    #[inline]
    pub fn next_perception_deadline(&self) -> MonoTime {
        self.perception.next_deadline()
    }

    /// Passes one input to the commands, which act on it at [`Self::settle_commands`].
    pub fn handle_command(&mut self, input: CommandInput, now: Now) {
        if let Some(commands) = &mut self.commands {
            commands.handle_input(input, now);
        }
    }

    /// Updates only the commands to `now`, which in real time must not precede an earlier call.
    pub fn settle_commands(&mut self, now: Now) {
        let changed = self.command(now);
        self.publish_changed(changed, now);
    }

    /// Compares both clocks. It is called repeatedly in real time. A step of the wall clock is shown in the
    /// diagnostics and has no other effect.
    pub fn read_wall_clock(&mut self, now: Now) {
        let wall_clock = self.wall_clock.get_or_insert_with(|| WallClock::new(now));
        if wall_clock.read(now) {
            let status = wall_clock.status(now.mono);
            self.publish_changed(vec![status], now);
        }
    }

    /// Returns when to call [`Self::settle_commands`] if no input comes earlier; `None` while nothing is due.
    #[inline]
    pub fn next_command_deadline(&self) -> Option<MonoTime> {
        self.commands.as_ref().and_then(CommandFlow::next_deadline)
    }

    /// Returns true if nothing is left to be sent after [`CommandInput::Stop`]; always true without commands.
    pub fn is_finished(&self) -> bool {
        self.commands.as_ref().is_none_or(CommandFlow::is_finished)
    }

    /// Returns the next output, oldest first.
    #[inline]
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// Returns the state of the vehicle's lights, for views.
    pub fn lights(&self) -> &VehicleLights {
        &self.perception.lights
    }

    /// Returns the state of the vehicle's status, for views.
    pub fn vehicle_status(&self) -> &VehicleStatus {
        &self.perception.status
    }

    /// Returns the buses in the order of the configuration.
    pub fn buses(&self) -> &[Bus] {
        &self.perception.buses
    }

    /// Returns all statuses as of `now`.
    pub fn statuses(&self, now: MonoTime) -> Vec<Status> {
        let mut statuses = self.perception.flow_statuses(now);
        if let Some(commands) = &self.commands {
            let Perception { buses, status, .. } = &self.perception;
            statuses.extend(commands.statuses(&status.binding().table, buses, now));
        }
        statuses.extend(self.perception.bus_statuses(now));
        statuses.extend(self.wall_clock.map(|wall_clock| wall_clock.status(now)));
        statuses
    }

    /// Passes an input to the machines that need it; returns false if it changes nothing.
    fn take(&mut self, input: Input, now: Now) -> bool {
        match input {
            Input::Can(input) => return self.take_can(&input, now),
            Input::TrafficLight(input) => {
                if let Some(lights) = &mut self.perception.traffic_lights {
                    lights.handle_input(input, now);
                }
            }
            Input::Planner(input) => {
                if let Some(flow) = &mut self.perception.turn_signal {
                    flow.handle_input(input, now);
                }
            }
            Input::Command(input) => self.handle_command(input, now),
            Input::Tick => {}
        }
        true
    }

    /// Handles an input of a bus. Commands classify a frame first: only frames of the vehicle reach its bus
    /// and then the commands.
    fn take_can(&mut self, input: &CanInput, now: Now) -> bool {
        let Some(commands) = &mut self.commands else {
            return !matches!(self.perception.handle_can(input, now), None | Some(Effect::Repetition));
        };
        if let CanInput::Frame { bus, frame, .. } = input {
            match commands.classify_frame(*bus, frame, now) {
                FrameOrigin::Vehicle => {}
                FrameOrigin::Own => return false,
                FrameOrigin::Foreign => return true,
            }
        }
        let Some(effect) = self.perception.handle_can(input, now) else { return false };
        let mut is_news = effect != Effect::Repetition;
        match effect {
            Effect::Repetition | Effect::News => {}
            Effect::Forgotten(bus, by) => commands.forget(bus, by),
        }
        if let CanInput::Frame { bus, frame, stamp } = input {
            is_news |= commands.handle_frame(*bus, frame, *stamp, now);
        }
        is_news || commands.next_deadline().is_some_and(|due| due <= now.mono)
    }

    /// Settles both machines and publishes changed statuses.
    fn settle(&mut self, now: Now) {
        let mut changed = self.perceive(now);
        changed.extend(self.command(now));
        self.diagnose(changed, now);
    }

    /// Settles perception and passes the decider's commands on; returns the changed statuses.
    fn perceive(&mut self, now: Now) -> Vec<Status> {
        self.perception.settle(now, |output| {
            if let (Some(commands), Some(input)) = (&mut self.commands, decider_command(&output)) {
                commands.handle_input(input, now);
            }
            self.outputs.push_back(output);
        })
    }

    /// Settles commands using the current reports of perception; returns the changed statuses.
    fn command(&mut self, now: Now) -> Vec<Status> {
        let Some(commands) = &mut self.commands else { return Vec::new() };
        let Perception { buses, lights, status, .. } = &self.perception;
        commands.handle_report(reported(lights));
        if commands.uses_mode_signals() {
            let mode = mode_state(status.control_mode(buses, now));
            commands.handle_signalled_mode(mode, status.next_stale(now.mono));
        }
        let has_news = commands.settle(buses, now);
        self.outputs.extend(std::iter::from_fn(|| commands.poll_output()).map(Output::Command));
        if !has_news {
            return Vec::new();
        }
        self.command_headlines.changed(commands.statuses(&status.binding().table, buses, now.mono))
    }

    /// Publishes the changed statuses, buses included, and all statuses when a refresh is due.
    fn diagnose(&mut self, mut changed: Vec<Status>, now: Now) {
        changed.extend(self.perception.changed_buses(now.mono));
        self.publish_changed(changed, now);
        if self.perception.refresh_statuses(now.mono) {
            self.publish(self.statuses(now.mono), true, now);
        }
    }

    fn publish_changed(&mut self, statuses: Vec<Status>, now: Now) {
        if !statuses.is_empty() {
            self.publish(statuses, false, now);
        }
    }

    fn publish(&mut self, statuses: Vec<Status>, refresh: bool, now: Now) {
        let diagnostics = Diagnostics { node: self.perception.node.clone(), statuses, refresh };
        self.outputs.push_back(Output::Diagnostics { diagnostics, stamp: now.wall });
    }
}

/// Returns the command in an output of the decider.
fn decider_command(output: &Output) -> Option<CommandInput> {
    let Output::TurnSignal(output) = output else { return None };
    let origin = CommandOrigin::Decider;
    Some(match *output {
        TurnSignalOutput::TurnCommand { command, stamp } => {
            CommandInput::Turn { origin, command: EnumOrUnknown::Known(command), stamp }
        }
        TurnSignalOutput::HazardCommand { command, stamp } => {
            CommandInput::Hazard { origin, command: EnumOrUnknown::Known(command), stamp }
        }
        TurnSignalOutput::Sections { .. } | TurnSignalOutput::Decision(_) => return None,
    })
}

/// Converts a control mode for the commands.
fn mode_state(judged: Judged<ControlMode>) -> ModeState {
    match judged {
        Ok((mode, _)) => ModeState::Known(mode),
        Err(StatusReason::Signal(reason)) => ModeState::Unusable(reason),
        Err(_) => ModeState::Unknown,
    }
}

/// Returns the reports of the vehicle's lights as published.
fn reported(lights: &VehicleLights) -> Reported {
    let (turn, hazard) = lights.reports();
    Reported {
        turn: turn.map(|turn| match turn {
            TurnIndicators::Disable => Turn::Off,
            TurnIndicators::EnableLeft => Turn::Left,
            TurnIndicators::EnableRight => Turn::Right,
        }),
        hazard: hazard.map(|hazard| hazard == HazardLights::Enable),
    }
}
