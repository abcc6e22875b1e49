//! The whole traffic-light flow: states of a V2X unit go into the engine, its messages through the faults on
//! purpose, and those that arrive to the arbiter.

use std::collections::VecDeque;

use super::arbiter::{Arbiter, ArbiterSettings, ArbiterStamp};
use super::command::parse_command;
use super::emission::{Content, Emission, Groups, LightsTopic};
use super::engine::{LightObservation, LightsSettings, TrafficLights};
use super::event_log::ScenarioEvent;
use super::faults::Faults;
use super::input::TrafficLightInput;
use super::output::TrafficLightOutput;
use super::target::StoreId;
use super::v2i_reception::binding::V2iBinding;
use super::v2i_reception::{V2iReception, ValidState};
use crate::core::can::bus::Bus;
use crate::core::diagnostics::Status;
use crate::core::time::{MonoTime, Now, WallStamp};

/// The settings of the flow.
#[derive(Debug, Clone)]
pub struct FlowSettings {
    /// Settings of the engine.
    pub lights: LightsSettings,
    /// Faults on purpose of the camera topic.
    pub camera_faults: Option<Faults>,
    /// Faults on purpose of the V2I topics.
    pub v2i_faults: Option<Faults>,
    /// Settings of the arbiter; `None` when there is no merged topic.
    pub arbiter: Option<ArbiterSettings>,
}

/// The traffic lights with reception, faults on purpose and arbiter.
#[derive(Debug, Clone)]
pub struct TrafficLightFlow {
    engine: TrafficLights,
    reception: V2iReception,
    camera: Option<Faults>,
    v2i: Option<Faults>,
    arbiter: Option<Arbiter>,
    ready: VecDeque<TrafficLightOutput>,
    refused: u64,
    news: bool,
}

impl TrafficLightFlow {
    /// Starts the scenario.
    pub fn new(settings: FlowSettings, binding: V2iBinding, now: Now) -> Self {
        let arbiter = settings.arbiter.map(|arbiter| Arbiter::new(arbiter, &settings.lights.map));
        Self {
            camera: settings.camera_faults,
            v2i: settings.v2i_faults,
            engine: TrafficLights::new(settings.lights, now),
            reception: V2iReception::new(binding),
            arbiter,
            ready: VecDeque::new(),
            refused: 0,
            news: true,
        }
    }

    /// The reception of the V2X unit, for its frames and buses. Call [`Self::settle`] afterwards.
    pub fn reception(&mut self) -> &mut V2iReception {
        &mut self.reception
    }

    /// Takes an input. Call [`Self::settle`] afterwards.
    pub fn handle_input(&mut self, input: TrafficLightInput, now: Now) {
        match input {
            TrafficLightInput::States { store, states, rejected, .. } => {
                // Diagnostics show the last rejected state: one with an id rather than an unreadable one.
                self.engine.count_rejected(store.channel, rejected, now);
                let refused = self.engine.set_states(store, states, true, now);
                self.news |= refused > 0 || rejected > 0;
            }
            TrafficLightInput::Command(text) => {
                let done = self.perform(&text, now);
                self.refused += u64::from(!done);
                self.news |= !done;
            }
        }
    }

    /// Does the action of a command. Returns false when the command is not understood, or cannot be done.
    fn perform(&mut self, text: &str, now: Now) -> bool {
        match parse_command(text, self.engine.controllers(), self.engine.quirks()) {
            Ok(action) => self.engine.apply(&action, now).is_ok(),
            Err(error) => {
                self.ready.push_back(TrafficLightOutput::CommandRefused(error));
                false
            }
        }
    }

    /// Brings everything up to now. Returns true when the diagnostics have changed.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let settled = self.reception.settle(buses, now);
        self.news |= settled.news;
        if !settled.changes.is_empty() {
            let observation =
                |ValidState { bulbs, confidence, .. }: ValidState| LightObservation { bulbs, confidence };
            let changes = settled.changes.iter().map(|change| (change.id, change.state.map(observation)));
            // These are only the changes, so they do not expire: the reception knows the age of each state.
            self.engine.set_states(StoreId::V2I, changes, false, now);
        }
        self.engine.advance(now);
        while let Some(logged) = self.engine.poll_event() {
            self.news |= matches!(logged.event, ScenarioEvent::Ended(_));
        }
        while let Some(emission) = self.engine.poll_output() {
            let faults = match emission.topic {
                LightsTopic::Camera => &mut self.camera,
                LightsTopic::V2i => &mut self.v2i,
                LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers => &mut None,
            };
            match faults {
                Some(faults) => faults.send(emission, now.mono),
                None => self.arrived(emission, now),
            }
        }
        while let Some(emission) = self.next_arrival(now.mono) {
            self.arrived(emission, now);
        }
        std::mem::take(&mut self.news)
    }

    /// The next output, oldest first.
    pub fn poll_output(&mut self) -> Option<TrafficLightOutput> {
        self.ready.pop_front()
    }

    /// The next time at which [`Self::settle`] has something to do.
    pub fn next_deadline(&self, now: MonoTime) -> MonoTime {
        let faults = [&self.camera, &self.v2i].into_iter().flatten().filter_map(Faults::next_deadline);
        faults.chain(self.reception.next_deadline(now)).fold(self.engine.next_deadline(), MonoTime::min)
    }

    /// The engine that the flow runs.
    pub fn engine(&self) -> &TrafficLights {
        &self.engine
    }

    /// One status for each channel, one for the scenario, one for the V2X unit if there is one.
    pub fn statuses(&self, node: &str, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let mut statuses = self.engine.statuses(node, now);
        if let Some(scenario) = statuses.last_mut() {
            scenario.values.push(("refused_commands", self.refused.to_string()));
        }
        if !self.reception.binding().is_empty() {
            statuses.push(self.reception.status(node, buses, now));
        }
        statuses
    }

    /// The first of the delayed messages that has arrived by now.
    fn next_arrival(&mut self, now: MonoTime) -> Option<Emission> {
        let delayed = [&mut self.camera, &mut self.v2i].into_iter().flatten();
        let due = delayed.filter_map(|faults| Some((faults.next_deadline()?, faults)));
        due.min_by_key(|(at, _)| *at)?.1.poll(now)
    }

    /// Sends a message that has arrived, and what the arbiter makes of it, with the same stamp.
    fn arrived(&mut self, emission: Emission, now: Now) {
        let merged = self.arbiter.as_mut().and_then(|arbiter| merge(arbiter, &emission, now.wall));
        let stamp = emission.stamp;
        self.ready.push_back(TrafficLightOutput::Publish(emission));
        self.ready.extend(merged.map(|groups| {
            let (topic, content) = (LightsTopic::Arbiter, Content::Groups(groups));
            TrafficLightOutput::Publish(Emission { topic, stamp, content })
        }));
    }
}

/// The groups that the arbiter merges from a message; `None` when the message is not for it, or causes no output.
fn merge(arbiter: &mut Arbiter, emission: &Emission, clock: WallStamp) -> Option<Groups> {
    let Content::Groups(groups) = &emission.content else { return None };
    let stamp = ArbiterStamp(emission.stamp.as_nanos());
    match emission.topic {
        LightsTopic::Camera => Some(arbiter.perception(stamp, groups)),
        LightsTopic::V2i => arbiter.external(stamp, groups, ArbiterStamp(clock.as_nanos())),
        LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers => None,
    }
}
