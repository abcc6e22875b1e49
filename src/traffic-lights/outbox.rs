//! Messages waiting to be sent, and the list of each topic, updated with changes.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use super::change_log::ChangeLog;
use super::emission::{Emission, GroupState, Groups, LampMarker, LightState, LightsContent, LightsTopic};
use super::incremental_update::{Item, update};
use super::message_builder;
use super::prediction::Predictions;
use super::store::Stores;
use super::target::LightChannel;
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::HeadIndex;

#[cfg(test)]
mod properties;

/// Maximum number of emissions kept until they are polled; older ones are lost.
const MAX_WAITING: usize = 1_024;

/// The messages to be sent, and the present list of each topic.
#[derive(Debug, Clone)]
pub(super) struct Outbox {
    one_group_per_head: bool,
    waiting: VecDeque<Emission>,
    ground_truth: TopicList<LightState>,
    camera: TopicList<Arc<GroupState>>,
    v2i: TopicList<Arc<GroupState>>,
    markers: [TopicList<LampMarker>; 2],
}

#[derive(Debug, Clone)]
struct TopicList<T> {
    /// The last change of each source that is included in the list.
    changes: [u64; 4],
    list: Arc<Vec<T>>,
}

type Sources<'a> = [Option<&'a ChangeLog>; 4];

impl Outbox {
    /// Creates an outbox without messages. `one_group_per_head`: see
    /// [`LightsSettings`](super::engine::LightsSettings).
    pub(super) fn new(one_group_per_head: bool) -> Self {
        Self {
            one_group_per_head,
            waiting: VecDeque::new(),
            ground_truth: TopicList::default(),
            camera: TopicList::default(),
            v2i: TopicList::default(),
            markers: [TopicList::default(), TopicList::default()],
        }
    }

    /// Rebuilds the lists if their form changes; waiting messages are still sent.
    pub(super) fn reconfigure(&mut self, one_group_per_head: bool) {
        if self.one_group_per_head != one_group_per_head {
            *self = Self { waiting: std::mem::take(&mut self.waiting), ..Self::new(one_group_per_head) };
        }
    }

    pub(super) fn poll(&mut self) -> Option<Emission> {
        self.waiting.pop_front()
    }

    pub(super) fn send_ground_truth(&mut self, stores: &Stores, stamp: WallStamp) {
        let channel = LightChannel::Conventional;
        let sources = [Some(&stores.truth(channel).change_log), None, None, None];
        let make = |heads: &_| message_builder::lights(stores, channel, heads);
        let lights = self.ground_truth.update(sources, !stores.quirks.cuts_ids, make);
        self.send(LightsTopic::GroundTruth, stamp, LightsContent::Lights(lights));
    }

    pub(super) fn send_camera(&mut self, stores: &Stores, stamp: WallStamp) {
        let groups = self.camera.groups(stores, LightChannel::Conventional, None, self.one_group_per_head);
        self.send(LightsTopic::Camera, stamp, LightsContent::Groups(groups));
    }

    pub(super) fn send_v2i(&mut self, stores: &Stores, predictions: &Predictions, stamp: WallStamp) {
        let groups = self.v2i.groups(stores, LightChannel::V2i, Some(predictions), self.one_group_per_head);
        self.send(LightsTopic::V2i, stamp, LightsContent::Groups(groups));
    }

    /// Upstream draws each channel with its own timer, over the markers of the other channel; improved mode
    /// draws both with the timer of the conventional channel (Q19).
    pub(super) fn send_markers(&mut self, stores: &Stores, timer: LightChannel, stamp: WallStamp) {
        let channels = match (timer, stores.quirks.draws_each_channel) {
            (LightChannel::Conventional, false) => &LightChannel::ALL[..],
            (LightChannel::V2i, false) => return,
            (LightChannel::Conventional | LightChannel::V2i, true) => std::slice::from_ref(&timer),
        };
        let source = |channel| channels.contains(&channel).then(|| &stores.truth(channel).change_log);
        let received = channels.contains(&LightChannel::V2i).then_some(&stores.received.change_log);
        let sources = [source(LightChannel::Conventional), source(LightChannel::V2i), None, received];
        let make = |heads: &_| message_builder::markers(stores, channels, heads);
        let markers = self.markers[timer as usize].update(sources, !stores.quirks.cuts_ids, make);
        self.send(LightsTopic::Markers, stamp, LightsContent::Markers(markers));
    }

    pub(super) fn send(&mut self, topic: LightsTopic, stamp: WallStamp, content: LightsContent) {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Emission { topic, stamp, content });
    }
}

impl TopicList<Arc<GroupState>> {
    fn groups(
        &mut self,
        stores: &Stores,
        channel: LightChannel,
        predictions: Option<&Predictions>,
        one_group_per_head: bool,
    ) -> Groups {
        let sources = [
            Some(&stores.truth(channel).change_log),
            Some(&stores.detected(channel).change_log),
            predictions.map(|predictions| &predictions.change_log),
            (channel == LightChannel::V2i).then_some(&stores.received.change_log),
        ];
        let is_merged = !one_group_per_head && !stores.quirks.one_group_per_head;
        self.update(sources, is_merged, |heads| {
            if is_merged {
                message_builder::groups(stores, channel, predictions, heads)
            } else {
                vec![(0, message_builder::groups_by_head(stores, channel, predictions))]
            }
        })
    }
}

impl<T: Item> TopicList<T> {
    /// Updates the list. `make` builds the items of heads, by ascending id: of the changed heads, or of all
    /// heads if items are not sorted by their ids.
    fn update(
        &mut self,
        sources: Sources<'_>,
        is_sorted: bool,
        make: impl FnOnce(&BTreeSet<HeadIndex>) -> Vec<(i64, Vec<T>)>,
    ) -> Arc<Vec<T>> {
        let changes = sources.map(|source| source.map_or(0, |log| log.changes));
        let before = std::mem::replace(&mut self.changes, changes);
        if before != changes {
            let since = sources.into_iter().zip(if is_sorted { before } else { [0; 4] });
            let changed = since.filter_map(|(source, change)| Some(source?.since(change)));
            let made = make(&changed.flatten().collect());
            if is_sorted {
                update(&mut self.list, made);
            } else {
                let list: Vec<T> = made.into_iter().flat_map(|(_, items)| items).collect();
                // A change that was undone leaves the list unchanged.
                if *self.list != list {
                    self.list = Arc::new(list);
                }
            }
        }
        Arc::clone(&self.list)
    }
}

impl<T> Default for TopicList<T> {
    fn default() -> Self {
        Self { changes: [0; 4], list: Arc::default() }
    }
}
