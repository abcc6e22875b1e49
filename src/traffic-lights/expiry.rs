//! Expiry of V2I states: a state that is no longer received is removed.

use std::collections::{BTreeMap, BTreeSet};

use super::target::StoreLayer;

/// A V2I light or group by its layer and its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    /// A light, by the id of its entry.
    Light(StoreLayer, i64),
    /// A group with a received state, by its relation id.
    Group(StoreLayer, i64),
}

#[derive(Debug, Clone, Default)]
pub(super) struct Expiry {
    watched: BTreeMap<Key, Watch>,
    order: BTreeSet<(u64, Key)>,
    expired: BTreeSet<Key>,
}

#[derive(Debug, Clone, Copy)]
struct Watch {
    /// Time of expiry, nanoseconds since the start of the scenario.
    at: u64,
    /// Number of the write that must still be the last one at that time.
    written: u64,
}

impl Expiry {
    /// Records that a light or group was received, with the number of that write. It expires at `at`,
    /// nanoseconds since the start of the scenario; never if `None`.
    pub(super) fn renew(&mut self, key: Key, written: u64, at: Option<u64>) {
        self.expired.remove(&key);
        if let Some(watch) = self.watched.remove(&key) {
            self.order.remove(&(watch.at, key));
        }
        if let Some(at) = at {
            self.watched.insert(key, Watch { at, written });
            self.order.insert((at, key));
        }
    }

    /// Returns the time of the next expiry, nanoseconds since the start of the scenario.
    pub(super) fn next(&self) -> Option<u64> {
        self.order.first().map(|(at, _)| *at)
    }

    /// Removes and returns the light that expires next, with the number of the write by which it was
    /// received.
    pub(super) fn take(&mut self) -> Option<(Key, u64)> {
        let (_, key) = self.order.pop_first()?;
        let watch = self.watched.remove(&key)?;
        self.expired.insert(key);
        Some((key, watch.written))
    }

    /// Returns the number of expired lights that were not received again.
    pub(super) fn expired(&self) -> usize {
        self.expired.len()
    }
}
