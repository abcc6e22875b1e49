//! Perception: converts input from vehicle, road and planner to reports, traffic lights and decisions.
//!
//! It runs in the order of stamps: the same inputs give the same outputs byte for byte.

use std::time::Duration;

use super::settings::GatewaySettings;
use super::traffic_lights_with_unit::TrafficLightsWithUnit;
use crate::control_mode::ControlMode;
use crate::gateway::event::Output;
use crate::vehicle_lights::VehicleLights;
use crate::vehicle_status::VehicleStatus;
use crate::vehicle_status::doors::DoorStates;
use crate::vehicle_status::gear::Gear;
use can_signal::can::bus_status;
use can_signal::can::{Bus, BusFinding, BusIndex, BusSnapshot, CanInput, Frame, IdMatch, IdTable, LinkState};
use can_signal::validation::observation::{Arrival, Interruption};
use can_signal::validation::table::{BoundMessage, MessageIndex};
use gateway_base::diagnostics::{RateMeter, Status};
use gateway_base::time::timer_table::TimerTable;
use gateway_base::time::{MonoTime, Now, WallStamp};
use turn_signal::flow::TurnSignalFlow;
use turn_signal::vehicle_state::VehicleState;

/// Buses, vehicle lights, vehicle status, traffic lights and decider.
#[derive(Debug, Clone)]
pub(super) struct Perception {
    pub(super) node: String,
    pub(super) buses: Vec<Bus>,
    bus_findings: Vec<Option<BusFinding>>,
    bus_rates: Vec<RateMeter>,
    /// Relevant identifiers of each bus, with the messages bound to them.
    routes: Vec<IdTable<Route>>,
    pub(super) lights: VehicleLights,
    pub(super) status: VehicleStatus,
    pub(super) traffic_lights: Option<TrafficLightsWithUnit>,
    pub(super) turn_signal: Option<TurnSignalFlow>,
    diagnostics_period: Duration,
    timers: TimerTable<Timer>,
    unsettled: Unsettled,
}

/// Deadlines of perception, each set when its part is settled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Timer {
    VehicleLights,
    VehicleStatus,
    TrafficLights,
    Decider,
    Buses,
    /// All statuses are refreshed.
    Diagnostics,
}

/// Vehicle flows affected by inputs since they were last settled.
#[derive(Debug, Clone, Copy)]
struct Unsettled {
    lights: bool,
    status: bool,
}

impl Unsettled {
    const NONE: Self = Self { lights: false, status: false };
    const BOTH: Self = Self { lights: true, status: true };
}

/// The message of each flow that has an identifier, by index.
#[derive(Debug, Clone, Copy)]
struct Route {
    lights: Option<MessageIndex>,
    status: Option<MessageIndex>,
    v2i: Option<MessageIndex>,
    /// True if a frame of the message proves the bus alive.
    is_life_sign: bool,
}

/// Effect of an input of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effect {
    /// No change until the next deadline: the frame repeats known values.
    Repetition,
    /// Something new is known.
    News,
    /// Like [`Self::News`], and the values of the bus that do not survive its interruption are discarded.
    Forgotten(BusIndex, Interruption),
}

/// Returns the state of the vehicle for the decider.
fn vehicle_state(status: &VehicleStatus) -> VehicleState {
    let gear = status.gear.value();
    VehicleState {
        speed_mps: status.velocity.value().map(|velocity| velocity.longitudinal_mps),
        is_parked: gear.map(|gear| gear == Gear::Park),
        is_in_reverse: gear.map(|gear| matches!(gear, Gear::Reverse | Gear::Reverse2)),
        has_open_door: status.doors.value().as_ref().and_then(DoorStates::has_open),
        is_manual: status.control_mode.value().map(|mode| mode == ControlMode::Manual),
    }
}

