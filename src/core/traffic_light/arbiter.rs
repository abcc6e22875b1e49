//! Merges the reports of camera and network as `autoware_traffic_light_arbiter` does
//! (docs/spec/traffic-lights.md, "Arbiter").
//!
//! Output only follows input. The network's groups are kept one by one, each with the stamp of its message; of
//! the camera the last message counts as a whole. Only groups that changed are merged anew.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use super::emission::{GroupState, Groups};
use super::incremental_update::update;
use crate::core::map::light_map::LightMap;
use inputs::{Network, Perceived};
use selection::{GroupSides, select};

mod inputs;
#[cfg(test)]
mod model;
#[cfg(test)]
mod properties;
mod selection;

/// Stamp of a message, nanoseconds since the epoch of the node's clock.
///
/// The tolerances compare stamps of messages with each other and with that clock; a `WallStamp` has no order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct ArbiterStamp(pub i64);

/// The side whose elements are preferred (`source_priority`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Priority {
    /// The side with the higher confidence, element by element.
    #[default]
    Confidence,
    /// The network's report.
    External,
    /// The camera's report.
    Perception,
}

/// Parameters of the node, with its own defaults (docs/spec/traffic-lights.md, "Inputs and tolerances").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArbiterSettings {
    /// Largest difference between an external stamp and the clock: `external_delay_tolerance`.
    pub external_delay_tolerance: Duration,
    /// Largest difference between an external and a perception stamp: `external_time_tolerance`.
    pub external_time_tolerance: Duration,
    /// Largest time by which perception may lag behind the newest external stamp: `perception_time_tolerance`.
    pub perception_time_tolerance: Duration,
    /// The preferred side; without effect on vehicle groups when matching is on.
    pub priority: Priority,
    /// True when only elements that both sides report count: `enable_signal_matching`.
    pub matching: bool,
}

/// Merges the groups of the camera and of the network.
#[derive(Debug, Clone)]
pub struct Arbiter {
    settings: ArbiterSettings,
    /// The groups of the map by relation id; true for those of pedestrians.
    map: BTreeMap<i64, bool>,
    /// Stamp of the last message of the camera.
    perception: Option<ArbiterStamp>,
    /// The time by which its age is judged; `None` when only stamps of the network show that it lags.
    clock: Option<ArbiterStamp>,
    perceived: Perceived,
    network: Network,
    /// Relation ids of groups that changed since they were merged.
    changed: BTreeSet<i64>,
    /// True when perception counted at the last merge.
    was_timely: bool,
    merged: Groups,
}

impl ArbiterStamp {
    /// Time between two stamps, whichever is newer.
    pub const fn distance(self, other: Self) -> Duration {
        Duration::from_nanos(self.0.abs_diff(other.0))
    }
}

impl Default for ArbiterSettings {
    fn default() -> Self {
        Self {
            external_delay_tolerance: Duration::from_secs(5),
            external_time_tolerance: Duration::from_secs(5),
            perception_time_tolerance: Duration::from_secs(1),
            priority: Priority::default(),
            matching: false,
        }
    }
}

impl Arbiter {
    /// Creates an arbiter for the groups of a map. It has received nothing.
    pub fn new(settings: ArbiterSettings, map: &LightMap) -> Self {
        Self {
            settings,
            map: map.groups().map(|(id, group)| (id, group.is_pedestrian)).collect(),
            perception: None,
            clock: None,
            perceived: Perceived::default(),
            network: Network::default(),
            changed: BTreeSet::new(),
            was_timely: true,
            merged: Arc::default(),
        }
    }

    /// Goes on with other settings. All groups are merged anew with the next message.
    pub fn reconfigure(&mut self, settings: ArbiterSettings) {
        if self.settings != settings {
            self.settings = settings;
            self.changed.extend(self.map.keys());
        }
    }

    /// Sets the time by which the camera's last message is judged from now on: while it lags behind that by more than
    /// the tolerance, it does not count, whatever the network sends.
    pub fn set_clock(&mut self, clock: ArbiterStamp) {
        self.clock = Some(clock);
    }

    /// Takes a message of the camera, which replaces the one before. Returns the merged groups: ascending by relation
    /// id, once each; their elements ascending by the number that ROS gives their shape, one for each shape. They
    /// are shared with earlier results as long as nothing changed.
    pub fn perception(&mut self, stamp: ArbiterStamp, groups: &[Arc<GroupState>]) -> Groups {
        self.perception = Some(stamp);
        self.perceived.take(groups, &mut self.changed);
        self.network.forget(stamp, self.settings.external_time_tolerance, &mut self.changed);
        self.merge()
    }

    /// Takes a message of the network at `clock`, each group of which replaces the one before. Returns the merged
    /// groups likewise; `None` when its stamp is too far from the clock, and so it is ignored.
    pub fn external(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
        clock: ArbiterStamp,
    ) -> Option<Groups> {
        let tolerance = self.settings.external_delay_tolerance;
        if clock.distance(stamp) > tolerance {
            return None;
        }
        self.network.take(stamp, groups, &mut self.changed);
        self.network.forget(clock, tolerance, &mut self.changed);
        Some(self.merge())
    }

    /// Returns whether perception counts: neither the newest stamp of the network nor the clock shows that it lags.
    fn is_timely(&self) -> bool {
        let newest = self.network.newest().max(self.clock);
        let (Some(stamp), Some(newest)) = (self.perception, newest) else { return true };
        newest <= stamp || newest.distance(stamp) <= self.settings.perception_time_tolerance
    }

    /// Merges the groups that changed. Groups that the map does not have are left out.
    fn merge(&mut self) -> Groups {
        let mut changed = std::mem::take(&mut self.changed);
        let is_timely = self.is_timely();
        if std::mem::replace(&mut self.was_timely, is_timely) != is_timely {
            changed.extend(self.perceived.ids());
        }
        let mut changes = Vec::with_capacity(changed.len());
        for relation_id in changed {
            let Some(is_pedestrian) = self.map.get(&relation_id) else { continue };
            let perception = if is_timely { self.perceived.of(relation_id) } else { &[] };
            let sides = GroupSides { perception, external: self.network.of(relation_id) };
            let group = (!sides.is_empty()).then(|| {
                Arc::new(GroupState {
                    relation_id,
                    elements: select(&sides, *is_pedestrian, &self.settings),
                    predictions: sides.predictions(),
                })
            });
            changes.push((relation_id, group.into_iter().collect()));
        }
        update(&mut self.merged, changes);
        Arc::clone(&self.merged)
    }
}
