//! The reports of camera and network, merged as `autoware_traffic_light_arbiter` does it
//! (docs/spec/traffic-lights.md, "Arbiter").
//!
//! Output only follows input. The network's groups are kept one by one, each with the stamp it came
//! with; of the camera the last message counts as a whole. Only groups that changed are judged anew.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use super::emission::{GroupState, Groups};
use super::incremental_update::update;
use crate::core::map::light_map::LightMap;
use kept::{Network, Perceived};
use selection::{Sides, select};

mod kept;
#[cfg(test)]
mod model;
#[cfg(test)]
mod properties;
mod selection;

/// Stamp of a message, nanoseconds since the epoch of the node's clock.
///
/// Stamps of messages are compared with each other and with that clock here, since the tolerances
/// are about them; a `WallStamp` cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct ArbiterStamp(pub i64);

/// Whom to believe (`source_priority`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Priority {
    /// Whoever is more confident.
    #[default]
    Confidence,
    /// The network.
    External,
    /// The camera.
    Perception,
}

/// Parameters, with the shipped values as default (docs/spec/traffic-lights.md, "Inputs and tolerances").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArbiterSettings {
    /// Most that an external stamp may differ from the clock: `external_delay_tolerance`.
    pub external_delay_tolerance: Duration,
    /// Most that an external stamp may differ from a perception stamp: `external_time_tolerance`.
    pub external_time_tolerance: Duration,
    /// Most that perception may lag behind the newest external stamp: `perception_time_tolerance`.
    pub perception_time_tolerance: Duration,
    /// Whom to believe; without effect on vehicle groups when matching is on.
    pub priority: Priority,
    /// Only elements that both sides report count: `enable_signal_matching`.
    pub matching: bool,
}

/// The merged state.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// That of the input that caused it.
    pub stamp: ArbiterStamp,
    /// Ascending by relation id, once each; elements ascending by the number ROS gives their shape, one for
    /// each shape. Shared with earlier outputs when nothing changed in between.
    pub groups: Groups,
    /// Groups that were left out because the map does not have them, ascending.
    pub off_map: Vec<i64>,
    /// A stored input is newer than `stamp`.
    pub newer_input: bool,
}

/// Why an input causes no output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum NoOutput {
    /// The map has not come yet. The input is kept.
    #[error("no map yet")]
    NoMap,
    /// The stamp of an external message differs too much from the clock. The input is forgotten.
    #[error("the stamp of an external message is too far from the clock")]
    ExternalDelay,
}

/// The arbiter.
#[derive(Debug, Clone)]
pub struct Arbiter {
    settings: ArbiterSettings,
    /// Whether a group is for pedestrians, by relation id.
    map: Option<BTreeMap<i64, bool>>,
    /// Stamp of the last message of the camera.
    perception: Option<ArbiterStamp>,
    perceived: Perceived,
    network: Network,
    /// Relation ids of groups of which something changed since they were judged.
    changed: BTreeSet<i64>,
    /// Whether perception counted then.
    was_timely: bool,
    judged: Groups,
    /// Judged groups that the map does not have.
    off_map: BTreeSet<i64>,
}

impl ArbiterStamp {
    /// How far apart two stamps are, whichever is newer.
    pub const fn distance(self, other: Self) -> Duration {
        Duration::from_nanos(self.0.abs_diff(other.0))
    }
}

impl Priority {
    /// Finds a priority by the name of the parameter. Autoware takes any other text for `confidence`, with a warning.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "confidence" => Some(Self::Confidence),
            "external" => Some(Self::External),
            "perception" => Some(Self::Perception),
            _ => None,
        }
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
    /// Knows nothing yet.
    pub fn new(settings: ArbiterSettings) -> Self {
        Self {
            settings,
            map: None,
            perception: None,
            perceived: Perceived::default(),
            network: Network::default(),
            changed: BTreeSet::new(),
            was_timely: true,
            judged: Arc::default(),
            off_map: BTreeSet::new(),
        }
    }

    /// Takes the groups of a map in place of any before. Causes no output.
    pub fn map(&mut self, map: &LightMap) {
        self.map = Some(map.groups().map(|(id, group)| (id, group.is_pedestrian)).collect());
        self.judged = Arc::default();
        self.off_map.clear();
        self.changed = self.perceived.ids().chain(self.network.ids()).collect();
    }

    /// Takes what the camera reports, in place of what it reported before.
    pub fn perception(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
    ) -> Result<Judged, NoOutput> {
        self.perception = Some(stamp);
        self.perceived.take(groups, &mut self.changed);
        self.network.forget(stamp, self.settings.external_time_tolerance, &mut self.changed);
        self.judge(stamp)
    }

    /// Takes what the network reports at `clock`, group by group in place of what it reported of that
    /// group before.
    pub fn external(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
        clock: ArbiterStamp,
    ) -> Result<Judged, NoOutput> {
        let tolerance = self.settings.external_delay_tolerance;
        if clock.distance(stamp) > tolerance {
            return Err(NoOutput::ExternalDelay);
        }
        self.network.take(stamp, groups, &mut self.changed);
        self.network.forget(clock, tolerance, &mut self.changed);
        self.judge(stamp)
    }

    /// The newest stamp among the inputs that are kept.
    pub fn latest_input(&self) -> Option<ArbiterStamp> {
        self.perception.max(self.network.newest())
    }

    /// Whether perception counts: the network's newest stamp does not show that it lags.
    fn is_timely(&self) -> bool {
        let (Some(stamp), Some(newest)) = (self.perception, self.network.newest()) else { return true };
        newest <= stamp || newest.distance(stamp) <= self.settings.perception_time_tolerance
    }

    /// Judges the groups that changed.
    fn judge(&mut self, stamp: ArbiterStamp) -> Result<Judged, NoOutput> {
        let mut changed = std::mem::take(&mut self.changed);
        let map = self.map.as_ref().ok_or(NoOutput::NoMap)?;
        // Every group is off a map without groups: that is not news.
        if !map.is_empty() {
            let is_timely = self.is_timely();
            if is_timely != self.was_timely {
                changed.extend(self.perceived.ids());
            }
            let mut news = Vec::with_capacity(changed.len());
            for relation_id in changed {
                let perception = if is_timely { self.perceived.of(relation_id) } else { &[] };
                let sides = Sides { perception, external: self.network.of(relation_id) };
                let is_pedestrian = map.get(&relation_id);
                if is_pedestrian.is_none() && !sides.is_silent() {
                    self.off_map.insert(relation_id);
                } else {
                    self.off_map.remove(&relation_id);
                }
                let group = is_pedestrian.filter(|_| !sides.is_silent()).map(|is_pedestrian| GroupState {
                    relation_id,
                    elements: select(&sides, *is_pedestrian, &self.settings),
                    predictions: sides.predictions(),
                });
                news.push((relation_id, group.map(Arc::new).into_iter().collect()));
            }
            update(&mut self.judged, news);
            self.was_timely = is_timely;
        }
        Ok(Judged {
            stamp,
            groups: Arc::clone(&self.judged),
            off_map: self.off_map.iter().copied().collect(),
            newer_input: self.latest_input().is_some_and(|latest| latest > stamp),
        })
    }
}
