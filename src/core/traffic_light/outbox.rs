//! Messages waiting to be sent, and the last content of each topic, sent again while nothing changes.

use std::collections::VecDeque;
use std::sync::Arc;

use super::compat::Compat;
use super::emission::{Content, Emission, LightsTopic};
use super::merge;
use super::prediction::Predictions;
use super::store::Stores;
use super::target::Channel;
use crate::core::time::WallStamp;

/// Emissions kept until they are asked for; older ones are lost.
const MOST_WAITING: usize = 1_024;

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

/// The last content of a topic, and which state of its sources it shows.
#[derive(Debug, Clone, Default)]
struct Last(Option<([u64; 3], Arc<Content>)>);

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
        let sources = [stores.truth(Channel::Conventional).changes(), 0, 0];
        let make = || Content::Lights(merge::lights(stores, Channel::Conventional));
        let content = self.ground_truth.content(sources, make);
        self.send(LightsTopic::GroundTruth, stamp, content);
    }

    pub(super) fn send_camera(&mut self, stores: &Stores, stamp: WallStamp) {
        let channel = Channel::Conventional;
        let sources = [stores.truth(channel).changes(), stores.detected(channel).changes(), 0];
        let make = || Content::Groups(merge::groups(stores, channel, None, self.one_group_per_head));
        let content = self.camera.content(sources, make);
        self.send(LightsTopic::Camera, stamp, content);
    }

    pub(super) fn send_v2i(&mut self, stores: &Stores, predictions: &Predictions, stamp: WallStamp) {
        let channel = Channel::V2i;
        let sources =
            [stores.truth(channel).changes(), stores.detected(channel).changes(), predictions.changes()];
        let make =
            || Content::Groups(merge::groups(stores, channel, Some(predictions), self.one_group_per_head));
        let content = self.v2i.content(sources, make);
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
        let changes = |channel| if channels.contains(&channel) { stores.truth(channel).changes() } else { 0 };
        let sources = [changes(Channel::Conventional), changes(Channel::V2i), 0];
        let content = last.content(sources, || Content::Markers(merge::markers(stores, channels)));
        self.send(LightsTopic::Markers, stamp, content);
    }

    fn send(&mut self, topic: LightsTopic, stamp: WallStamp, content: Arc<Content>) {
        if self.waiting.len() >= MOST_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Emission { topic, stamp, content });
    }
}

impl Last {
    fn content(&mut self, sources: [u64; 3], make: impl FnOnce() -> Content) -> Arc<Content> {
        match &mut self.0 {
            Some((known, content)) if *known == sources => Arc::clone(content),
            Some((known, content)) => {
                *known = sources;
                let made = make();
                // Changed and changed back: still the same content.
                if **content != made {
                    *content = Arc::new(made);
                }
                Arc::clone(content)
            }
            none => {
                let content = Arc::new(make());
                *none = Some((sources, Arc::clone(&content)));
                content
            }
        }
    }
}
