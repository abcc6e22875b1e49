//! Where the flows meet: `handle(Input, now)`, outputs, next deadline.
//!
//! One task owns the gateway. It never waits: the caller sleeps until [`Gateway::next_deadline`]
//! or the next input, whichever comes first, and drains [`Gateway::poll_output`] after each call.

use std::collections::VecDeque;
use std::time::Duration;

use crate::core::can::bus::{Bus, BusFinding, BusSettings};
use crate::core::can::bus_status;
use crate::core::can::frame::{CanId, Frame};
use crate::core::can::input::CanInput;
use crate::core::can::link::{BusIndex, LinkState};
use crate::core::command::flow::CommandFlow;
use crate::core::command::sender::FrameOrigin;
use crate::core::command::settings::{CommandBinding, CommandSettings, Transmit};
use crate::core::diagnostics::{Diagnostics, Level, RateMeter, Status};
use crate::core::gateway::event::{Input, Output};
use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::traffic_light::flow::{FlowSettings, TrafficLightFlow};
use crate::core::traffic_light::v2i_reception::binding::V2iBinding;
use crate::core::turn_signal::flow::{FlowSettings as DeciderSettings, TurnSignalFlow};
use crate::core::validation::table::{BoundMessage, MessageIndex};
use crate::core::vehicle_lights::binding::LightsBinding;
use crate::core::vehicle_lights::report::Publish;
use crate::core::vehicle_lights::{Task, VehicleLights};

pub mod black_box;
mod commands;
pub mod event;
pub mod live_time;

/// Everything the gateway needs to know, checked by `config`.
#[derive(Debug, Clone)]
pub struct GatewaySettings {
    /// ROS node name, which begins each diagnostic name.
    pub node: String,
    /// The buses; [`BusIndex`] points here.
    pub buses: Vec<BusSettings>,
    /// What the vehicle profile binds.
    pub lights: LightsBinding,
    /// What it binds for traffic-light states from the network.
    pub v2i: V2iBinding,
    /// Traffic lights; none = what `v2i` binds has nowhere to go.
    pub traffic_lights: Option<FlowSettings>,
    /// The turn signal decider; none = what Autoware tells it has nowhere to go.
    pub turn_signal: Option<DeciderSettings>,
    /// Commands to the vehicle, and what the vehicle profile binds for them; none = none are heeded.
    pub command: Option<(CommandSettings, CommandBinding)>,
    /// When reports go out.
    pub publish: Publish,
    /// How often all statuses are refreshed, at most 500 ms.
    pub diagnostics_period: Duration,
}

impl GatewaySettings {
    /// The same without a frame to the vehicle: commands are a dry run.
    #[must_use]
    pub fn dry(mut self) -> Self {
        self.command.iter_mut().for_each(|(settings, _)| settings.transmit = Transmit::Off);
        self
    }

    /// The identifiers that matter on a bus, ascending: bound messages, signs of life, and the messages
    /// that we alone may send. All others can be filtered out before they cost anything.
    pub fn relevant_ids(&self, bus: BusIndex) -> Vec<CanId> {
        let command = self.command.iter().map(|(_, binding)| binding);
        let bound = self.lights.table.messages.iter().chain(&self.v2i.table.messages);
        let bound = bound.chain(command.clone().flat_map(|binding| &binding.table.messages));
        let bound = bound.filter(|message| message.bus == bus).map(|message| message.id);
        let ours = command.flat_map(|binding| binding.allowed.entries());
        let ours = ours.filter(|(there, _)| *there == bus).map(|(_, id)| *id);
        let alive = self.buses[usize::from(bus.0)].heartbeat_messages.iter().copied();
        let mut ids: Vec<_> = bound.chain(ours).chain(alive).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }
}

/// The message of each flow that has an identifier.
#[derive(Debug, Clone, Copy)]
struct Route {
    lights: Option<MessageIndex>,
    v2i: Option<MessageIndex>,
    command: Option<MessageIndex>,
}

