//! Live inputs on the time line that a recording of them would have.
//!
//! A replay knows a frame only by its stamp. So that a drive and its recording decide alike, live
//! frames are placed by their kernel stamps as well, to the microsecond that a log keeps, and
//! deadlines wait a little for frames that were received before them but not yet read.

use std::time::Duration;

use super::time::{MonoTime, Now, WallStamp};

/// How long a deadline waits for frames that were received before it: batches are 5 ms apart.
pub const LAG: Duration = Duration::from_millis(20);

/// A difference between stamps and the monotonic clock that changes by more than this is a step
/// of the wall clock.
const STEP: i64 = 1_000_000;

/// Places live inputs in time.
#[derive(Debug, Clone)]
pub struct LiveTime {
    /// Monotonic minus wall time, ns; whole microseconds.
    offset: i64,
    last: Now,
    /// Steps of the wall clock since start.
    pub steps: u64,
}

impl LiveTime {
    /// Begins at `now`.
    pub fn starting_at(now: Now) -> Self {
        let last = Now { mono: whole_micros(now.mono), wall: now.wall };
        Self { offset: offset(now), last, steps: 0 }
    }

    /// The time up to which everything has been handled.
    pub fn last(&self) -> Now {
        self.last
    }

    /// When an input with this stamp, read at `read`, happened: not before what was already
    /// handled, not after it was read.
    pub fn arrival(&mut self, stamp: WallStamp, read: Now) -> Now {
        if (offset(read) - self.offset).abs() > STEP {
            self.offset = offset(read);
            self.steps += 1;
        }
        let placed = stamp.as_nanos().saturating_add(self.offset);
        let placed = whole_micros(MonoTime::from_nanos(u64::try_from(placed).unwrap_or(0)));
        let mono = placed.min(read.mono).max(self.last.mono);
        self.last = Now { mono, wall: self.wall_at(mono) };
        self.last
    }

    /// The time of a deadline.
    pub fn deadline(&mut self, at: MonoTime) -> Now {
        let mono = at.max(self.last.mono);
        self.last = Now { mono, wall: self.wall_at(mono) };
        self.last
    }

    /// Whether a deadline need not wait any longer at `read`.
    pub fn is_due(deadline: MonoTime, read: MonoTime) -> bool {
        deadline.after(LAG) <= read
    }

    fn wall_at(&self, mono: MonoTime) -> WallStamp {
        let mono = i64::try_from(mono.as_nanos()).unwrap_or(i64::MAX);
        WallStamp::from_nanos(mono.saturating_sub(self.offset))
    }
}

fn offset(now: Now) -> i64 {
    let mono = i64::try_from(now.mono.as_nanos()).unwrap_or(i64::MAX);
    mono.saturating_sub(now.wall.as_nanos()).div_euclid(1000).saturating_mul(1000)
}

fn whole_micros(at: MonoTime) -> MonoTime {
    MonoTime::from_nanos(at.as_nanos() / 1000 * 1000)
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
        assert_eq!(arrival(&mut live, 1_250, 4_000), 1_250_000);
        assert_eq!(live.last().wall, WallStamp::from_nanos(WALL + 1_250_000));
        assert_eq!(live.deadline(MonoTime::from_nanos(1_300_001)).mono.as_nanos(), 1_300_001);
        assert_eq!(arrival(&mut live, 1_290, 4_100), 1_300_001, "what was handled stays handled");
        assert_eq!(arrival(&mut live, 9_000, 5_000), 5_000_007, "nothing comes from the future");
    }

    #[test]
    fn a_step_of_the_wall_clock_does_not_make_frames_old_or_new() {
        let mut live = LiveTime::starting_at(at(0));
        let stepped = |micros: u64| {
            let now = at(micros);
            Now { wall: WallStamp::from_nanos(now.wall.as_nanos() + 3_600_000_000_000), ..now }
        };
        let placed = live.arrival(stepped(2_000).wall, stepped(5_000));
        assert_eq!((placed.mono.as_nanos(), live.steps), (2_000_000, 1));
        assert_eq!(arrival(&mut live, 6_000, 7_000), 6_000_000, "and back");
        assert_eq!(live.steps, 2);
    }

    #[test]
    fn deadlines_wait_for_frames_on_their_way() {
        let deadline = MonoTime::from_millis(100);
        assert!(!LiveTime::is_due(deadline, MonoTime::from_millis(119)));
        assert!(LiveTime::is_due(deadline, MonoTime::from_millis(120)));
    }
}
