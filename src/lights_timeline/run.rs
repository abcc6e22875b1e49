//! A scenario from its first moment to its end, one step for each time at which something is due.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::traffic_light::emission::{Content, GroupState, LightsTopic};
use crate::core::traffic_light::engine::{LightObservation, LightsSettings, TrafficLights};
use crate::core::traffic_light::event_log::{Note, ScenarioOutcome};
use crate::core::traffic_light::scenario::{ControllerIndex, Scenario};
use crate::core::traffic_light::target::{Channel, Layer, StoreId};

/// The scenario, as far as it has run.
#[derive(Debug)]
pub struct Run {
    lights: TrafficLights,
    until: MonoTime,
    shown: Shown,
    store_changes: [u64; 4],
    at: Option<MonoTime>,
}

/// What there is to see at a time.
#[derive(Debug, Clone, Default)]
pub struct Shown {
    stores: BTreeMap<StoreId, BTreeMap<i64, LightObservation>>,
    internal: Option<Content>,
    external: Option<Content>,
}

/// One time at which something was due.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// When: since the start of the scenario, which is time zero.
    pub at: MonoTime,
    /// Whether a frame was evaluated.
    pub is_frame: bool,
    /// What happened, in order.
    pub notes: Vec<Note>,
    /// Whether anything happened or looks different.
    pub has_changed: bool,
}

/// The stores, in the order in which they are shown.
pub const STORES: [StoreId; 4] = {
    use Channel::{Conventional, V2i};
    use Layer::{Detected, GroundTruth};
    [
        StoreId { channel: Conventional, layer: GroundTruth },
        StoreId { channel: Conventional, layer: Detected },
        StoreId { channel: V2i, layer: GroundTruth },
        StoreId { channel: V2i, layer: Detected },
    ]
};

impl Run {
    /// The scenario is about to start. It is shown to its end, but no longer than `until`, and with
    /// the camera's and the V2I topic, whatever the settings say.
    pub fn new(mut settings: LightsSettings, until: Duration) -> Self {
        settings.topics = [LightsTopic::Camera, LightsTopic::V2i].into();
        Self {
            lights: TrafficLights::new(settings, now(MonoTime::ZERO)),
            until: MonoTime::ZERO.after(until),
            shown: Shown::default(),
            store_changes: [0; 4],
            at: None,
        }
    }

    /// The next step; the first is time zero, `None` comes after the end.
    pub fn step(&mut self) -> Option<Step> {
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
        let mut has_changed = self.look_at_stores();
        let mut is_frame = false;
        while let Some(emission) = self.lights.poll_output() {
            let kept = match emission.topic {
                LightsTopic::Camera => {
                    is_frame = true;
                    &mut self.shown.internal
                }
                LightsTopic::V2i => &mut self.shown.external,
                LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers => continue,
            };
            let is_same =
                |kept: &Content| kept.is_shared_with(&emission.content) || *kept == emission.content;
            if !kept.as_ref().is_some_and(is_same) {
                has_changed = true;
                *kept = Some(emission.content);
            }
        }
        let notes: Vec<_> = std::iter::from_fn(|| self.lights.poll_note()).collect();
        has_changed |= !notes.is_empty();
        Some(Step { at, is_frame, notes, has_changed })
    }

    /// What there is to see after the last step.
    pub fn shown(&self) -> &Shown {
        &self.shown
    }

    /// The scenario, for the names behind positions.
    pub fn scenario(&self) -> &Scenario {
        self.lights.scenario()
    }

    /// Position of the phase a controller is in after the last step.
    pub fn phase(&self, controller: ControllerIndex) -> Option<usize> {
        self.lights.phase(controller)
    }

    /// How the scenario ended; none while it goes on.
    pub fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.lights.verdict()
    }

    /// Time of the last step; zero before the first.
    pub fn at(&self) -> MonoTime {
        self.at.unwrap_or_default()
    }

    fn look_at_stores(&mut self) -> bool {
        let mut has_changed = false;
        for (seen, store) in self.store_changes.iter_mut().zip(STORES) {
            let stores = self.lights.stores();
            let changes = match store.layer {
                Layer::GroundTruth => stores.truth(store.channel).changes(),
                Layer::Detected => stores.detected(store.channel).changes(),
            };
            if *seen != changes {
                *seen = changes;
                let sights: BTreeMap<_, _> = match store.layer {
                    Layer::GroundTruth => {
                        let lights = self.lights.ground_truth(store.channel);
                        lights
                            .map(|light| {
                                (
                                    light.way_id,
                                    LightObservation { bulbs: light.bulbs, confidence: light.confidence },
                                )
                            })
                            .collect()
                    }
                    Layer::Detected => self.lights.detected(store.channel).collect(),
                };
                // A phase that sets again what was there changes the store, not what is seen.
                has_changed |= self.shown.stores.get(&store) != Some(&sights);
                self.shown.stores.insert(store, sights);
            }
        }
        has_changed
    }
}

impl Shown {
    /// The lights of a store that were touched or detected, ascending by id.
    pub fn store(&self, store: StoreId) -> impl Iterator<Item = (i64, &LightObservation)> {
        self.stores.get(&store).into_iter().flatten().map(|(id, sight)| (*id, sight))
    }

    /// The groups last sent as what the camera sees; none before the first message.
    pub fn internal(&self) -> Option<&[Arc<GroupState>]> {
        groups(self.internal.as_ref())
    }

    /// The groups last sent over V2I, with predictions; none before the first message.
    pub fn external(&self) -> Option<&[Arc<GroupState>]> {
        groups(self.external.as_ref())
    }
}

fn groups(content: Option<&Content>) -> Option<&[Arc<GroupState>]> {
    match content? {
        Content::Groups(groups) => Some(groups),
        Content::Lights(_) | Content::Markers(_) => None,
    }
}

/// Stamps count from the start of the scenario as well.
fn now(at: MonoTime) -> Now {
    Now { mono: at, wall: WallStamp::from_nanos(i64::try_from(at.as_nanos()).unwrap_or(i64::MAX)) }
}