/// The whole gateway, pure.
#[derive(Debug, Clone)]
pub struct Gateway {
    node: String,
    buses: Vec<Bus>,
    bus_findings: Vec<Option<BusFinding>>,
    bus_rates: Vec<RateMeter>,
    /// Per bus: relevant ids, ascending, with the messages bound to them.
    routes: Vec<Vec<(CanId, Route)>>,
    lights: VehicleLights,
    traffic_lights: Option<TrafficLightFlow>,
    /// Level and message of each of its statuses, as said last.
    traffic_lights_said: Vec<(Level, String)>,
    turn_signal: Option<TurnSignalFlow>,
    command: Option<CommandFlow>,
    /// Level and message of each of its statuses, as said last.
    command_said: Vec<(Level, String)>,
    /// Commands are settled by [`Self::settle_commands`] alone.
    commands_apart: bool,
    diagnostics_period: Duration,
    refresh_due: MonoTime,
    outputs: VecDeque<Output>,
}

impl Gateway {
    /// A gateway that has seen nothing and whose links are all as `link` says; its first outputs are
    /// the diagnostics that say so.
    pub fn new(settings: GatewaySettings, link: LinkState, now: Now) -> Self {
        let links = vec![link; settings.buses.len()];
        Self::with_links(settings, &links, now)
    }

    /// Likewise, with the link of each bus in the order of the settings; [`LinkState::Missing`] for
    /// those that `links` leaves out.
    pub fn with_links(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let bus_count = settings.buses.len();
        let links = links.iter().copied().chain(std::iter::repeat(LinkState::Missing));
        let indices = (0..=u8::MAX).map(BusIndex).take(bus_count);
        let routes = indices.map(|bus| routes(&settings, bus)).collect();
        let mut gateway = Self {
            routes,
            node: settings.node,
            buses: settings.buses.into_iter().zip(links).map(|(bus, link)| Bus::new(bus, link)).collect(),
            bus_findings: vec![None; bus_count],
            bus_rates: vec![RateMeter::default(); bus_count],
            lights: VehicleLights::new(settings.lights, settings.publish),
            traffic_lights: settings
                .traffic_lights
                .map(|flow| TrafficLightFlow::new(flow, settings.v2i, now)),
            traffic_lights_said: Vec::new(),
            turn_signal: settings.turn_signal.map(|flow| TurnSignalFlow::new(flow, now)),
            command: settings.command.map(|(settings, binding)| CommandFlow::new(settings, binding, now)),
            command_said: Vec::new(),
            commands_apart: false,
            diagnostics_period: settings.diagnostics_period,
            refresh_due: now.mono,
            outputs: VecDeque::new(),
        };
        gateway.settle(now);
        gateway
    }

    /// Takes one input; `now` never lies before that of an earlier call.
    pub fn handle(&mut self, input: impl Into<Input>, now: Now) {
        match input.into() {
            Input::Can(input) => {
                if !self.can_input(input, now) {
                    return;
                }
            }
            Input::TrafficLight(input) => {
                if let Some(flow) = &mut self.traffic_lights {
                    flow.handle_input(input, now);
                }
            }
            Input::Planner(input) => {
                if let Some(flow) = &mut self.turn_signal {
                    flow.handle_input(input, now);
                }
            }
            Input::Command(input) => {
                if let Some(flow) = &mut self.command {
                    flow.handle_input(input, now);
                }
            }
            Input::Stop => {
                if let Some(flow) = &mut self.command {
                    flow.stop();
                }
            }
            Input::Tick => {}
        }
        self.settle(now);
    }

    /// The next thing to send, in order.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When to call [`Self::handle`] with [`Input::Tick`] if nothing else happens before.
    pub fn next_deadline(&self, now: MonoTime) -> MonoTime {
        let buses = self.buses.iter().filter_map(|bus| bus.next_deadline(now));
        let traffic_lights = self.traffic_lights.as_ref().map(|flow| flow.next_deadline(now));
        buses
            .chain(self.lights.next_deadline(now))
            .chain(traffic_lights)
            .chain(self.turn_signal.as_ref().map(TurnSignalFlow::next_deadline))
            .chain(self.next_command_deadline(now).filter(|_| !self.commands_apart))
            .fold(self.refresh_due, MonoTime::min)
    }

