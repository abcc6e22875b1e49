//! The four stores: ground truth and detections for each channel
//! (docs/spec/traffic-lights.md, "Objects", "Stores and channels" and "Clearing").
//!
//! Improved mode resolves an id as a group first, then as a head, and keeps one entry for each head. Upstream
//! keeps a detection under the id as written (Q3) and creates a light for each id that it reads (Q15).

use std::collections::BTreeMap;
use std::sync::Arc;

use super::bulb::{Bulb, BulbSet, BulbStatus};
use super::bulb_counts::BulbCounts;
use super::change_log::ChangeLog;
use super::quirks::LightQuirks;
use super::received::{ReceivedGroups, ReceivedState};
use super::refusal::ActionRefusal;
use super::target::{LightChannel, SignalTarget, StoreId, StoreLayer};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::{HeadIndex, LightMap};

/// The state of one light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Bulbs of the light, empty if it is dark; `None` if it was never touched, or is not detected.
    pub bulbs: Option<BulbSet>,
    /// Confidence, 0 to 1, kept when the light is cleared; upstream accepts any number.
    pub confidence: f64,
    pub(super) written: u64,
}

/// A change of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightChange {
    /// Replaces the bulbs.
    Set(BulbSet),
    /// Adds these bulbs.
    Add(BulbSet),
    /// Makes the light dark, or no longer detected; its confidence is kept.
    Clear,
    /// Makes the light untouched, as at the start.
    Remove,
    /// Sets the confidence, and keeps the bulbs.
    Confidence(f64),
}

/// An expected state of a light (docs/spec/traffic-lights.md, "Conditions and triggers").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// No bulb, or in improved mode only bulbs with `solidOff` (Q13).
    Dark,
    /// All of these bulbs, and possibly others.
    Contains(BulbSet),
    /// These bulbs and no others.
    Exactly(BulbSet),
}

/// Ground truth of one channel, by head.
#[derive(Debug, Clone)]
pub struct GroundTruth {
    lights: Vec<Light>,
    pub(super) counts: BulbCounts,
    pub(super) change_log: ChangeLog,
}

/// Detections of one channel, by way id of the head; in upstream mode by the id as written.
#[derive(Debug, Clone)]
pub struct Detected {
    entries: BTreeMap<i64, DetectedLight>,
    pub(super) counts: BulbCounts,
    pub(super) change_log: ChangeLog,
}

/// A detection of a head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectedLight {
    /// The head; in upstream mode the first head if the key is the id of a group.
    pub head: HeadIndex,
    /// The detected state of the head.
    pub light: Light,
}

/// All four stores, and the received states of groups, over one map.
#[derive(Debug, Clone)]
pub struct Stores {
    pub(super) map: Arc<LightMap>,
    pub(super) quirks: LightQuirks,
    channels: [(GroundTruth, Detected); 2],
    /// States received for groups over V2I.
    pub(super) received: ReceivedGroups,
    writes: u64,
}

/// Returns the heads of an id: all heads of the group, otherwise the one head.
pub fn heads_of(map: &LightMap, id: i64) -> Result<impl Iterator<Item = HeadIndex> + '_, ActionRefusal> {
    let group = map.group(id);
    let head = if group.is_none() { map.head(id) } else { None };
    if group.is_none() && head.is_none() {
        return Err(ActionRefusal::UnknownId(id));
    }
    Ok(group.into_iter().flat_map(|group| group.heads.iter().copied()).chain(head))
}

impl Light {
    const UNTOUCHED: Self = Self { bulbs: None, confidence: 1.0, written: 0 };

    /// Applies a change. Returns whether this made a difference.
    fn apply(&mut self, change: LightChange, write: u64) -> bool {
        let before = (self.bulbs, self.confidence.to_bits());
        match change {
            LightChange::Set(bulbs) => self.bulbs = Some(bulbs),
            LightChange::Add(bulbs) => self.bulbs = Some(self.bulbs.unwrap_or_default().union(bulbs)),
            LightChange::Clear => self.bulbs = self.bulbs.map(|_| BulbSet::EMPTY),
            LightChange::Remove => *self = Self::UNTOUCHED,
            LightChange::Confidence(confidence) => self.confidence = confidence,
        }
        self.written = write;
        before != (self.bulbs, self.confidence.to_bits())
    }
}

impl GroundTruth {
    /// Returns the light of a head.
    pub fn light(&self, head: HeadIndex) -> Option<&Light> {
        self.lights.get(head.0 as usize)
    }

    /// Returns the lights of all heads, ascending by way id, including untouched ones.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    fn apply(&mut self, head: HeadIndex, change: LightChange, write: u64, quirks: LightQuirks) -> bool {
        let Some(light) = self.lights.get_mut(head.0 as usize) else { return false };
        let before = light.bulbs;
        let created = quirks.touches_by_reading && light.bulbs.is_none();
        if created {
            light.bulbs = Some(BulbSet::EMPTY);
        }
        let changed = light.apply(change, write) || created;
        if changed {
            self.counts.change(before, light.bulbs);
            self.change_log.add(head);
        }
        changed
    }
}

