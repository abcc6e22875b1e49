//! The only reader of clocks in the live daemon.

use std::time::{Instant, SystemTime};

use crate::core::time::{MonoTime, Now, WallStamp};

/// Monotonic and wall time of this process.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    origin: Instant,
}

impl Clock {
    /// A clock whose monotonic time begins now.
    pub fn start() -> Self {
        Self { origin: Instant::now() }
    }

    /// The present time.
    pub fn now(&self) -> Now {
        let mono = u64::try_from(self.origin.elapsed().as_nanos()).unwrap_or(u64::MAX);
        let wall = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let wall = i64::try_from(wall.as_nanos()).unwrap_or(i64::MAX);
        Now { mono: MonoTime::from_nanos(mono), wall: WallStamp::from_nanos(wall) }
    }

    /// The instant of a monotonic time, to sleep until.
    pub fn instant(&self, at: MonoTime) -> Instant {
        self.origin + at.since(MonoTime::ZERO)
    }
}