    /// State of the lights, for views.
    pub fn lights(&self) -> &VehicleLights {
        &self.lights
    }

    /// All statuses as of now.
    pub fn statuses(&self, now: MonoTime) -> Vec<Status> {
        let lights = self.lights.tasks().map(|task| self.lights_status(task, now));
        let buses = (0..self.buses.len()).map(|bus| self.bus_status(bus, now));
        let decider = self.turn_signal.as_ref().map(|flow| flow.status(&self.node, now));
        let commands = self.command_statuses(now);
        lights.chain(self.traffic_light_statuses(now)).chain(decider).chain(commands).chain(buses).collect()
    }

    /// False when the input changes nothing.
    fn can_input(&mut self, input: CanInput, now: Now) -> bool {
        let Some(known) = self.buses.get_mut(usize::from(input.bus().0)) else {
            return !matches!(input, CanInput::Frame { .. });
        };
        match input {
            CanInput::Frame { bus, frame, stamp } => return self.frame_arrived(bus, &frame, stamp, now),
            CanInput::Link { bus, state } => {
                if known.set_link(state) {
                    self.forget_bus(bus);
                }
            }
            CanInput::Drops { lost, .. } => known.frames_dropped(lost, now.mono),
            CanInput::ErrorFrame { error, .. } => known.error_frame(error, now.mono),
            CanInput::Controller { report, .. } => known.controller_reported(report, now.mono),
            CanInput::BadRecords { count, .. } => known.bad_records(count, now.mono),
        }
        true
    }

    fn forget_bus(&mut self, bus: BusIndex) {
        self.lights.forget_bus(bus);
        if let Some(flow) = &mut self.traffic_lights {
            flow.forget_bus(bus);
        }
        if let Some(flow) = &mut self.command {
            flow.forget_bus(bus);
        }
    }