impl Perception {
    /// Creates the state before any input; `links` has the state of each link. A bus without an entry starts
    /// as [`LinkState::Missing`].
    pub(super) fn new(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let bus_count = settings.buses.len();
        let links = links.iter().copied().chain(std::iter::repeat(LinkState::Missing));
        let indices = (0..=u8::MAX).map(BusIndex).take(bus_count);
        let bus = |(settings, link)| {
            let mut bus = Bus::new(settings, link);
            bus.await_first_frames(now.mono);
            bus
        };
        let mut timers = TimerTable::default();
        timers.set(Timer::Diagnostics, now.mono);
        Self {
            routes: indices.map(|bus| routes(&settings, bus)).collect(),
            node: settings.node,
            buses: settings.buses.into_iter().zip(links).map(bus).collect(),
            bus_findings: vec![None; bus_count],
            bus_rates: vec![RateMeter::default(); bus_count],
            lights: VehicleLights::new(settings.lights, settings.publish),
            status: VehicleStatus::new(settings.status, settings.status_settings, settings.publish),
            traffic_lights: settings
                .traffic_lights
                .map(|flow| TrafficLightsWithUnit::new(flow, settings.v2i, now)),
            turn_signal: settings.turn_signal.map(|flow| TurnSignalFlow::new(flow, now)),
            diagnostics_period: settings.diagnostics_period,
            timers,
            unsettled: Unsettled::BOTH,
        }
    }

    /// Continues with other settings of the same buses and flows, keeping the state of everything in both.
    /// Call [`Self::settle`] afterwards.
    pub(super) fn reconfigure(&mut self, settings: GatewaySettings, now: Now) {
        let indices = (0..=u8::MAX).map(BusIndex).take(settings.buses.len());
        self.routes = indices.map(|bus| routes(&settings, bus)).collect();
        for (bus, settings) in self.buses.iter_mut().zip(settings.buses) {
            bus.reconfigure(settings);
        }
        self.lights.reconfigure(settings.lights, settings.publish, now.mono);
        self.status.reconfigure(settings.status, settings.status_settings, settings.publish, now.mono);
        if let (Some(lights), Some(flow)) = (&mut self.traffic_lights, settings.traffic_lights) {
            lights.reconfigure(flow, settings.v2i, now);
        }
        if let (Some(flow), Some(decider)) = (&mut self.turn_signal, settings.turn_signal) {
            flow.reconfigure(decider);
        }
        self.diagnostics_period = settings.diagnostics_period;
        self.unsettled = Unsettled::BOTH;
        self.timers.set(Timer::Diagnostics, now.mono);
    }

    /// Returns when something must be settled without an input.
    pub(super) fn next_deadline(&self) -> MonoTime {
        self.timers.next_deadline().unwrap_or(MonoTime::MAX)
    }

    /// Handles an input of a bus; returns `None` if it changes nothing.
    pub(super) fn handle_can(&mut self, input: &CanInput, now: Now) -> Option<Effect> {
        if !matches!(input, CanInput::Frame { .. }) {
            self.unsettled = Unsettled::BOTH;
        }
        let Some(known) = self.buses.get_mut(usize::from(input.bus().0)) else {
            return (!matches!(input, CanInput::Frame { .. })).then_some(Effect::News);
        };
        match *input {
            CanInput::Frame { bus, ref frame, stamp } => return self.handle_frame(bus, frame, stamp, now),
            CanInput::Link { bus, state } => {
                let is_lost = known.set_link(state);
                known.await_first_frames(now.mono);
                if is_lost {
                    return Some(self.forget(bus, Interruption::LinkLost));
                }
            }
            CanInput::Drops { lost, .. } => known.frames_dropped(lost, now.mono),
            CanInput::ErrorFrame { error, .. } => known.error_frame(error, now.mono),
            CanInput::Controller { report, .. } => known.controller_reported(report, now.mono),
            CanInput::BadRecords { count, .. } => known.bad_records(count, now.mono),
        }
        Some(Effect::News)
    }

