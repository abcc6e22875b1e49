//! The time of the wall clock, for the stamps of what the network side itself tells.

use std::time::SystemTime;

use gateway_base::time::WallStamp;

/// Returns the present time; 1970 for a clock that is set before it.
pub(crate) fn now() -> WallStamp {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    WallStamp::default().after(since)
}
