//! The last inputs of both sides, by group. Storing a message also determines the changed groups.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use super::settings::ArbiterStamp;
use crate::emission::GroupState;

/// The groups of the camera's last message, ascending by relation id, then in the order of the message.
#[derive(Debug, Clone, Default)]
pub(super) struct Perceived(Vec<Arc<GroupState>>);

/// The last report of the network for each group.
#[derive(Debug, Clone, Default)]
pub(super) struct Network {
    /// The groups, ascending by relation id, once each.
    latest: Vec<LatestGroup>,
    /// The oldest and the newest stamp; `None` without groups.
    stamps: Option<(ArbiterStamp, ArbiterStamp)>,
}

#[derive(Debug, Clone)]
struct LatestGroup {
    stamp: ArbiterStamp,
    group: Arc<GroupState>,
}

impl Perceived {
    /// Replaces the last message. Adds the ids of groups that may differ to `changed`.
    pub(super) fn take(&mut self, groups: &[Arc<GroupState>], changed: &mut BTreeSet<i64>) {
        let is_in_place =
            |(kept, new): (&Arc<_>, &Arc<_>)| Arc::ptr_eq(kept, new) || id_of(kept) == id_of(new);
        if self.0.len() == groups.len() && self.0.iter().zip(groups).all(is_in_place) {
            for (kept, new) in self.0.iter_mut().zip(groups) {
                if !Arc::ptr_eq(kept, new) {
                    changed.insert(id_of(new));
                    *kept = Arc::clone(new);
                }
            }
        } else {
            let mut groups = groups.to_vec();
            groups.sort_by_key(id_of);
            differing(&self.0, &groups, changed);
            self.0 = groups;
        }
    }

    pub(super) fn of(&self, relation_id: i64) -> &[Arc<GroupState>] {
        let first = self.0.partition_point(|group| id_of(group) < relation_id);
        let from_there = self.0.get(first..).unwrap_or_default();
        from_there.split_at(count_of(from_there, relation_id)).0
    }

    pub(super) fn ids(&self) -> impl Iterator<Item = i64> + '_ {
        self.0.iter().map(id_of)
    }
}

impl Network {
    /// Replaces the last report of each group of a message. Adds the ids of groups that may differ to
    /// `changed`.
    pub(super) fn take(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
        changed: &mut BTreeSet<i64>,
    ) {
        let mut added = BTreeMap::new();
        for (position, group) in groups.iter().enumerate() {
            // The same groups usually arrive in the same order.
            if let Some(latest) =
                self.latest.get_mut(position).filter(|latest| Arc::ptr_eq(&latest.group, group))
            {
                latest.stamp = stamp;
                continue;
            }
            changed.insert(id_of(group));
            let latest = LatestGroup { stamp, group: Arc::clone(group) };
            match self.find(id_of(group)).and_then(|index| self.latest.get_mut(index)) {
                Some(before) => *before = latest,
                None => drop(added.insert(id_of(group), latest)),
            }
        }
        if !added.is_empty() {
            self.latest.extend(added.into_values());
            self.latest.sort_by_key(|latest| id_of(&latest.group));
        }
        self.update_stamps();
    }

    /// Removes groups with a stamp too far from the reference. Adds their ids to `changed`.
    pub(super) fn forget(
        &mut self,
        reference: ArbiterStamp,
        tolerance: Duration,
        changed: &mut BTreeSet<i64>,
    ) {
        let is_near = |stamp: ArbiterStamp| reference.distance(stamp) <= tolerance;
        // A stamp between two near stamps is near.
        if self.stamps.is_none_or(|(oldest, newest)| is_near(oldest) && is_near(newest)) {
            return;
        }
        changed.extend(
            self.latest.iter().filter(|latest| !is_near(latest.stamp)).map(|latest| id_of(&latest.group)),
        );
        self.latest.retain(|latest| is_near(latest.stamp));
        self.update_stamps();
    }

    pub(super) fn newest(&self) -> Option<ArbiterStamp> {
        self.stamps.map(|(_, newest)| newest)
    }

    pub(super) fn of(&self, relation_id: i64) -> Option<&GroupState> {
        Some(&self.latest.get(self.find(relation_id)?)?.group)
    }

    fn find(&self, relation_id: i64) -> Option<usize> {
        self.latest.binary_search_by_key(&relation_id, |latest| id_of(&latest.group)).ok()
    }

    fn update_stamps(&mut self) {
        let stamps = || self.latest.iter().map(|latest| latest.stamp);
        self.stamps = stamps().min().zip(stamps().max());
    }
}

fn id_of(group: &Arc<GroupState>) -> i64 {
    group.relation_id
}

/// Returns the number of groups at the start that have this id.
fn count_of(groups: &[Arc<GroupState>], relation_id: i64) -> usize {
    groups.iter().take_while(|group| id_of(group) == relation_id).count()
}

/// Adds the ids for which two lists, ascending by id, do not share the same groups.
fn differing(mut before: &[Arc<GroupState>], mut now: &[Arc<GroupState>], ids: &mut BTreeSet<i64>) {
    loop {
        match (before, now) {
            ([old, old_rest @ ..], [new, new_rest @ ..]) if Arc::ptr_eq(old, new) => {
                (before, now) = (old_rest, new_rest);
            }
            _ => {
                let Some(id) = before.first().into_iter().chain(now.first()).map(id_of).min() else { return };
                ids.insert(id);
                before = before.split_at(count_of(before, id)).1;
                now = now.split_at(count_of(now, id)).1;
            }
        }
    }
}
