//! Times of tests: a monotonic clock from zero, and a wall clock that runs beside it.

use gateway_base::time::{MonoTime, Now, WallStamp};

/// Nanoseconds in a millisecond.
pub(crate) const MS: u64 = 1_000_000;

/// The wall clock when the monotonic one shows zero, nanoseconds since 1970. It is not zero, so that a test
/// notices where one is taken for the other.
pub(crate) const EPOCH_NS: i64 = 1_700_000_000_000_000_000;

pub(crate) fn at(mono: MonoTime) -> Now {
    Now { mono, wall: WallStamp::from_nanos(EPOCH_NS + i64::try_from(mono.as_nanos()).unwrap()) }
}

pub(crate) fn at_ns(nanos: u64) -> Now {
    at(MonoTime::from_nanos(nanos))
}

pub(crate) fn at_ms(millis: u64) -> Now {
    at(MonoTime::from_millis(millis))
}

/// Whole milliseconds since the origin.
pub(crate) fn millis(mono: MonoTime) -> u64 {
    mono.as_nanos() / MS
}
