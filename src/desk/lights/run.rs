//! A scenario from its start to its end, one step for each time at which something is due.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::traffic_light::emission::{Content, LightsTopic};
use crate::core::traffic_light::engine::{LightObservation, LightsSettings, TrafficLights};
use crate::core::traffic_light::event_log::{Note, ScenarioOutcome};
use crate::core::traffic_light::scenario::{ControllerIndex, Scenario};
use crate::core::traffic_light::target::Layer;
use crate::report::lights::{STORES, Snapshot, States};

/// A scenario in progress.
#[derive(Debug)]
pub struct Run {
    lights: TrafficLights,
    until: MonoTime,
    states: States,
    notes: Vec<Note>,
    store_changes: [u64; 4],
    at: Option<MonoTime>,
}

impl Run {
    /// A run before its start, to the end of the scenario or `until`. It has the camera's and the V2I topic,
    /// whatever the topics of the settings.
    pub fn new(mut settings: LightsSettings, until: Duration) -> Self {
        settings.topics = [LightsTopic::Camera, LightsTopic::V2i].into();
        Self {
            lights: TrafficLights::new(settings, now(MonoTime::ZERO)),
            until: MonoTime::ZERO.after(until),
            states: States::default(),
            notes: Vec::new(),
            store_changes: [0; 4],
            at: None,
        }
    }

    /// The next snapshot; the first is time zero, `None` comes after the end.
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
            let kept = match emission.topic {
                LightsTopic::Camera => {
                    is_frame = true;
                    &mut self.states.internal
                }
                LightsTopic::V2i => &mut self.states.external,
                LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers => continue,
            };
            let is_same =
                |kept: &Content| kept.is_shared_with(&emission.content) || *kept == emission.content;
            if !kept.as_ref().is_some_and(is_same) {
                has_changed = true;
                *kept = Some(emission.content);
            }
        }
        self.notes = std::iter::from_fn(|| self.lights.poll_note()).collect();
        has_changed |= !self.notes.is_empty();
        let controllers = 0..self.scenario().controllers.len();
        self.states.phases = controllers.map(|index| self.lights.phase(ControllerIndex(index))).collect();
        let scenario = self.lights.scenario();
        Some(Snapshot { at, is_frame, has_changed, notes: &self.notes, states: &self.states, scenario })
    }

    /// The scenario, for the names behind positions.
    pub fn scenario(&self) -> &Scenario {
        self.lights.scenario()
    }

    /// The outcome of the scenario; `None` before its end.
    pub fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.lights.verdict()
    }

    /// Time of the last step; zero before the first.
    pub fn at(&self) -> MonoTime {
        self.at.unwrap_or_default()
    }

    fn update_stores(&mut self) -> bool {
        let mut has_changed = false;
        for (seen, store) in self.store_changes.iter_mut().zip(STORES) {
            let stores = self.lights.stores();
            let changes = match store.layer {
                Layer::GroundTruth => stores.truth(store.channel).changes(),
                Layer::Detected => stores.detected(store.channel).changes(),
            };
            if *seen != changes {
                *seen = changes;
                let lights: BTreeMap<_, _> = match store.layer {
                    Layer::GroundTruth => {
                        let lights = self.lights.ground_truth(store.channel);
                        let observed = lights.map(|light| {
                            let (bulbs, confidence) = (light.bulbs, light.confidence);
                            (light.way_id, LightObservation { bulbs, confidence })
                        });
                        observed.collect()
                    }
                    Layer::Detected => self.lights.detected(store.channel).collect(),
                };
                // A phase that sets again what was there changes the store, not what is seen.
                has_changed |= self.states.stores.get(&store) != Some(&lights);
                self.states.stores.insert(store, lights);
            }
        }
        has_changed
    }
}

/// Stamps count from the start of the scenario as well.
fn now(at: MonoTime) -> Now {
    Now { mono: at, wall: WallStamp::from_nanos(i64::try_from(at.as_nanos()).unwrap_or(i64::MAX)) }
}
