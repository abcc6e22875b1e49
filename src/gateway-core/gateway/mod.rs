//! The gateway: two machines, each on its own clock, and the one place where they are joined.
//!
//! - **Perception** (buses, vehicle lights, traffic lights, decider) runs in the order of stamps, so that a
//!   recording of a drive replays byte for byte: [`Gateway::handle_perception`],
//!   [`Gateway::next_perception_deadline`].
//! - **Commands** run in real time, so that frames to the vehicle wait for nothing:
//!   [`Gateway::handle_command`], [`Gateway::settle_commands`], [`Gateway::next_command_deadline`].
//!
//! From perception to commands go: the frames and lost links of each bus, the decider's commands, and at each
//! settling the reports of the vehicle's lights and the state of the buses. Back comes whose frame was
//! received.
//!
//! Where time is virtual, both clocks are one: [`Gateway::handle`], [`Gateway::next_deadline`]. Drain
//! [`Gateway::poll_output`] after each call of either kind.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use crate::command::control_mode::ModeState;
use crate::command::flow::CommandFlow;
use crate::command::input::CommandInput;
use crate::command::origin::CommandOrigin;
use crate::command::sender::FrameOrigin;
use crate::command::settings::{CommandBinding, CommandSettings, Transmit};
use crate::command::{Reported, Turn};
use crate::control_mode::ControlMode;
use crate::gateway::event::{Input, Output};
use crate::v2i_reception::binding::V2iBinding;
use crate::vehicle_lights::VehicleLights;
use crate::vehicle_lights::binding::LightsBinding;
use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::Publish;
use crate::vehicle_status::VehicleStatus;
use crate::vehicle_status::binding::StatusBinding;
use crate::vehicle_status::settings::StatusSettings;
use crate::vehicle_status::state::{Judged, StatusReason};
use can_signal::can::{Bus, BusIndex, BusSettings, CanInput, IdMatch, LinkState};
use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::{MonoTime, Now};
use headlines::Headlines;
use perception::{Effect, Perception};
use traffic_lights::flow::LightsFlowSettings;
use turn_signal::flow::TurnSignalSettings;
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
pub mod snapshot;
mod traffic_lights_with_unit;
mod wall_clock;

/// The settings of the gateway, checked by `config`.
#[derive(Debug, Clone)]
pub struct GatewaySettings {
    /// ROS node name, which begins each diagnostic name.
    pub node: String,
    /// The buses; [`BusIndex`] points here.
    pub buses: Vec<BusSettings>,
    /// The binding of the vehicle profile for the vehicle's lights.
    pub lights: LightsBinding,
    /// The binding of the vehicle profile for the vehicle's status.
    pub status: StatusBinding,
    /// What the configuration says of the vehicle and of the reports on its status.
    pub status_settings: StatusSettings,
    /// The binding of the vehicle profile for traffic-light states from the network.
    pub v2i: V2iBinding,
    /// Traffic lights; without them, what `v2i` binds is not used.
    pub traffic_lights: Option<LightsFlowSettings>,
    /// The turn signal decider; without it, its topics are not used.
    pub turn_signal: Option<TurnSignalSettings>,
    /// Commands to the vehicle, with the binding of the vehicle profile; without them no command is used.
    pub command: Option<(CommandSettings, CommandBinding)>,
    /// When reports are published.
    pub publish: Publish,
    /// The interval at which all statuses are refreshed, at most 500 ms.
    pub diagnostics_period: Duration,
}

impl GatewaySettings {
    /// These settings with commands as a dry run: no frame to the vehicle.
    #[must_use]
    pub fn dry(mut self) -> Self {
        if let Some((settings, _)) = &mut self.command {
            settings.transmit = Transmit::Off;
        }
        self
    }

    /// The interfaces that commands are sent on, by name, each once; none in a dry run.
    pub fn command_interfaces(&self) -> BTreeSet<&str> {
        let live = self.command.iter().filter(|(settings, _)| settings.transmit == Transmit::On);
        let entries = live.flat_map(|(_, binding)| binding.allowed.entries());
        entries.map(|(bus, _)| self.buses[usize::from(bus.0)].interface.as_str()).collect()
    }

