//! Merges the reports of camera and network as `autoware_traffic_light_arbiter` does
//! (docs/spec/traffic-lights.md, "Arbiter").
//!
//! The arbiter has an output only after an input. It keeps the network's groups separately, each with the
//! stamp of its message, and the camera's last message as a whole. Only changed groups are merged again.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::emission::{GroupState, Groups};
use super::incremental_update::update;
use inputs::{Network, Perceived};
use lanelet2_map::light_map::LightMap;
use selection::{GroupSides, select};

mod inputs;
#[cfg(test)]
mod model;
#[cfg(test)]
mod properties;
mod selection;
mod settings;

pub use settings::{ArbiterSettings, ArbiterStamp, Priority};

/// Merges the groups of the camera and of the network.
///
/// ```
/// use std::sync::Arc;
///
/// use lanelet2_map::light_map::{GroupEntry, LightMap};
/// use traffic_lights::arbiter::{Arbiter, ArbiterSettings, ArbiterStamp};
/// use traffic_lights::emission::GroupState;
///
/// let map = LightMap::new([], &[GroupEntry::new(100, [11, 12])]);
/// let mut arbiter = Arbiter::new(ArbiterSettings::default(), &map);
/// let group = |relation_id| Arc::new(GroupState { relation_id, ..GroupState::default() });
/// let merged = arbiter.perception(ArbiterStamp(0), &[group(100), group(999)]);
/// assert_eq!(merged.len(), 1, "the map has no group 999");
/// ```
#[derive(Debug, Clone)]
pub struct Arbiter {
    settings: ArbiterSettings,
    /// The groups of the map by relation id; true for a group of pedestrians.
    map: BTreeMap<i64, bool>,
    perception: Option<ArbiterStamp>,
    /// The time by which the age of the camera's message is judged: while the message lags behind it by more
    /// than the tolerance, it is ignored, whatever the network sends. `None` if only the network's stamps can
    /// show that it lags.
    pub clock: Option<ArbiterStamp>,
    perceived: Perceived,
    network: Network,
    /// Relation ids of groups that have changed since the last merge.
    changed: BTreeSet<i64>,
    /// True if perception counted at the last merge.
    was_timely: bool,
    merged: Groups,
}

impl Arbiter {
    /// Creates an arbiter for the groups of a map, without any input.
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

    /// Continues with other settings. The next message merges all groups again.
    pub fn reconfigure(&mut self, settings: ArbiterSettings) {
        if self.settings != settings {
            self.settings = settings;
            self.changed.extend(self.map.keys());
        }
    }

    /// Processes a message of the camera, which replaces the previous one. Returns the merged groups in
    /// ascending order of relation id, each once; their elements are in ascending order of the ROS number of
    /// their shape, one for each shape. Results are shared with earlier results while nothing changes.
    pub fn perception(&mut self, stamp: ArbiterStamp, groups: &[Arc<GroupState>]) -> Groups {
        self.perception = Some(stamp);
        self.perceived.take(groups, &mut self.changed);
        self.network.forget(stamp, self.settings.external_time_tolerance, &mut self.changed);
        self.merge()
    }

    /// Processes a message of the network received at `clock`. Each of its groups replaces the previous state
    /// of that group. Returns the merged groups like [`Self::perception`]; `None` if the stamp is too far
    /// from the clock, so that the message is ignored.
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

    /// Returns whether perception counts: neither the newest stamp of the network nor the clock shows that it
    /// lags.
    fn is_timely(&self) -> bool {
        let newest = self.network.newest().max(self.clock);
        let (Some(stamp), Some(newest)) = (self.perception, newest) else { return true };
        newest <= stamp || newest.distance(stamp) <= self.settings.perception_time_tolerance
    }

    /// Merges the changed groups. Groups that are not on the map are left out.
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
