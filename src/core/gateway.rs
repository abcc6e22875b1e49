//! Where the flows meet: `handle(Input, now)`, outputs, next deadline.
//!
//! One task owns the gateway. It never waits: the caller sleeps until [`Gateway::next_deadline`]
//! or the next input, whichever comes first, and drains [`Gateway::poll_output`] after each call.

use std::collections::VecDeque;
use std::time::Duration;

use super::bus::{Bus, BusFinding, BusSettings};
use super::bus_status;
use super::diagnostics::{Diagnostics, RateMeter, Status};
use super::event::{BusIndex, Input, LinkState, Output};
use super::frame::{CanId, Frame};
use super::time::{MonoTime, Now, WallStamp};
use super::traffic_light::v2i_reception::binding::V2iBinding;
use super::trust::table::{BoundMessage, MessageIndex};
use super::vehicle_lights::binding::LightsBinding;
use super::vehicle_lights::report::{Publish, Step};
use super::vehicle_lights::{Task, VehicleLights};

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
    /// When reports go out.
    pub publish: Publish,
    /// How often all statuses are refreshed, at most 500 ms.
    pub diagnostics_period: Duration,
}

impl GatewaySettings {
    /// The identifiers that matter on a bus, ascending: bound messages and signs of life. All
    /// others can be filtered out before they cost anything.
    pub fn relevant_ids(&self, bus: BusIndex) -> Vec<CanId> {
        let bound = self.lights.table.messages.iter().chain(&self.v2i.table.messages);
        let bound = bound.filter(|message| message.bus == bus).map(|message| message.id);
        let alive = self.buses[usize::from(bus.0)].alive_by.iter().copied();
        let mut ids: Vec<_> = bound.chain(alive).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }
}

/// The whole gateway, pure.
#[derive(Debug, Clone)]
pub struct Gateway {
    node: String,
    buses: Vec<Bus>,
    bus_findings: Vec<Option<BusFinding>>,
    bus_rates: Vec<RateMeter>,
    /// Per bus: relevant ids, ascending, with the bound message if it is one.
    routes: Vec<Vec<(CanId, Option<MessageIndex>)>>,
    lights: VehicleLights,
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
            diagnostics_period: settings.diagnostics_period,
            refresh_due: now.mono,
            outputs: VecDeque::new(),
        };
        gateway.settle(now);
        gateway
    }

    /// Takes one input; `now` never lies before that of an earlier call.
    pub fn handle(&mut self, input: Input, now: Now) {
        match input {
            Input::Frame { bus, frame, stamp } => {
                if !self.frame_arrived(bus, &frame, stamp, now) {
                    return;
                }
            }
            Input::Link { bus, state } => {
                if self.bus(bus).is_some_and(|known| known.set_link(state)) {
                    self.lights.forget_bus(bus);
                }
            }
            Input::Drops { bus, lost } => {
                self.bus(bus).into_iter().for_each(|known| known.dropped(lost, now.mono));
            }
            Input::ErrorFrame { bus, error } => {
                self.bus(bus).into_iter().for_each(|known| known.error_frame(error, now.mono));
            }
            Input::Controller { bus, report } => {
                self.bus(bus).into_iter().for_each(|known| known.controller_told(report, now.mono));
            }
            Input::BadRecords { bus, count } => {
                self.bus(bus).into_iter().for_each(|known| known.bad_records(count, now.mono));
            }
            Input::Deadline => {}
        }
        self.settle(now);
    }

    /// The next thing to send, in order.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When to call [`Self::handle`] with [`Input::Deadline`] if nothing else happens before.
    pub fn next_deadline(&self, now: MonoTime) -> MonoTime {
        let buses = self.buses.iter().filter_map(|bus| bus.next_deadline(now));
        buses.chain(self.lights.next_deadline(now)).fold(self.refresh_due, MonoTime::min)
    }

    /// State of the lights, for views.
    pub fn lights(&self) -> &VehicleLights {
        &self.lights
    }

    /// All statuses as of now.
    pub fn statuses(&self, now: MonoTime) -> Vec<Status> {
        let lights = self.lights.tasks().map(|task| self.lights_status(task, now));
        lights.chain((0..self.buses.len()).map(|bus| self.bus_status(bus, now))).collect()
    }

    fn bus(&mut self, bus: BusIndex) -> Option<&mut Bus> {
        self.buses.get_mut(usize::from(bus.0))
    }

    /// False when the frame changes nothing: not relevant, or from before the link was lost.
    fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) -> bool {
        let Some(routes) = self.routes.get(usize::from(bus.0)) else { return false };
        let Ok(position) = routes.binary_search_by_key(&frame.id(), |(id, _)| *id) else { return false };
        let message = routes[position].1;
        let known = &mut self.buses[usize::from(bus.0)];
        let was_alive = known.is_alive(now.mono);
        if !known.frame_arrived(now.mono) {
            return false;
        }
        if !was_alive {
            self.lights.forget_events(bus);
        }
        if let Some(message) = message {
            self.lights.frame_arrived(message, frame, stamp, now);
        }
        true
    }

    /// Judges everything and queues what follows: reports first, then what diagnostics say of it.
    fn settle(&mut self, now: Now) {
        let steps = self.lights.settle(&self.buses, now);
        self.outputs.extend(steps.turn.map(|step| match step {
            Step::Publish(report, stamp) => Output::TurnIndicators { report, stamp },
            Step::Withdraw => Output::WithdrawTurnIndicators,
        }));
        self.outputs.extend(steps.hazard.map(|step| match step {
            Step::Publish(report, stamp) => Output::HazardLights { report, stamp },
            Step::Withdraw => Output::WithdrawHazardLights,
        }));
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

fn routes(settings: &GatewaySettings, bus: BusIndex) -> Vec<(CanId, Option<MessageIndex>)> {
    let message_of = |id: CanId| {
        let is_it = |message: &BoundMessage| message.bus == bus && message.id == id;
        settings.lights.table.messages.iter().position(is_it).map(MessageIndex)
    };
    settings.relevant_ids(bus).into_iter().map(|id| (id, message_of(id))).collect()
}
