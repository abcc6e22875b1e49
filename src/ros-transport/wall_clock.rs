//! The wall-clock time, for stamps of the network side's own messages.

use std::time::SystemTime;

use gateway_base::time::WallStamp;

/// Returns the present time; 1970 if the clock is set before that.
pub(crate) fn now() -> WallStamp {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    WallStamp::default().after(since)
}
