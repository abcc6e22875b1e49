//! The whole traffic-light flow: states of a V2X unit go into the engine, its messages go through the faults
//! on purpose, and those that arrive go to the arbiter.

use std::collections::VecDeque;

use super::arbiter::{Arbiter, ArbiterSettings, ArbiterStamp, Judged};
use super::command::parse_command;
use super::emission::{Content, Emission, LightsTopic};
use super::engine::{LightObservation, LightsSettings, TrafficLights};
use super::event_log::ScenarioEvent;
use super::faults::Faults;
use super::input::TrafficLightInput;
use super::output::TrafficLightOutput;
use super::target::{Channel, Layer, StoreId};
use super::v2i_reception::V2iReception;
use super::v2i_reception::binding::V2iBinding;
use crate::core::can::bus::Bus;
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::diagnostics::Status;
use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::validation::table::MessageIndex;

/// What the flow runs on.
#[derive(Debug, Clone)]
pub struct FlowSettings {
    /// The engine.
    pub lights: LightsSettings,
    /// Between the engine and whoever reads the camera topic.
    pub camera_faults: Option<Faults>,
    /// Between the engine and whoever reads the V2I topics.
    pub v2i_faults: Option<Faults>,
    /// For the merged view; none = without that topic.
    pub arbiter: Option<ArbiterSettings>,
}

/// Traffic lights with everything around them.
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
    /// The scenario starts now.
    pub fn new(settings: FlowSettings, binding: V2iBinding, now: Now) -> Self {
        let arbiter = settings.arbiter.map(|arbiter| {
            let mut arbiter = Arbiter::new(arbiter);
            arbiter.map(&settings.lights.map);
            arbiter
        });
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

    /// Takes a frame of a bound message of the V2X unit. Call [`Self::settle`] afterwards.
    pub fn frame_arrived(
        &mut self,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        buses: &[Bus],
        now: Now,
    ) {
        self.reception.frame_arrived(message, frame, stamp, buses, now);
    }

    /// Forgets what came over a bus. Call [`Self::settle`] afterwards.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.reception.forget_bus(bus);
    }

    /// Forgets the event messages of a bus that was silent. Call [`Self::settle`] afterwards.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.reception.forget_events(bus);
    }

    /// Takes an input. Call [`Self::settle`] afterwards.
    pub fn handle_input(&mut self, input: TrafficLightInput, now: Now) {
        match input {
            TrafficLightInput::States { store, states, rejected, .. } => {
                // Of what is rejected the last is shown: rather one with a name.
                self.engine.count_rejected(store.channel, rejected, now);
                let refused = self.engine.set_states(store, states, now);
                self.news |= refused > 0 || rejected > 0;
            }
            TrafficLightInput::Command(text) => {
                let done = self.perform(&text, now);
                self.refused += u64::from(!done);
                self.news |= !done;
            }
        }
    }

    /// Does what a text asks for; false when it is not understood, or cannot be done.
    fn perform(&mut self, text: &str, now: Now) -> bool {
        match parse_command(text, self.engine.controllers(), self.engine.quirks()) {
            Ok(action) => self.engine.apply(&action, now).is_ok(),
            Err(error) => {
                self.ready.push_back(TrafficLightOutput::CommandRefused(error));
                false
            }
        }
    }

    /// Brings everything up to now. True when the diagnostics have changed.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let settled = self.reception.settle(buses, now);
        self.news |= settled.news;
        if !settled.changes.is_empty() {
            let observation = |state: super::v2i_reception::ValidState| LightObservation {
                bulbs: state.bulbs,
                confidence: state.confidence,
            };
            let changes = settled.changes.iter().map(|change| (change.id, change.state.map(observation)));
            let store = StoreId { channel: Channel::V2i, layer: Layer::GroundTruth };
            // Only changes come: the reception itself knows how old the others are.
            self.engine.set_lasting_states(store, changes, now);
        }
        self.engine.advance(now);
        while let Some(note) = self.engine.poll_note() {
            self.news |= matches!(note.what, ScenarioEvent::Ended(_));
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

    /// When [`Self::settle`] has something to do.
    pub fn next_deadline(&self, now: MonoTime) -> MonoTime {
        let faults = [&self.camera, &self.v2i].into_iter().flatten().filter_map(Faults::next_deadline);
        faults.chain(self.reception.next_deadline(now)).fold(self.engine.next_deadline(), MonoTime::min)
    }

    /// The engine.
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

    /// What arrives first of all that is on its way and due.
    fn next_arrival(&mut self, now: MonoTime) -> Option<Emission> {
        let at = |faults: &Option<Faults>| faults.as_ref().and_then(Faults::next_deadline);
        let first = match (at(&self.camera), at(&self.v2i)) {
            (Some(camera), Some(v2i)) if v2i < camera => &mut self.v2i,
            (Some(_), _) => &mut self.camera,
            (None, _) => &mut self.v2i,
        };
        first.as_mut()?.poll(now)
    }

    /// What arrived is sent, and judged.
    fn arrived(&mut self, emission: Emission, now: Now) {
        let judged = self.arbiter.as_mut().and_then(|arbiter| judge(arbiter, &emission, now.wall));
        self.ready.push_back(TrafficLightOutput::Publish(emission));
        self.ready.extend(judged.map(|judged| {
            let (topic, stamp) = (LightsTopic::Arbiter, WallStamp::from_nanos(judged.stamp.0));
            TrafficLightOutput::Publish(Emission { topic, stamp, content: Content::Groups(judged.groups) })
        }));
    }
}

/// What the arbiter makes of a message, if it is one for it.
fn judge(arbiter: &mut Arbiter, emission: &Emission, clock: WallStamp) -> Option<Judged> {
    let Content::Groups(groups) = &emission.content else { return None };
    let stamp = ArbiterStamp(emission.stamp.as_nanos());
    match emission.topic {
        LightsTopic::Camera => arbiter.perception(stamp, groups).ok(),
        LightsTopic::V2i => arbiter.external(stamp, groups, ArbiterStamp(clock.as_nanos())).ok(),
        LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers => None,
    }
}
