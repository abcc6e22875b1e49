//! What there is to see of a scenario at a time.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::core::time::{MonoTime, WallStamp};
use crate::core::traffic_light::emission::{Content, GroupState};
use crate::core::traffic_light::engine::LightObservation;
use crate::core::traffic_light::event_log::Note;
use crate::core::traffic_light::scenario::Scenario;
use crate::core::traffic_light::target::{Channel, Layer, StoreId};

/// One time at which something was due.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// Time since the start of the scenario, which is time zero.
    pub at: MonoTime,
    /// Whether a frame was evaluated.
    pub is_frame: bool,
    /// Whether anything happened or looks different.
    pub has_changed: bool,
    /// What happened, in order.
    pub notes: &'a [Note],
    /// All there is to see afterwards.
    pub states: &'a States,
    /// The scenario, for the names behind positions.
    pub scenario: &'a Scenario,
}

/// The states of all lights, groups and controllers.
#[derive(Debug, Clone, Default)]
pub struct States {
    /// The lights of each store that were touched or detected, by id.
    pub stores: BTreeMap<StoreId, BTreeMap<i64, LightObservation>>,
    /// The groups last sent as what the camera sees; `None` before the first message.
    pub internal: Option<Content>,
    /// The groups last sent over V2I, with predictions; `None` before the first message.
    pub external: Option<Content>,
    /// Position of the phase of each controller; `None` before the first.
    pub phases: Vec<Option<usize>>,
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

impl States {
    /// The lights of a store, ascending by id.
    pub(super) fn store(&self, store: StoreId) -> impl Iterator<Item = (i64, &LightObservation)> {
        self.stores.get(&store).into_iter().flatten().map(|(id, light)| (*id, light))
    }

    pub(super) fn internal(&self) -> Option<&[Arc<GroupState>]> {
        groups(self.internal.as_ref())
    }

    pub(super) fn external(&self) -> Option<&[Arc<GroupState>]> {
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
pub(super) fn time_of(stamp: WallStamp) -> MonoTime {
    u64::try_from(stamp.as_nanos()).map_or(MonoTime::ZERO, MonoTime::from_nanos)
}
