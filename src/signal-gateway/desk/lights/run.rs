//! Runs a scenario from its start to its end, one step per time at which something is due.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::report::lights::{Snapshot, States};
use gateway_base::time::{MonoTime, Now, WallStamp};
use traffic_lights::emission::{LightsContent, LightsTopic};
use traffic_lights::engine::{LightsSettings, TrafficLights};
use traffic_lights::event_log::{LoggedEvent, ScenarioOutcome};
use traffic_lights::scenario::{ControllerIndex, Scenario};
use traffic_lights::target::StoreId;

/// A scenario in progress.
#[derive(Debug)]
pub struct ScenarioRun {
    lights: TrafficLights,
    until: MonoTime,
    states: States,
    events: Vec<LoggedEvent>,
    store_changes: [u64; 4],
    at: Option<MonoTime>,
    contradictions: BTreeMap<(StoreId, i64), MonoTime>,
}

impl ScenarioRun {
    /// Creates a run before its start, to the end of the scenario or `until`. It has the camera topic and the
    /// V2I topic, regardless of the topics in the settings.
    pub fn new(mut settings: LightsSettings, until: Duration) -> Self {
        settings.topics = [LightsTopic::Camera, LightsTopic::V2i].into();
        Self {
            lights: TrafficLights::new(settings, now(MonoTime::ZERO)),
            until: MonoTime::ZERO.after(until),
            states: States::default(),
            events: Vec::new(),
            store_changes: [0; 4],
            at: None,
            contradictions: BTreeMap::new(),
        }
    }

    /// Returns the next snapshot; the first is time zero, `None` comes after the end.
    pub fn step(&mut self) -> Option<Snapshot<'_>> {
        let due = self.lights.next_deadline();
        let at = match self.at {
            None => MonoTime::ZERO,
            Some(_) if self.verdict().is_some() || due > self.until => return None,
            Some(_) => due,
        };
        self.at = Some(at);
        if due <= at {
            self.lights.advance(now(at));
        }
        let mut has_changed = self.update_stores();
        let mut is_frame = false;
        while let Some(emission) = self.lights.poll_output() {
            is_frame |= emission.topic == LightsTopic::Camera;
            let sent = match emission.topic {
                LightsTopic::Camera => &mut self.states.internal,
                LightsTopic::V2i => &mut self.states.external,
                LightsTopic::GroundTruth
                | LightsTopic::Arbiter
                | LightsTopic::Markers
                | LightsTopic::Clock => continue,
            };
            let LightsContent::Groups(groups) = emission.content else { continue };
            if sent.as_ref() != Some(&groups) {
                has_changed = true;
                *sent = Some(groups);
            }
        }
        self.events = std::iter::from_fn(|| self.lights.poll_event()).collect();
        has_changed |= !self.events.is_empty();
        let controllers = 0..self.scenario().controllers.len();
        self.states.phases = controllers.map(|index| self.lights.phase(ControllerIndex(index))).collect();
        let scenario = self.lights.scenario();
        Some(Snapshot { at, is_frame, has_changed, events: &self.events, states: &self.states, scenario })
    }

    /// Returns the lights that showed red and green simultaneously, each with the first such time.
    pub fn contradictions(&self) -> impl Iterator<Item = (StoreId, i64, MonoTime)> {
        self.contradictions.iter().map(|((store, id), at)| (*store, *id, *at))
    }

    /// Returns the scenario, which has the names for positions.
    pub fn scenario(&self) -> &Scenario {
        self.lights.scenario()
    }

    /// Returns the result of the scenario; `None` before its end.
    pub fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.lights.verdict()
    }

    /// Returns the time of the last step; zero before the first.
    pub fn at(&self) -> MonoTime {
        self.at.unwrap_or_default()
    }

    fn update_stores(&mut self) -> bool {
        let mut has_changed = false;
        for (last, store) in self.store_changes.iter_mut().zip(StoreId::ALL) {
            let changes = self.lights.stores().changes(store);
            if *last != changes {
                *last = changes;
                let lights = self.lights.states(store);
                for (id, _) in lights.iter().filter(|(_, light)| light.bulbs.is_contradictory()) {
                    self.contradictions.entry((store, *id)).or_insert(self.at.unwrap_or_default());
                }
                // A phase that sets the same state again changes the store, but not its content.
                has_changed |= self.states.stores.get(&store) != Some(&lights);
                self.states.stores.insert(store, lights);
            }
        }
        has_changed
    }
}

/// Stamps also count from the start of the scenario.
fn now(at: MonoTime) -> Now {
    Now { mono: at, wall: WallStamp::from_nanos(i64::try_from(at.as_nanos()).unwrap_or(i64::MAX)) }
}