    /// The identifiers that matter on a bus, each match once: bound messages, signs of life, and the messages
    /// that we alone may send. All others can be filtered out before they cost anything.
    pub fn relevant_ids(&self, bus: BusIndex) -> Vec<IdMatch> {
        let mut ids = self.proving_ids(bus);
        ids.extend(self.status_ids(bus));
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// The identifiers whose frames prove a bus alive. A message that is bound for the vehicle's status alone
    /// does so only on a bus without any other: it may come from another control unit than the lights, whose
    /// event messages are valid while the bus is alive.
    pub fn life_signs(&self, bus: BusIndex) -> Vec<IdMatch> {
        let proving = self.proving_ids(bus);
        if proving.is_empty() { self.status_ids(bus).collect() } else { proving }
    }

    fn status_ids(&self, bus: BusIndex) -> impl Iterator<Item = IdMatch> + '_ {
        let bound = self.status.table.messages.iter().filter(move |message| message.bus == bus);
        bound.map(|message| message.ids)
    }

    /// The relevant identifiers of a bus, but for messages of the status.
    fn proving_ids(&self, bus: BusIndex) -> Vec<IdMatch> {
        let command = self.command.iter().map(|(_, binding)| binding);
        let bound = self.lights.table.messages.iter().chain(&self.v2i.table.messages);
        let bound = bound.chain(command.clone().flat_map(|binding| &binding.table.messages));
        let bound = bound.filter(|message| message.bus == bus).map(|message| message.ids);
        let ours = command.flat_map(|binding| binding.allowed.entries());
        let ours = ours.filter(|(there, _)| *there == bus).map(|(_, id)| (*id).into());
        let alive = self.buses[usize::from(bus.0)].heartbeat_messages.iter().copied();
        let required = self.lights.requirements.iter().filter(|required| required.bus == bus);
        let required = required.map(|required| required.ids);
        bound.chain(ours).chain(alive).chain(required).collect()
    }
}

/// Both machines, and the outputs of both.
#[derive(Debug, Clone)]
pub struct Gateway {
    perception: Perception,
    commands: Option<CommandFlow>,
    command_headlines: Headlines,
    /// `None` on virtual time.
    wall_clock: Option<WallClock>,
    outputs: VecDeque<Output>,
}

impl Gateway {
    /// A gateway that has received nothing and whose links are all in state `link`; its first outputs are
    /// the diagnostics of this state.
    pub fn new(settings: GatewaySettings, link: LinkState, now: Now) -> Self {
        let links = vec![link; settings.buses.len()];
        Self::with_links(settings, &links, now)
    }

    /// The same, with the link of each bus in the order of the settings; [`LinkState::Missing`] for
    /// those that `links` leaves out.
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

    /// Continues with other settings, at the time of the last call for perception or later. What was
    /// received, decided and counted stays as far as both settings have it, and all statuses are published.
    ///
    /// Node, buses and their interfaces, the flows that run and the commands must be the same: see
    /// [`configuration`].
    pub fn reconfigure(&mut self, settings: GatewaySettings, now: Now) {
        self.perception.reconfigure(settings, now);
        let changed = self.perceive(now);
        self.diagnose(changed, now);
    }

    /// Takes one input in both machines, on one clock; `now` never lies before an earlier call's.
    pub fn handle(&mut self, input: impl Into<Input>, now: Now) {
        if self.take(input.into(), now) {
            self.settle(now);
        }
    }

    /// As [`Self::handle`], for what happens on a bus: it is looked at where it lies.
    #[inline]
    pub fn handle_can(&mut self, input: &CanInput, now: Now) {
        if self.take_can(input, now) {
            self.settle(now);
        }
    }

    /// When to call [`Self::handle`] with [`Input::Tick`] if nothing else happens before.
    #[inline]
    pub fn next_deadline(&self) -> MonoTime {
        self.next_command_deadline().into_iter().fold(self.next_perception_deadline(), MonoTime::min)
    }

    /// Takes one input in perception alone; `now`, in the order of stamps, never lies before an earlier
    /// call. Commands learn of it and act on it at [`Self::settle_commands`].
    pub fn handle_perception(&mut self, input: impl Into<Input>, now: Now) {
        if self.take(input.into(), now) {
            let changed = self.perceive(now);
            self.diagnose(changed, now);
        }
    }

