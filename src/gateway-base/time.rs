//! Monotonic time and wall-clock stamps as distinct types.
//!
//! [`MonoTime`] decides ages and timeouts. [`WallStamp`] is copied from the kernel or the recording
//! into message stamps and is never compared. [`Now`] is an argument of every call.

use std::time::Duration;

pub mod gap_filling;
pub mod timer_table;

/// Monotonic time in nanoseconds since an arbitrary origin, which never runs backwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct MonoTime(u64);

impl MonoTime {
    /// The arbitrary origin of all times.
    pub const ZERO: Self = Self(0);
    /// The end of time, 584 years after the origin.
    pub const MAX: Self = Self(u64::MAX);

    /// Creates a time `nanos` ns after the origin.
    #[inline]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Creates a time `millis` ms after the origin; saturates.
    #[inline]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// Returns the nanoseconds since the origin.
    #[inline]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Returns the time elapsed since `earlier`; 0 if it is in the future.
    #[inline]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// Returns true if at most `limit` has passed since `earlier`.
    #[inline]
    pub fn is_within(self, limit: Duration, earlier: Self) -> bool {
        earlier >= self.before(limit)
    }

    /// Returns this time plus `by`; saturates at [`Self::MAX`].
    #[inline]
    pub fn after(self, by: Duration) -> Self {
        Self(self.0.saturating_add(u64::try_from(by.as_nanos()).unwrap_or(u64::MAX)))
    }

    /// Returns this time minus `by`; saturates at [`Self::ZERO`].
    #[inline]
    pub fn before(self, by: Duration) -> Self {
        Self(self.0.saturating_sub(u64::try_from(by.as_nanos()).unwrap_or(u64::MAX)))
    }
}

/// Wall-clock stamp in nanoseconds since 1970-01-01 UTC, from the kernel or the recording.
///
/// It deliberately has no order, since a stamp is copied into messages and decides nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct WallStamp(i64);

impl WallStamp {
    /// Creates a stamp `nanos` ns after the epoch.
    #[inline]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Returns the nanoseconds since the epoch.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Returns this stamp plus `by`; saturates.
    #[inline]
    pub fn after(self, by: Duration) -> Self {
        Self(self.0.saturating_add(i64::try_from(by.as_nanos()).unwrap_or(i64::MAX)))
    }

    /// Returns `builtin_interfaces/Time.sec`: whole seconds, rounded down; saturates outside `int32`.
    #[inline]
    pub fn sec(self) -> i32 {
        let sec = self.0.div_euclid(1_000_000_000);
        i32::try_from(sec).unwrap_or(if sec < 0 { i32::MIN } else { i32::MAX })
    }

    /// Returns `builtin_interfaces/Time.nanosec`: 0 to 999 999 999.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // rem_euclid is in 0..10^9
    #[inline]
    pub const fn nanosec(self) -> u32 {
        self.0.rem_euclid(1_000_000_000) as u32
    }

    /// Returns seconds and microseconds since the epoch, as candump writes them: `1436509052.249713`, or
    /// `-0.250000` before it. Fractions of a microsecond are rounded down, towards the past.
    pub fn candump_text(self) -> String {
        let micros = self.0.div_euclid(1000);
        let (sign, micros) = (if micros < 0 { "-" } else { "" }, micros.unsigned_abs());
        format!("{sign}{}.{:06}", micros / 1_000_000, micros % 1_000_000)
    }

    /// Returns the date and time in UTC, to the second, in ISO 8601 format for file names:
    /// `20260101T000000Z`.
    pub fn utc_text(self) -> String {
        let [year, month, day, hour, minute, second] = self.utc_fields();
        format!("{year:04}{month:02}{day:02}T{hour:02}{minute:02}{second:02}Z")
    }

