//! Messages waiting to be sent, and the last content of each topic, sent again while nothing changes.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use super::change_log::ChangeLog;
use super::emission::{Content, Emission, LightsTopic};
use super::incremental_update::renew;
use super::message_builder;
use super::prediction::Predictions;
use super::store::Stores;
use super::target::Channel;
use crate::core::compat::Compat;
use crate::core::map::light_map::HeadIndex;
use crate::core::time::WallStamp;

#[cfg(test)]
mod properties;

/// Emissions kept until they are asked for; older ones are lost.
const MAX_WAITING: usize = 1_024;

/// What is going out.
#[derive(Debug, Clone)]
pub(super) struct Outbox {
    one_group_per_head: bool,
    waiting: VecDeque<Emission>,
    ground_truth: Last,
    camera: Last,
    v2i: Last,
    markers: [Last; 2],
}

/// The last content of a topic, and how many changes of each of its sources it shows.
#[derive(Debug, Clone, Default)]
struct Last(Option<([u64; 3], Arc<Content>)>);

/// What a content is made of.
type Sources<'a> = [Option<&'a ChangeLog>; 3];

impl Outbox {
    pub(super) fn new(one_group_per_head: bool) -> Self {
        Self {
            one_group_per_head,
            waiting: VecDeque::new(),
            ground_truth: Last::default(),
            camera: Last::default(),
            v2i: Last::default(),
            markers: [Last::default(), Last::default()],
        }
    }

    pub(super) fn poll(&mut self) -> Option<Emission> {
        self.waiting.pop_front()
    }

    pub(super) fn send_ground_truth(&mut self, stores: &Stores, stamp: WallStamp) {
        let channel = Channel::Conventional;
        let sources = [Some(stores.truth(channel).change_log()), None, None];
        let content = self.ground_truth.content(
            sources,
            || Content::Lights(message_builder::lights(stores, channel)),
            (stores.compat() == Compat::Improved).then_some(|content: &mut _, heads: &_| {
                renew(content, message_builder::lights_of(stores, channel, heads));
            }),
        );
        self.send(LightsTopic::GroundTruth, stamp, content);
    }

    pub(super) fn send_camera(&mut self, stores: &Stores, stamp: WallStamp) {
        let content = self.camera.groups(stores, Channel::Conventional, None, self.one_group_per_head);
        self.send(LightsTopic::Camera, stamp, content);
    }

    pub(super) fn send_v2i(&mut self, stores: &Stores, predictions: &Predictions, stamp: WallStamp) {
        let content = self.v2i.groups(stores, Channel::V2i, Some(predictions), self.one_group_per_head);
        self.send(LightsTopic::V2i, stamp, content);
    }

    /// Upstream draws each channel with its own timer, over what the other drew; ours draws once, with
    /// that of the conventional channel (Q19).
    pub(super) fn send_markers(&mut self, stores: &Stores, timer: Channel, stamp: WallStamp) {
        let [conventional, v2i] = &mut self.markers;
        let (last, channels) = match (stores.compat(), timer) {
            (Compat::Improved, Channel::Conventional) => (conventional, &Channel::ALL[..]),
            (Compat::Improved, Channel::V2i) => return,
            (Compat::Upstream, Channel::Conventional) => (conventional, &[Channel::Conventional][..]),
            (Compat::Upstream, Channel::V2i) => (v2i, &[Channel::V2i][..]),
        };
        let source = |channel| channels.contains(&channel).then(|| stores.truth(channel).change_log());
        let content = last.content(
            [source(Channel::Conventional), source(Channel::V2i), None],
            || Content::Markers(message_builder::markers(stores, channels)),
            (stores.compat() == Compat::Improved).then_some(|content: &mut _, heads: &_| {
                renew(content, message_builder::markers_of(stores, channels, heads));
            }),
        );
        self.send(LightsTopic::Markers, stamp, content);
    }

    fn send(&mut self, topic: LightsTopic, stamp: WallStamp, content: Arc<Content>) {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Emission { topic, stamp, content });
    }
}

impl Last {
    fn groups(
        &mut self,
        stores: &Stores,
        channel: Channel,
        predictions: Option<&Predictions>,
        one_group_per_head: bool,
    ) -> Arc<Content> {
        let sources = [
            Some(stores.truth(channel).change_log()),
            Some(stores.detected(channel).change_log()),
            predictions.map(Predictions::change_log),
        ];
        let is_merged = stores.compat() == Compat::Improved && !one_group_per_head;
        self.content(
            sources,
            || Content::Groups(message_builder::groups(stores, channel, predictions, one_group_per_head)),
            is_merged.then_some(|content: &mut _, heads: &_| {
                renew(content, message_builder::groups_of(stores, channel, predictions, heads));
            }),
        )
    }

    /// What the sources come to. `make` makes it of all heads, `renew` of those that changed, if it can.
    fn content(
        &mut self,
        sources: Sources<'_>,
        make: impl FnOnce() -> Content,
        renew: Option<impl FnOnce(&mut Arc<Content>, &BTreeSet<HeadIndex>)>,
    ) -> Arc<Content> {
        let changes = sources.map(|source| source.map_or(0, ChangeLog::changes));
        let Some((shown, content)) = &mut self.0 else {
            let content = Arc::new(make());
            self.0 = Some((changes, Arc::clone(&content)));
            return content;
        };
        let before = std::mem::replace(shown, changes);
        if before != changes {
            match renew.zip(changed(sources, before)) {
                Some((renew, heads)) => renew(content, &heads),
                None => {
                    let made = make();
                    // Changed and changed back: still the same content.
                    if **content != made {
                        *content = Arc::new(made);
                    }
                }
            }
        }
        Arc::clone(content)
    }
}

/// The heads that changed in any of the sources since; none when they are too many to be known.
fn changed(sources: Sources<'_>, before: [u64; 3]) -> Option<BTreeSet<HeadIndex>> {
    let mut heads = BTreeSet::new();
    for (source, before) in sources.into_iter().zip(before) {
        if let Some(change_log) = source {
            heads.extend(change_log.since(before)?);
        }
    }
    Some(heads)
}
