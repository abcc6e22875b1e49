//! Access to data that Zenoh's threads change.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks the data. A panic cannot leave any data in this room half changed.
pub(super) fn locked<T>(data: &Mutex<T>) -> MutexGuard<'_, T> {
    data.lock().unwrap_or_else(PoisonError::into_inner)
}