    /// False when the frame changes nothing: not relevant, or from before the link was lost.
    fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) -> bool {
        match self.command.as_mut().map_or(FrameOrigin::Vehicle, |flow| flow.classify_frame(bus, frame, now))
        {
            FrameOrigin::Vehicle => {}
            FrameOrigin::Own => return false,
            FrameOrigin::Foreign => return true,
        }
        let Some(routes) = self.routes.get(usize::from(bus.0)) else { return false };
        let Ok(position) = routes.binary_search_by_key(&frame.id(), |(id, _)| *id) else { return false };
        let route = routes[position].1;
        let known = &mut self.buses[usize::from(bus.0)];
        let was_alive = known.is_alive(now.mono);
        if !known.frame_arrived(now.mono) {
            return false;
        }
        if !was_alive {
            self.lights.forget_events(bus);
            self.traffic_lights.iter_mut().for_each(|flow| flow.forget_events(bus));
            self.command.iter_mut().for_each(|flow| flow.forget_events(bus));
        }
        if let Some(message) = route.lights {
            self.lights.frame_arrived(message, frame, stamp, now);
        }
        if let (Some(message), Some(flow)) = (route.v2i, &mut self.traffic_lights) {
            flow.frame_arrived(message, frame, stamp, &self.buses, now);
        }
        if let (Some(message), Some(flow)) = (route.command, &mut self.command) {
            flow.frame_arrived(message, frame, stamp, now);
        }
        true
    }

    /// Judges everything and queues what follows: reports first, then what diagnostics say of it.
    fn settle(&mut self, now: Now) {
        let steps = self.lights.settle(&self.buses, now);
        self.outputs.extend(steps.outputs().map(Output::VehicleLights));
        let mut changed = Vec::new();
        for task in self.lights.tasks() {
            let is_news = match task {
                Task::TurnIndicators => steps.turn_changed,
                Task::HazardLights => steps.hazard_changed,
            };
            if is_news {
                changed.push(self.lights_status(task, now.mono));
            }
        }
        changed.extend(self.settle_traffic_lights(now));
        if let Some(flow) = &mut self.turn_signal {
            let has_news = flow.settle(now);
            while let Some(output) = flow.poll_output() {
                self.command.iter_mut().for_each(|flow| commands::follow(flow, &output, now));
                self.outputs.push_back(Output::TurnSignal(output));
            }
            changed.extend(has_news.then(|| flow.status(&self.node, now.mono)));
        }
        if !self.commands_apart {
            changed.extend(self.commands_settled(now));
        }
        for index in 0..self.buses.len() {
            let finding = Some(self.buses[index].finding(now.mono));
            if std::mem::replace(&mut self.bus_findings[index], finding) != finding {
                changed.push(self.bus_status(index, now.mono));
            }
        }
        if !changed.is_empty() {
            self.say(changed, false, now);
        }
        if now.mono >= self.refresh_due {
            self.lights.sample_rates(now.mono);
            for (bus, rate) in self.buses.iter().zip(&mut self.bus_rates) {
                rate.sample(bus.counts.frames, now.mono);
            }
            self.say(self.statuses(now.mono), true, now);
            self.refresh_due = now.mono.after(self.diagnostics_period);
        }
    }

    /// Queues what the traffic lights send; gives the statuses that say something new.
    fn settle_traffic_lights(&mut self, now: Now) -> Vec<Status> {
        let Some(flow) = &mut self.traffic_lights else { return Vec::new() };
        let has_news = flow.settle(&self.buses, now);
        self.outputs.extend(std::iter::from_fn(|| flow.poll_output()).map(Output::TrafficLights));
        if !has_news {
            return Vec::new();
        }
        let statuses = self.traffic_light_statuses(now.mono);
        news(statuses, &mut self.traffic_lights_said)
    }

    fn traffic_light_statuses(&self, now: MonoTime) -> Vec<Status> {
        let flow = self.traffic_lights.as_ref();
        flow.map(|flow| flow.statuses(&self.node, &self.buses, now)).unwrap_or_default()
    }

    fn say(&mut self, statuses: Vec<Status>, refresh: bool, now: Now) {
        let diagnostics = Diagnostics { statuses, refresh };
        self.outputs.push_back(Output::Diagnostics { diagnostics, stamp: now.wall });
    }

    fn lights_status(&self, task: Task, now: MonoTime) -> Status {
        self.lights.status(task, &self.node, &self.buses, now)
    }

    fn bus_status(&self, index: usize, now: MonoTime) -> Status {
        let (bus, rate) = (&self.buses[index], &self.bus_rates[index]);
        bus_status::status(bus, &self.node, rate.rate_hz(bus.counts.frames, now), now)
    }
}

/// The statuses that say something else than was `said` of them last.
fn news(mut statuses: Vec<Status>, said: &mut Vec<(Level, String)>) -> Vec<Status> {
    let now = statuses.iter().map(|status| (status.level, status.message.clone())).collect();
    let mut before = std::mem::replace(said, now).into_iter();
    statuses.retain(|status| {
        before.next().is_none_or(|(level, message)| level != status.level || message != status.message)
    });
    statuses
}

fn routes(settings: &GatewaySettings, bus: BusIndex) -> Vec<(CanId, Route)> {
    let message_of = |messages: &[BoundMessage], id: CanId| {
        messages.iter().position(|message| message.bus == bus && message.id == id).map(MessageIndex)
    };
    let command = settings.command.as_ref().map_or(&[][..], |(_, binding)| &binding.table.messages);
    let route = |id: CanId| Route {
        lights: message_of(&settings.lights.table.messages, id),
        v2i: message_of(&settings.v2i.table.messages, id),
        command: message_of(command, id),
    };
    settings.relevant_ids(bus).into_iter().map(|id| (id, route(id))).collect()
}
