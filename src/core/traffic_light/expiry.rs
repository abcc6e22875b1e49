//! Lights that a network has to renew: a state that is no longer received expires.

use std::collections::{BTreeMap, BTreeSet};

use super::target::Layer;

/// A light of V2I by the id it is kept under.
pub(super) type Key = (Layer, i64);

/// When each light that came from outside is too old.
#[derive(Debug, Clone, Default)]
pub(super) struct Expiry {
    watched: BTreeMap<Key, Watch>,
    order: BTreeSet<(u64, Key)>,
    expired: BTreeSet<Key>,
}

#[derive(Debug, Clone, Copy)]
struct Watch {
    at: u64,
    written: u64,
}

impl Expiry {
    /// The light was renewed by that write and is good until `at`, nanoseconds.
    pub(super) fn watch(&mut self, key: Key, written: u64, at: u64) {
        self.forget(key);
        self.watched.insert(key, Watch { at, written });
        self.order.insert((at, key));
    }

    /// The light is not a concern any more.
    pub(super) fn forget(&mut self, key: Key) {
        self.expired.remove(&key);
        if let Some(watch) = self.watched.remove(&key) {
            self.order.remove(&(watch.at, key));
        }
    }

    /// When the next one is too old.
    pub(super) fn next(&self) -> Option<u64> {
        self.order.first().map(|(at, _)| *at)
    }

    /// Takes the next one, with the number of the write that renewed it.
    pub(super) fn take(&mut self) -> Option<(Key, u64)> {
        let (_, key) = self.order.pop_first()?;
        let watch = self.watched.remove(&key)?;
        self.expired.insert(key);
        Some((key, watch.written))
    }

    /// How many are too old and were not renewed since.
    pub(super) fn expired(&self) -> usize {
        self.expired.len()
    }
}
