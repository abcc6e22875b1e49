//! What the camera and the network report, merged as `autoware_traffic_light_arbiter` does it
//! (traffic-lights section 8, its newest revision).
//!
//! Output only follows input. The network's groups are kept one by one, each with the stamp it came
//! with; of the camera the last message counts as a whole.

use std::collections::BTreeMap;
use std::time::Duration;

use super::emission::GroupState;
use crate::core::map::light_map::LightMap;
use selection::{Sides, select};

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

/// Parameters, with the shipped values as default (section 8.2).
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
    /// Only what both sides say counts: `enable_signal_matching`.
    pub matching: bool,
}

/// The merged state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Judged {
    /// That of the input that caused it.
    pub stamp: ArbiterStamp,
    /// Ascending by relation id, once each; elements ascending by the number ROS gives their shape,
    /// one for each shape.
    pub groups: Vec<GroupState>,
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
    perception: Option<(ArbiterStamp, Vec<GroupState>)>,
    external: BTreeMap<i64, (ArbiterStamp, GroupState)>,
}

impl ArbiterStamp {
    /// How far apart two stamps are, whichever is newer.
    pub const fn distance(self, other: Self) -> Duration {
        Duration::from_nanos(self.0.abs_diff(other.0))
    }
}

impl Priority {
    /// By its word. Autoware takes any other word for `confidence`, with a warning.
    pub fn named(word: &str) -> Option<Self> {
        match word {
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
        Self { settings, map: None, perception: None, external: BTreeMap::new() }
    }

    /// Takes the groups of a map in place of any before. Causes no output.
    pub fn map(&mut self, map: &LightMap) {
        self.map = Some(map.groups().map(|(id, group)| (id, group.is_pedestrian)).collect());
    }

    /// Takes what the camera reports, in place of what it reported before.
    pub fn perception(&mut self, stamp: ArbiterStamp, groups: &[GroupState]) -> Result<Judged, NoOutput> {
        self.perception = Some((stamp, groups.to_vec()));
        self.forget_external(stamp, self.settings.external_time_tolerance);
        self.judge(stamp)
    }

    /// Takes what the network reports at `clock`, group by group in place of what it reported of that
    /// group before.
    pub fn external(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[GroupState],
        clock: ArbiterStamp,
    ) -> Result<Judged, NoOutput> {
        let tolerance = self.settings.external_delay_tolerance;
        if clock.distance(stamp) > tolerance {
            return Err(NoOutput::ExternalDelay);
        }
        self.external.extend(groups.iter().map(|group| (group.relation_id, (stamp, group.clone()))));
        self.forget_external(clock, tolerance);
        self.judge(stamp)
    }

    /// The newest stamp among the inputs that are kept.
    pub fn latest_input(&self) -> Option<ArbiterStamp> {
        self.perception.iter().map(|(stamp, _)| *stamp).chain(self.newest_external()).max()
    }

    fn newest_external(&self) -> Option<ArbiterStamp> {
        self.external.values().map(|(stamp, _)| *stamp).max()
    }

    fn forget_external(&mut self, reference: ArbiterStamp, tolerance: Duration) {
        self.external.retain(|_, (stamp, _)| reference.distance(*stamp) <= tolerance);
    }

    /// Perception, unless the network's newest stamp shows that it lags.
    fn timely_perception(&self) -> &[GroupState] {
        let Some((stamp, groups)) = &self.perception else { return &[] };
        let lags = |newest: ArbiterStamp| {
            newest > *stamp && newest.distance(*stamp) > self.settings.perception_time_tolerance
        };
        if self.newest_external().is_some_and(lags) { &[] } else { groups }
    }

    /// Section 8.4.
    fn judge(&self, stamp: ArbiterStamp) -> Result<Judged, NoOutput> {
        let map = self.map.as_ref().ok_or(NoOutput::NoMap)?;
        let newer_input = self.latest_input().is_some_and(|latest| latest > stamp);
        let mut judged = Judged { stamp, newer_input, ..Judged::default() };
        if map.is_empty() {
            return Ok(judged); // every group is off such a map: that is no news
        }
        let mut seen: BTreeMap<i64, Sides<'_>> = BTreeMap::new();
        for group in self.timely_perception() {
            seen.entry(group.relation_id).or_default().perception.push(group);
        }
        for (id, (_, group)) in &self.external {
            seen.entry(*id).or_default().external = Some(group);
        }
        for (relation_id, sides) in seen {
            match map.get(&relation_id) {
                Some(is_pedestrian) => judged.groups.push(GroupState {
                    relation_id,
                    elements: select(&sides, *is_pedestrian, &self.settings),
                    predictions: sides.predictions(),
                }),
                None => judged.off_map.push(relation_id),
            }
        }
        Ok(judged)
    }
}
