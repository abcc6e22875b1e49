//! States received for groups over V2I (docs/spec/traffic-lights.md, "Received states").
//!
//! A report of a network concerns a movement, and thus one group: groups that share heads do not affect each
//! other.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use super::bulb::BulbSet;
use super::bulb_counts::BulbCounts;
use super::change_log::ChangeLog;
use super::emission::Prediction;
use super::target::StoreLayer;
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::HeadIndex;

/// Maximum number of predictions kept for a group: the earliest ones.
pub const MAX_PREDICTIONS: usize = 16;
/// Maximum number of bulbs in a prediction.
const MAX_BULBS: usize = 8;
/// Maximum length of the source of a prediction, bytes.
const MAX_SOURCE_BYTES: usize = 64;
/// Maximum time between now and a predicted time.
const MAX_AHEAD: Duration = Duration::from_secs(3_600);

/// A state received for a light or group.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedState {
    /// Bulbs of the state, at least one.
    pub bulbs: BulbSet,
    /// Confidence of the state, 0 to 1.
    pub confidence: f64,
    /// Future states as received; kept only for groups of the V2I channel.
    pub predictions: Vec<Prediction>,
}

impl ReceivedState {
    /// Removes invalid, past and surplus predictions, and sorts the others by time. Returns the number of
    /// invalid and surplus predictions.
    pub(super) fn keep_fit_predictions(&mut self, now: WallStamp) -> usize {
        let latest = now.after(MAX_AHEAD).as_nanos();
        let mut rejected = 0;
        self.predictions.retain(|prediction| {
            let is_fit = is_fit(prediction) && prediction.at.as_nanos() <= latest;
            rejected += usize::from(!is_fit);
            is_fit && is_ahead(prediction, now)
        });
        self.predictions.sort_by_key(|prediction| prediction.at.as_nanos());
        rejected += self.predictions.len().saturating_sub(MAX_PREDICTIONS);
        self.predictions.truncate(MAX_PREDICTIONS);
        rejected
    }
}

fn is_ahead(prediction: &Prediction, now: WallStamp) -> bool {
    prediction.at.as_nanos() > now.as_nanos()
}

fn is_fit(prediction: &Prediction) -> bool {
    let is_share = |number: f64| (0.0..=1.0).contains(&number);
    is_share(prediction.reliability)
        && prediction.elements.len() <= MAX_BULBS
        && prediction.elements.iter().all(|element| is_share(element.confidence))
        && prediction.source.len() <= MAX_SOURCE_BYTES
        && !prediction.source.chars().any(char::is_control)
}

/// A layer, and the relation id of a group.
type Key = (StoreLayer, i64);

/// The received states of groups, at most one for each group of the map and layer.
#[derive(Debug, Clone)]
pub(super) struct ReceivedGroups {
    groups: BTreeMap<Key, ReceivedGroup>,
    /// The groups with predictions, by the time of their first prediction, nanoseconds since 1970.
    predicted: BTreeSet<(i64, Key)>,
    counts: [BulbCounts; 2],
    /// The changes of groups, by their heads.
    pub(super) change_log: ChangeLog,
}

#[derive(Debug, Clone)]
struct ReceivedGroup {
    state: ReceivedState,
    /// Number of the last change of bulbs or confidence.
    change: u64,
}

impl ReceivedGroups {
    /// Creates an empty set of states for a map with this number of heads.
    pub(super) fn new(heads: usize) -> Self {
        Self {
            groups: BTreeMap::new(),
            predicted: BTreeSet::new(),
            counts: [BulbCounts::default(); 2],
            change_log: ChangeLog::new(heads),
        }
    }

    pub(super) fn state(&self, layer: StoreLayer, relation_id: i64) -> Option<&ReceivedState> {
        self.groups.get(&(layer, relation_id)).map(|group| &group.state)
    }

    /// Returns the states of a layer, ascending by relation id.
    pub(super) fn states(&self, layer: StoreLayer) -> impl Iterator<Item = (i64, &ReceivedState)> {
        let groups = self.groups.range((layer, i64::MIN)..=(layer, i64::MAX));
        groups.map(|((_, relation_id), group)| (*relation_id, &group.state))
    }

    /// Returns the most recently changed bulbs of these groups; `None` if none of them has a state.
    pub(super) fn latest(&self, layer: StoreLayer, relation_ids: &[i64]) -> Option<BulbSet> {
        let groups = relation_ids.iter().filter_map(|id| self.groups.get(&(layer, *id)));
        groups.max_by_key(|group| group.change).map(|group| group.state.bulbs)
    }

    pub(super) fn counts(&self, layer: StoreLayer) -> BulbCounts {
        self.counts[layer as usize]
    }

    /// Replaces the state of a group with these heads; `None` removes it. The predictions must already be
    /// checked.
    pub(super) fn set(&mut self, key: Key, state: Option<ReceivedState>, heads: &[HeadIndex]) {
        let before = self.groups.get(&key);
        if before.map(|group| &group.state) == state.as_ref() {
            return;
        }
        let shown = |state: &ReceivedState| (state.bulbs, state.confidence.to_bits());
        let unchanged = before
            .filter(|group| state.as_ref().map(shown) == Some(shown(&group.state)))
            .map(|group| group.change);
        if let Some(at) = before.and_then(|group| first(&group.state)) {
            self.predicted.remove(&(at, key));
        }
        let [old, new] = [before.map(|group| group.state.bulbs), state.as_ref().map(|state| state.bulbs)];
        self.counts[key.0 as usize].change(old, new);
        for head in heads {
            self.change_log.add(*head);
        }
        match state {
            Some(state) => {
                self.predicted.extend(first(&state).map(|at| (at, key)));
                let change = unchanged.unwrap_or(self.change_log.changes);
                self.groups.insert(key, ReceivedGroup { state, change });
            }
            None => {
                self.groups.remove(&key);
            }
        }
    }

    /// Removes the predictions whose time has come; `heads` returns the heads of a group.
    pub(super) fn drop_past_predictions<'m>(
        &mut self,
        now: WallStamp,
        heads: impl Fn(i64) -> &'m [HeadIndex],
    ) {
        while let Some((at, key)) = self.predicted.first().copied().filter(|(at, _)| *at <= now.as_nanos()) {
            self.predicted.remove(&(at, key));
            if let Some(mut state) = self.groups.get(&key).map(|group| group.state.clone()) {
                state.predictions.retain(|prediction| is_ahead(prediction, now));
                self.set(key, Some(state), heads(key.1));
            }
        }
    }
}

/// Returns the time of the first prediction, nanoseconds since 1970.
fn first(state: &ReceivedState) -> Option<i64> {
    state.predictions.first().map(|prediction| prediction.at.as_nanos())
}

#[cfg(test)]
mod properties;
