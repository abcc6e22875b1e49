//! Copies ground truth of the conventional channel to V2I (docs/spec/traffic-lights.md, "Copying to V2I").

use std::collections::BTreeSet;

use super::refusal::ActionRefusal;
use super::store::{LightChange, Stores, heads_of};
use super::target::{LightChannel, SignalTarget, StoreId};
use lanelet2_map::light_map::HeadIndex;

/// The stores, with the set of copied heads. All writes pass through here, except in comparisons.
#[derive(Debug, Clone)]
pub(super) struct SyncedStores {
    /// Written directly only by operations that are never copied: comparisons, in which upstream creates
    /// lights, and received states.
    pub(super) stores: Stores,
    enabled: Vec<bool>,
}

impl SyncedStores {
    pub(super) fn new(stores: Stores) -> Self {
        let enabled = vec![false; stores.map.heads().len()];
        Self { stores, enabled }
    }

    pub(super) fn is_enabled(&self, head: HeadIndex) -> bool {
        self.enabled.get(head.0 as usize).is_some_and(|enabled| *enabled)
    }

    /// Writes to a store, and to V2I if copied: in improved mode head by head, in upstream mode if the id
    /// itself names an enabled head (Q2). Confidence is never copied. Returns whether anything changed.
    pub(super) fn write(&mut self, target: SignalTarget, change: LightChange) -> Result<bool, ActionRefusal> {
        let changed = self.stores.write(target, change)?;
        if target.store == StoreId::CONVENTIONAL && !matches!(change, LightChange::Confidence(_)) {
            let map = self.stores.map.clone();
            if !self.stores.quirks.copies_by_written_id {
                for head in heads_of(&map, target.id)? {
                    if self.is_enabled(head) {
                        self.stores.write_head(LightChannel::V2i, head, change);
                    }
                }
            } else if map.head(target.id).is_some_and(|head| self.is_enabled(head)) {
                self.stores.write(SignalTarget { id: target.id, store: StoreId::V2I }, change)?;
            }
        }
        Ok(changed)
    }

    /// Starts or stops copying. Returns the heads for which this is a change. Improved mode refuses an
    /// unknown id without any change, upstream ignores it (Q14).
    pub(super) fn enable(&mut self, ids: &[i64], enable: bool) -> Result<BTreeSet<HeadIndex>, ActionRefusal> {
        let mut heads = BTreeSet::new();
        for id in ids {
            match heads_of(&self.stores.map, *id) {
                Ok(of_id) => heads.extend(of_id),
                Err(_) if self.stores.quirks.ignores_unknown_ids => {}
                Err(refusal) => return Err(refusal),
            }
        }
        heads.retain(|head| {
            self.enabled
                .get_mut(head.0 as usize)
                .is_some_and(|enabled| std::mem::replace(enabled, enable) != enable)
        });
        Ok(heads)
    }

    /// Copies the present state of a head, unless the head was never touched.
    pub(super) fn copy_now(&mut self, head: HeadIndex) {
        let bulbs = self.stores.truth(LightChannel::Conventional).light(head).and_then(|light| light.bulbs);
        if let Some(bulbs) = bulbs {
            self.stores.write_head(LightChannel::V2i, head, LightChange::Set(bulbs));
        }
    }
}
