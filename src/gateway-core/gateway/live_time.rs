//! Places live inputs on the time line that their recording would have.
//!
//! A replay knows only the stamp of a frame. To make a drive and its recording lead to the same decisions,
//! live frames are also placed by their kernel stamps, to the microsecond as in a log, and deadlines wait
//! briefly for frames that were received before them but not yet read.

use std::time::Duration;

use gateway_base::time::{MonoTime, Now, WallStamp};

/// Time for which a deadline waits for frames received before it; batches are 5 ms apart.
pub const LAG: Duration = Duration::from_millis(20);

/// Change of the difference between stamps and the monotonic clock above which it counts as a step of the
/// wall clock, ns.
const STEP: i64 = 1_000_000;

/// Converts stamps of live inputs to times.
#[derive(Debug, Clone)]
pub struct LiveTime {
    /// Monotonic minus wall time, ns; a multiple of a microsecond.
    offset: i64,
    /// No input is placed before this time.
    reached: MonoTime,
}

impl LiveTime {
    /// Creates a time line that begins at `now`.
    pub fn starting_at(now: Now) -> Self {
        Self { offset: offset(now), reached: whole_micros(now.mono) }
    }

    /// Returns when an input with this stamp happened, in whole microseconds: not before inputs and deadlines
    /// already placed, and not after it was read at `read`.
    pub fn arrival(&mut self, stamp: WallStamp, read: Now) -> Now {
        if offset(read).saturating_sub(self.offset).saturating_abs() > STEP {
            self.offset = offset(read);
        }
        let placed = stamp.as_nanos().saturating_add(self.offset);
        let placed = MonoTime::from_nanos(u64::try_from(placed).unwrap_or(0));
        // After a handled deadline, rounded up to the next microsecond: when read from a log, the input must
        // not precede that deadline.
        self.reached = next_whole_micros(whole_micros(placed.min(read.mono)).max(self.reached));
        self.now(self.reached)
    }

    /// Returns the time of a deadline that is handled now.
    pub fn deadline(&mut self, at: MonoTime) -> Now {
        self.reached = self.reached.max(at);
        self.now(at)
    }

    /// Returns a monotonic time with its wall time.
    pub fn now(&self, mono: MonoTime) -> Now {
        let nanos = i64::try_from(mono.as_nanos()).unwrap_or(i64::MAX);
        Now { mono, wall: WallStamp::from_nanos(nanos.saturating_sub(self.offset)) }
    }
}

fn offset(now: Now) -> i64 {
    let mono = i64::try_from(now.mono.as_nanos()).unwrap_or(i64::MAX);
    mono.saturating_sub(now.wall.as_nanos()).div_euclid(1000).saturating_mul(1000)
}

fn whole_micros(at: MonoTime) -> MonoTime {
    MonoTime::from_nanos(at.as_nanos() / 1000 * 1000)
}

fn next_whole_micros(at: MonoTime) -> MonoTime {
    MonoTime::from_nanos(at.as_nanos().div_ceil(1000).saturating_mul(1000))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: i64 = 1_700_000_000_000_000_000;

    fn at(micros: u64) -> Now {
        Now {
            mono: MonoTime::from_nanos(micros * 1000 + 7),
            wall: WallStamp::from_nanos(WALL + i64::try_from(micros).unwrap() * 1000 + 7),
        }
    }

    fn arrival(live: &mut LiveTime, stamp_micros: u64, read_micros: u64) -> u64 {
        live.arrival(at(stamp_micros).wall, at(read_micros)).mono.as_nanos()
    }

    #[test]
    fn frames_are_placed_when_they_were_received_whenever_they_were_read() {
        let mut live = LiveTime::starting_at(at(0));
        assert_eq!(arrival(&mut live, 1_000, 4_000), 1_000_000);
        let second = live.arrival(at(1_250).wall, at(4_000));
        assert_eq!((second.mono.as_nanos(), second.wall.as_nanos()), (1_250_000, WALL + 1_250_000));
        assert_eq!(live.deadline(MonoTime::from_nanos(1_300_001)).mono.as_nanos(), 1_300_001);
        assert_eq!(arrival(&mut live, 1_290, 4_100), 1_301_000, "what was handled stays handled");
        assert_eq!(arrival(&mut live, 9_000, 5_000), 5_000_000, "nothing comes from the future");
    }

    #[test]
    fn a_step_of_the_wall_clock_does_not_make_frames_old_or_new() {
        let mut live = LiveTime::starting_at(at(0));
        let stepped = |micros: u64| {
            let now = at(micros);
            Now { wall: WallStamp::from_nanos(now.wall.as_nanos() + 3_600_000_000_000), ..now }
        };
        let placed = live.arrival(stepped(2_000).wall, stepped(5_000));
        assert_eq!(placed.mono.as_nanos(), 2_000_000);
        assert_eq!(arrival(&mut live, 6_000, 7_000), 6_000_000, "and back");
    }
}