    /// Returns `None` if the frame is irrelevant, or is left over from before the link was lost.
    fn handle_frame(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) -> Option<Effect> {
        let routes = self.routes.get(usize::from(bus.0))?;
        let route = routes.get_merged(frame.id(), Route::or)?;
        let known = &mut self.buses[usize::from(bus.0)];
        let was_alive = known.is_alive(now.mono);
        let is_usable = if route.is_life_sign {
            known.frame_arrived(now.mono)
        } else {
            known.other_frame_arrived(now.mono)
        };
        if !is_usable {
            return None;
        }
        // On a bus that may sleep, the length of a silence is part of the reason for a missing value.
        let mut is_news = known.settings().may_sleep
            || self.bus_findings[usize::from(bus.0)] != Some(known.finding(now.mono))
            || self.next_deadline() <= now.mono;
        let is_revived = !was_alive && route.is_life_sign;
        // Both flows depend on silences of the bus, and on frames that end them.
        if is_revived || is_news {
            self.unsettled = Unsettled::BOTH;
        }
        let forgotten = is_revived.then(|| self.forget(bus, Interruption::Silence));
        if route.is_life_sign && self.lights.observe(bus, frame, was_alive, now.mono) {
            (self.unsettled, is_news) = (Unsettled::BOTH, true);
        }
        if let Some(message) = route.lights {
            let is_new = self.lights.frame_arrived(message, frame, stamp, now) == Arrival::News;
            self.unsettled.lights |= is_new;
            is_news |= is_new;
        }
        if let Some(message) = route.status {
            let is_new = self.status.frame_arrived(message, frame, stamp, now) == Arrival::News;
            self.unsettled.status |= is_new;
            is_news |= is_new;
        }
        if let (Some(message), Some(lights)) = (route.v2i, &mut self.traffic_lights) {
            lights.reception.frame_arrived(message, frame, stamp, &self.buses, now);
            is_news = true;
        }
        Some(forgotten.unwrap_or(if is_news { Effect::News } else { Effect::Repetition }))
    }

    fn forget(&mut self, bus: BusIndex, by: Interruption) -> Effect {
        self.lights.forget(bus, by);
        self.status.forget(bus, by);
        if let Some(lights) = &mut self.traffic_lights {
            lights.reception.forget(bus, by);
        }
        Effect::Forgotten(bus, by)
    }

    /// Updates all flows to `now` and passes their outputs to `emit`; returns the statuses of changed flows.
    pub(super) fn settle(&mut self, now: Now, mut emit: impl FnMut(Output)) -> Vec<Status> {
        let unsettled = std::mem::replace(&mut self.unsettled, Unsettled::NONE);
        // Both flows share the deadlines of the buses.
        let is_due =
            |timer| self.timers.is_expired(timer, now.mono) || self.timers.is_expired(Timer::Buses, now.mono);
        let (lights, status) = (
            unsettled.lights || is_due(Timer::VehicleLights),
            unsettled.status || is_due(Timer::VehicleStatus),
        );
        let mut changed = Vec::new();
        if lights {
            self.settle_lights(now, &mut emit, &mut changed);
        }
        if status {
            self.settle_status(now, &mut emit, &mut changed);
        }
        if let Some(lights) = &mut self.traffic_lights {
            changed.extend(lights.settle(&self.buses, now));
            while let Some(output) = lights.flow.poll_output() {
                emit(Output::TrafficLights(output));
            }
            self.timers.set(Timer::TrafficLights, lights.next_deadline(now.mono));
        }
        if let Some(flow) = &mut self.turn_signal {
            let has_news = flow.settle(vehicle_state(&self.status), now);
            while let Some(output) = flow.poll_output() {
                emit(Output::TurnSignal(output));
            }
            self.timers.set(Timer::Decider, flow.next_deadline());
            changed.extend(has_news.then(|| flow.status(now.mono)));
        }
        let buses = self.buses.iter().filter_map(|bus| bus.next_deadline(now.mono));
        self.timers.set(Timer::Buses, buses.min());
        changed
    }

    fn settle_lights(&mut self, now: Now, emit: &mut impl FnMut(Output), changed: &mut Vec<Status>) {
        let mut tasks = Vec::new();
        let output = |output| emit(Output::VehicleLights(output));
        self.lights.settle(&self.buses, now, output, |task| tasks.push(task));
        self.timers.set(Timer::VehicleLights, self.lights.next_deadline(now.mono));
        let described = self.lights.tasks().filter(|task| tasks.contains(task));
        changed.extend(described.map(|task| self.lights.status(task, &self.buses, now.mono)));
    }