    /// Returns the date and time in UTC, to the millisecond, for display: `2026-01-01 00:00:00.000Z`.
    pub fn utc_line_text(self) -> String {
        let [year, month, day, hour, minute, second] = self.utc_fields();
        let millis = self.nanosec() / 1_000_000;
        format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}.{millis:03}Z")
    }

    /// Returns year, month, day, hour, minute and second in UTC.
    fn utc_fields(self) -> [i64; 6] {
        let seconds = self.0.div_euclid(1_000_000_000);
        let (days, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
        // Days since 0000-03-01, in eras of 400 years that begin in March, so that a leap day ends a year.
        let shifted = days + 719_468;
        let (era, day_of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
        let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
        let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
        let months = (5 * day_of_year + 2) / 153;
        let day = day_of_year - (153 * months + 2) / 5 + 1;
        let month = if months < 10 { months + 3 } else { months - 9 };
        let year = year_of_era + era * 400 + i64::from(month <= 2);
        [year, month, day, second / 3600, second / 60 % 60, second % 60]
    }
}

/// Time of a call on both clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Now {
    /// Monotonic time, which decides ages and timeouts.
    pub mono: MonoTime,
    /// Wall-clock stamp for headers of new messages, such as diagnostics.
    pub wall: WallStamp,
}

/// Returns a duration in whole milliseconds; saturates.
#[inline]
pub fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

/// Returns the first instant at which more than `limit` has passed since `start`.
#[inline]
pub fn deadline_after(start: MonoTime, limit: Duration) -> MonoTime {
    start.after(limit.saturating_add(Duration::from_nanos(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_before_epoch_have_positive_nanosec() {
        let stamp = WallStamp::from_nanos(-1);
        assert_eq!((stamp.sec(), stamp.nanosec()), (-1, 999_999_999));
    }

    #[test]
    fn stamps_beyond_int32_saturate() {
        assert_eq!(WallStamp::from_nanos(i64::MAX).sec(), i32::MAX);
    }

    #[test]
    fn stamps_are_written_as_candump_does_with_their_sign() {
        for (nanos, text) in [
            (0, "0.000000"),
            (1_436_509_052_249_713_999, "1436509052.249713"),
            (-250_000_000, "-0.250000"),
            (-1_750_000_000, "-1.750000"),
            (-2_000_000_000, "-2.000000"),
            (-1, "-0.000001"),
            (7_258_118_400_000_000_000, "7258118400.000000"),
            (i64::MIN, "-9223372036.854776"),
        ] {
            assert_eq!(WallStamp::from_nanos(nanos).candump_text(), text);
        }
    }

    #[test]
    fn stamps_are_written_as_utc_dates() {
        let dates = [
            (0, "19700101T000000Z"),
            (951_782_399, "20000228T235959Z"),
            (951_782_400, "20000229T000000Z"),
            (1_767_225_600, "20260101T000000Z"),
            (4_107_542_400, "21000301T000000Z"),
            (-1, "19691231T235959Z"),
        ];
        for (seconds, text) in dates {
            assert_eq!(WallStamp::from_nanos(seconds * 1_000_000_000).utc_text(), text);
        }
        assert_eq!(WallStamp::from_nanos(1_999_999).utc_line_text(), "1970-01-01 00:00:00.001Z");
    }

    #[test]
    fn time_within_a_limit_is_that_which_has_not_passed_it() {
        for (now, earlier) in [(0, 0), (10, 4), (10, 5), (10, 6), (3, 0), (10, 20), (u64::MAX, 0)] {
            let [now, earlier] = [now, earlier].map(MonoTime::from_nanos);
            for limit in [Duration::ZERO, Duration::from_nanos(5), Duration::MAX] {
                let is_within = now.is_within(limit, earlier);
                assert_eq!(is_within, now.since(earlier) <= limit, "{now:?} {earlier:?} {limit:?}");
            }
        }
    }

    #[test]
    fn time_since_later_time_is_zero() {
        assert_eq!(MonoTime::from_nanos(1).since(MonoTime::from_nanos(2)), Duration::ZERO);
    }
}