impl Detected {
    /// Returns the entries, ascending by key. An entry without bulbs holds only a confidence.
    pub fn entries(&self) -> impl Iterator<Item = (i64, &DetectedLight)> {
        self.entries.iter().map(|(key, entry)| (*key, entry))
    }

    pub(super) fn light(&self, key: i64) -> Light {
        self.entries.get(&key).map_or(Light::UNTOUCHED, |entry| entry.light)
    }

    fn apply(
        &mut self,
        key: i64,
        head: HeadIndex,
        change: LightChange,
        write: u64,
        quirks: LightQuirks,
    ) -> bool {
        let before = self.light(key).bulbs;
        let changed = match change {
            LightChange::Remove => self.entries.remove(&key).is_some(),
            LightChange::Clear if quirks.clears_confidence => self.entries.remove(&key).is_some(),
            // The confidence is kept.
            LightChange::Clear => self.entries.get_mut(&key).is_some_and(|entry| {
                entry.light.written = write;
                entry.light.bulbs.take().is_some()
            }),
            LightChange::Set(_) | LightChange::Add(_) | LightChange::Confidence(_) => {
                let entry =
                    self.entries.entry(key).or_insert(DetectedLight { head, light: Light::UNTOUCHED });
                entry.light.apply(change, write)
            }
        };
        if changed {
            self.counts.change(before, self.light(key).bulbs);
            self.change_log.add(head);
        }
        changed
    }
}

impl Stores {
    /// Creates the stores of a map, with all lights untouched.
    pub fn new(map: Arc<LightMap>, quirks: impl Into<LightQuirks>) -> Self {
        let (heads, counts) = (map.heads().len(), BulbCounts::default());
        let change_log = ChangeLog::new(heads);
        let truth =
            GroundTruth { lights: vec![Light::UNTOUCHED; heads], counts, change_log: change_log.clone() };
        let detected = Detected { entries: BTreeMap::new(), counts, change_log };
        let channels = [(truth.clone(), detected.clone()), (truth, detected)];
        Self { map, quirks: quirks.into(), channels, received: ReceivedGroups::new(heads), writes: 0 }
    }

    /// Returns the ground truth of a channel.
    pub fn truth(&self, channel: LightChannel) -> &GroundTruth {
        &self.channels[channel as usize].0
    }

    /// Returns the detections of a channel.
    pub fn detected(&self, channel: LightChannel) -> &Detected {
        &self.channels[channel as usize].1
    }

    /// Replaces the received state of a group; `None` removes it. Returns false if the map has no such group,
    /// or the group has no heads.
    pub(super) fn receive(
        &mut self,
        layer: StoreLayer,
        relation_id: i64,
        state: Option<ReceivedState>,
    ) -> bool {
        let Some(group) = self.map.group(relation_id).filter(|group| !group.heads.is_empty()) else {
            return false;
        };
        self.received.set((layer, relation_id), state, &group.heads);
        true
    }

    /// Removes received predictions whose time has come.
    pub(super) fn drop_past_predictions(&mut self, now: WallStamp) {
        let map = &self.map;
        let heads = |relation_id| map.group(relation_id).map_or(&[][..], |group| &group.heads);
        self.received.drop_past_predictions(now, heads);
    }

    /// Returns the counts of a store, with the received states of groups.
    pub(super) fn counts(&self, StoreId { channel, layer }: StoreId) -> BulbCounts {
        let own = match layer {
            StoreLayer::GroundTruth => self.truth(channel).counts,
            StoreLayer::Detected => self.detected(channel).counts,
        };
        match channel {
            LightChannel::Conventional => own,
            LightChannel::V2i => own + self.received.counts(layer),
        }
    }

    /// Returns the bulbs of a head in the ground truth of a channel; for V2I, the bulbs received last for a
    /// group with this head. `None` if the head was never touched.
    pub(super) fn shown(&self, channel: LightChannel, head: HeadIndex) -> Option<BulbSet> {
        let received = self.received_on(StoreId { channel, layer: StoreLayer::GroundTruth }, head);
        received.or_else(|| self.truth(channel).light(head)?.bulbs)
    }

    /// Returns the bulbs received last for a group with this head.
    fn received_on(&self, StoreId { channel, layer }: StoreId, head: HeadIndex) -> Option<BulbSet> {
        let head = self.map.at(head).filter(|_| channel == LightChannel::V2i)?;
        self.received.latest(layer, &head.relation_ids)
    }

    /// Returns the id of the first light of a channel that shows red and green: the way id of a head, the
    /// relation id of a group with a received state; in upstream mode the id as written.
    pub(super) fn contradictory_light(&self, channel: LightChannel) -> Option<i64> {
        let (truth, detected) = (self.truth(channel), self.detected(channel));
        let is_contradictory = |light: &Light| light.bulbs.is_some_and(BulbSet::is_contradictory);
        // Counts are cheap to read, a search is not.
        if truth.counts.contradictory > 0 {
            let head = truth.lights.iter().position(is_contradictory)?;
            return self.map.heads().get(head).map(|head| head.way_id);
        }
        if detected.counts.contradictory > 0 {
            return detected.entries().find(|(_, entry)| is_contradictory(&entry.light)).map(|(id, _)| id);
        }
        let layers = [StoreLayer::GroundTruth, StoreLayer::Detected].into_iter();
        let layers = layers.filter(|layer| self.counts(StoreId { channel, layer: *layer }).contradictory > 0);
        let mut groups = layers.flat_map(|layer| self.received.states(layer));
        groups.find(|(_, state)| state.bulbs.is_contradictory()).map(|(id, _)| id)
    }

