//! Conversions of stamps and headers.

use crate::builtin_interfaces::Time;
use crate::std_msgs::Header;
use gateway_base::time::WallStamp;

impl From<WallStamp> for Time {
    fn from(stamp: WallStamp) -> Self {
        Self { sec: stamp.sec(), nanosec: stamp.nanosec() }
    }
}

impl From<Time> for WallStamp {
    /// A second or more in the nanoseconds is carried over.
    fn from(time: Time) -> Self {
        // 32 bits of seconds in nanoseconds fit in 64 bits, together with any number of nanoseconds.
        Self::from_nanos(i64::from(time.sec) * 1_000_000_000 + i64::from(time.nanosec))
    }
}

impl Time {
    /// Returns the time; `None` if the nanoseconds are a second or more.
    pub fn checked(self) -> Option<WallStamp> {
        (self.nanosec < 1_000_000_000).then(|| self.into())
    }
}

impl Header {
    /// Creates the header of data in `frame_id`, which is empty for diagnostics.
    pub fn new(stamp: WallStamp, frame_id: &str) -> Self {
        Self { stamp: stamp.into(), frame_id: frame_id.to_owned() }
    }
}