    /// When to call [`Self::handle_perception`] with [`Input::Tick`] if nothing else happens before.
    #[inline]
    pub fn next_perception_deadline(&self) -> MonoTime {
        self.perception.next_deadline()
    }

    /// Takes one input of the commands. They act on it at [`Self::settle_commands`].
    pub fn handle_command(&mut self, input: CommandInput, now: Now) {
        if let Some(commands) = &mut self.commands {
            commands.handle_input(input, now);
        }
    }

    /// Brings commands alone up to `now`, which in real time never lies before an earlier call's.
    pub fn settle_commands(&mut self, now: Now) {
        let changed = self.command(now);
        self.publish_changed(changed, now);
    }

    /// Compares both clocks in real time, where this is called again and again. A step of the wall clock is
    /// shown in the diagnostics and changes nothing else.
    pub fn read_wall_clock(&mut self, now: Now) {
        let wall_clock = self.wall_clock.get_or_insert_with(|| WallClock::new(now));
        if wall_clock.read(now) {
            let status = wall_clock.status(now.mono);
            self.publish_changed(vec![status], now);
        }
    }

    /// When to call [`Self::settle_commands`] if nothing else happens before; `None` while nothing is due.
    #[inline]
    pub fn next_command_deadline(&self) -> Option<MonoTime> {
        self.commands.as_ref().and_then(CommandFlow::next_deadline)
    }

    /// True if nothing is left to be sent after [`CommandInput::Stop`]; always without commands.
    pub fn is_finished(&self) -> bool {
        self.commands.as_ref().is_none_or(CommandFlow::is_finished)
    }

    /// The next output, oldest first.
    #[inline]
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// The state of the vehicle's lights, for views.
    pub fn lights(&self) -> &VehicleLights {
        &self.perception.lights
    }

    /// The state of the vehicle's status, for views.
    pub fn vehicle_status(&self) -> &VehicleStatus {
        &self.perception.status
    }

    /// The buses, in the order of the configuration.
    pub fn buses(&self) -> &[Bus] {
        &self.perception.buses
    }

    /// All statuses as of now.
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

    /// Hands an input to the machines that it is for; false when it changes nothing.
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

    /// Commands see a frame first, since one of theirs is not the vehicle's, and take it after its bus has.
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

    /// Settles both machines and publishes the statuses that have changed.
    fn settle(&mut self, now: Now) {
        let mut changed = self.perceive(now);
        changed.extend(self.command(now));
        self.diagnose(changed, now);
    }

    /// Settles perception and hands the decider's commands over; gives the statuses that have changed.
    fn perceive(&mut self, now: Now) -> Vec<Status> {
        self.perception.settle(now, |output| {
            if let (Some(commands), Some(input)) = (&mut self.commands, decider_command(&output)) {
                commands.handle_input(input, now);
            }
            self.outputs.push_back(output);
        })
    }

    /// Settles commands on what perception reports now; gives the statuses that have changed.
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

    /// Publishes the changed statuses, buses included, and all statuses when they are due.
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

/// The command in an output of the decider.
fn decider_command(output: &Output) -> Option<CommandInput> {
    let Output::TurnSignal(output) = output else { return None };
    let origin = CommandOrigin::Decider;
    match output {
        TurnSignalOutput::TurnCommand { command, stamp } => {
            Some(CommandInput::Turn { origin, command: EnumOrUnknown::Known(*command), stamp: *stamp })
        }
        TurnSignalOutput::HazardCommand { command, stamp } => {
            Some(CommandInput::Hazard { origin, command: EnumOrUnknown::Known(*command), stamp: *stamp })
        }
        TurnSignalOutput::Sections { .. } | TurnSignalOutput::Decision(_) => None,
    }
}

/// The control mode as commands take it.
fn mode_state(judged: Judged<ControlMode>) -> ModeState {
    match judged {
        Ok((mode, _)) => ModeState::Known(mode),
        Err(StatusReason::Signal(reason)) => ModeState::Unusable(reason),
        Err(_) => ModeState::Unknown,
    }
}

/// The reports of the vehicle's lights as they are published.
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