    /// Returns the number of changes of a store so far, which differs whenever a light of the store differs.
    pub fn changes(&self, store: StoreId) -> u64 {
        match store.layer {
            StoreLayer::GroundTruth => self.truth(store.channel).change_log.changes,
            StoreLayer::Detected => self.detected(store.channel).change_log.changes,
        }
    }

    /// Changes all lights of a target. Returns whether this made a difference; an unknown id is refused.
    pub fn write(&mut self, target: SignalTarget, change: LightChange) -> Result<bool, ActionRefusal> {
        self.writes += 1;
        let Self { map, quirks, channels, writes, .. } = self;
        let (truth, detected) = &mut channels[target.store.channel as usize];
        match target.store.layer {
            StoreLayer::GroundTruth => {
                let changed =
                    heads_of(map, target.id)?.filter(|head| truth.apply(*head, change, *writes, *quirks));
                Ok(changed.count() > 0)
            }
            StoreLayer::Detected if !quirks.detects_by_written_id => {
                let changed = heads_of(map, target.id)?.filter(|index| {
                    let head = map.at(*index);
                    head.is_some_and(|head| detected.apply(head.way_id, *index, change, *writes, *quirks))
                });
                Ok(changed.count() > 0)
            }
            StoreLayer::Detected => {
                let head = map.head(target.id).or_else(|| map.group(target.id)?.heads.first().copied());
                let head = head.ok_or(ActionRefusal::UnknownId(target.id))?;
                Ok(detected.apply(target.id, head, change, *writes, *quirks))
            }
        }
    }

    pub(super) fn write_head(&mut self, channel: LightChannel, head: HeadIndex, change: LightChange) {
        self.writes += 1;
        self.channels[channel as usize].0.apply(head, change, self.writes, self.quirks);
    }

    /// Compares all heads of a target with an expected state. Upstream creates lights for them.
    pub fn matches(&mut self, target: SignalTarget, expected: Expected) -> Result<bool, ActionRefusal> {
        if self.quirks.touches_by_reading && target.store.layer == StoreLayer::GroundTruth {
            self.write(target, LightChange::Add(BulbSet::EMPTY))?;
        }
        let is_dark = |bulb: Bulb| bulb.status == BulbStatus::SolidOff && !self.quirks.solid_off_is_not_dark;
        Ok(self.bulbs(target)?.all(|bulbs| match expected {
            Expected::Dark => bulbs.iter().all(is_dark),
            Expected::Contains(expected) => bulbs.contains_all(&expected),
            Expected::Exactly(expected) => bulbs == expected,
        }))
    }

    /// Returns the number of the last write to the light with this id, or to the first light of a group; 0 if
    /// there is none.
    pub(super) fn written(&self, target: SignalTarget) -> u64 {
        let (truth, detected) = (self.truth(target.store.channel), self.detected(target.store.channel));
        let light = match target.store.layer {
            StoreLayer::GroundTruth => {
                let head = heads_of(&self.map, target.id).ok().and_then(|mut heads| heads.next());
                head.and_then(|head| truth.light(head).copied())
            }
            StoreLayer::Detected => Some(detected.light(target.id)),
        };
        light.map_or(0, |light| light.written)
    }

    /// Returns the bulbs of each head of a target, empty for a light that was never touched. A group shows
    /// the state received for it, a head the last state received for one of its groups.
    pub fn bulbs(&self, target: SignalTarget) -> Result<impl Iterator<Item = BulbSet> + '_, ActionRefusal> {
        let (truth, detected) = (self.truth(target.store.channel), self.detected(target.store.channel));
        // Upstream stores detections under the id as written: one entry, even for a group.
        let as_written = target.store.layer == StoreLayer::Detected && self.quirks.detects_by_written_id;
        let heads = heads_of(&self.map, target.id)?.take(if as_written { 1 } else { usize::MAX });
        let is_group = self.map.group(target.id).is_some();
        let of_group = self.received.state(target.store.layer, target.id);
        let of_group =
            of_group.filter(|_| target.store.channel == LightChannel::V2i).map(|state| state.bulbs);
        Ok(heads.map(move |head| {
            let received = if is_group { of_group } else { self.received_on(target.store, head) };
            if let Some(bulbs) = received {
                return bulbs;
            }
            let light = match target.store.layer {
                StoreLayer::GroundTruth => truth.light(head).copied(),
                StoreLayer::Detected if as_written => Some(detected.light(target.id)),
                StoreLayer::Detected => self.map.at(head).map(|head| detected.light(head.way_id)),
            };
            light.and_then(|light| light.bulbs).unwrap_or_default()
        }))
    }
}

#[cfg(test)]
mod tests;