    fn settle_status(&mut self, now: Now, emit: &mut impl FnMut(Output), changed: &mut Vec<Status>) {
        let mut reports = Vec::new();
        let unmet = self.lights.unmet();
        self.status.settle(
            unmet,
            &self.buses,
            now,
            |output| emit(Output::VehicleStatus(output)),
            |report| reports.push(report),
        );
        self.timers.set(Timer::VehicleStatus, self.status.next_deadline(now.mono));
        let status = |report| self.status.status(report, &self.buses, now.mono);
        changed.extend(reports.into_iter().filter_map(status));
    }

    /// Returns the statuses of buses whose finding has changed.
    pub(super) fn changed_buses(&mut self, now: MonoTime) -> Vec<Status> {
        let mut changed = Vec::new();
        for index in 0..self.buses.len() {
            let finding = Some(self.buses[index].finding(now));
            if std::mem::replace(&mut self.bus_findings[index], finding) != finding {
                changed.push(self.bus_status(index, now));
            }
        }
        changed
    }

    /// Returns true if all statuses must be published again; also samples the rates that they show.
    pub(super) fn refresh_statuses(&mut self, now: MonoTime) -> bool {
        if !self.timers.is_expired(Timer::Diagnostics, now) {
            return false;
        }
        self.timers.set(Timer::Diagnostics, now.after(self.diagnostics_period));
        self.lights.sample_rates(&self.buses, now);
        self.status.sample_rates(&self.buses, now);
        for (bus, rate) in self.buses.iter().zip(&mut self.bus_rates) {
            rate.sample(bus.counts.frames, now);
        }
        true
    }

    /// Returns all statuses of the flows.
    pub(super) fn flow_statuses(&self, now: MonoTime) -> Vec<Status> {
        let lights = self.lights.tasks().map(|task| self.lights.status(task, &self.buses, now));
        let mut statuses: Vec<_> = lights.collect();
        statuses.extend(self.status.statuses(&self.buses, now));
        if let Some(lights) = &self.traffic_lights {
            statuses.extend(lights.statuses(&self.buses, now));
        }
        statuses.extend(self.turn_signal.as_ref().map(|flow| flow.status(now)));
        statuses
    }

    /// Returns all statuses of the buses.
    pub(super) fn bus_statuses(&self, now: MonoTime) -> impl Iterator<Item = Status> {
        (0..self.buses.len()).map(move |index| self.bus_status(index, now))
    }

    /// Returns the current states of the buses.
    pub(super) fn bus_snapshots(&self, now: MonoTime) -> impl Iterator<Item = BusSnapshot> {
        self.buses
            .iter()
            .zip(&self.bus_rates)
            .map(move |(bus, rate)| BusSnapshot::of(bus, rate.rate_hz(bus.counts.frames, now), now))
    }

    fn bus_status(&self, index: usize, now: MonoTime) -> Status {
        let (bus, rate) = (&self.buses[index], &self.bus_rates[index]);
        bus_status::status(bus, rate.rate_hz(bus.counts.frames, now), now)
    }
}

impl Route {
    fn or(self, other: Self) -> Self {
        Self {
            lights: self.lights.or(other.lights),
            status: self.status.or(other.status),
            v2i: self.v2i.or(other.v2i),
            is_life_sign: self.is_life_sign || other.is_life_sign,
        }
    }
}

fn routes(settings: &GatewaySettings, bus: BusIndex) -> IdTable<Route> {
    let message_of = |messages: &[BoundMessage], ids: IdMatch| {
        messages.iter().position(|message| message.bus == bus && message.ids == ids).map(MessageIndex)
    };
    let life_signs = settings.life_signs(bus);
    let route = |ids: IdMatch| Route {
        lights: message_of(&settings.lights.table.messages, ids),
        status: message_of(&settings.status.table.messages, ids),
        v2i: message_of(&settings.v2i.table.messages, ids),
        is_life_sign: life_signs.contains(&ids),
    };
    // A heartbeat message may share frames with a bound message.
    IdTable::merged(settings.relevant_ids(bus).into_iter().map(|ids| (ids, route(ids))), Route::or)
}
