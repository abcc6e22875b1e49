//! Dates, times of day and wrapping clocks, as written in recordings, in nanoseconds. Time zones are not
//! recorded, see [the formats](super).

use crate::fields::decimal;

pub(super) const SECOND: i64 = 1_000_000_000;
pub(super) const DAY: i64 = 86_400 * SECOND;

/// Returns the days from 1970-01-01 to a Gregorian date, years 1900 to 2200.
pub(super) fn days(year: u32, month: u32, day: u32) -> Option<i64> {
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let lengths = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let before = usize::try_from(month).ok()?.checked_sub(1)?;
    if !(1900..=2200).contains(&year) || !(1..=*lengths.get(before)?).contains(&day) {
        return None;
    }
    let years = year - 1;
    let leap_days = years / 4 - years / 100 + years / 400;
    let day_of_year = lengths[..before].iter().sum::<u32>() + day;
    // By this count 1970-01-01 is day 719,163.
    Some(i64::from(years * 365 + leap_days + day_of_year) - 719_163)
}

/// Returns the nanoseconds from 1970 to a time of day on a date; `None` if either is missing.
pub(super) fn nanos(date: Option<i64>, time_of_day: Option<i64>) -> Option<i64> {
    date?.checked_mul(DAY)?.checked_add(time_of_day?)
}

/// Converts seconds to ns; `None` if they are out of range.
pub(super) fn nanos_of_seconds(seconds: f64) -> Option<i64> {
    #[allow(clippy::cast_possible_truncation)] // ±9e18 is in range
    (seconds.abs() < 9e9).then(|| (seconds * 1e9).round() as i64)
}

/// Reads `hh:mm:ss` or `hh:mm:ss.fff`, ns since midnight.
pub(super) fn time_of_day(field: &str) -> Option<i64> {
    let mut parts = field.splitn(3, ':');
    let hours = parts.next().and_then(|part| part.parse::<u8>().ok()).filter(|hours| *hours < 24)?;
    let minutes = parts.next().and_then(|part| part.parse::<u8>().ok()).filter(|minutes| *minutes < 60)?;
    let seconds = parts.next().and_then(|part| decimal(part, SECOND)).filter(|nanos| *nanos < 60 * SECOND)?;
    Some((i64::from(hours) * 60 + i64::from(minutes)) * 60 * SECOND + seconds)
}

/// Returns the number of a month by its English or German short name.
pub(super) fn month(field: &str) -> Option<u32> {
    const NAMES: [&[&str]; 12] = [
        &["jan"],
        &["feb"],
        &["mar", "mär", "mrz"],
        &["apr"],
        &["may", "mai"],
        &["jun"],
        &["jul"],
        &["aug"],
        &["sep"],
        &["oct", "okt"],
        &["nov"],
        &["dec", "dez"],
    ];
    let name = field.to_lowercase();
    let found = NAMES.iter().position(|names| names.contains(&name.as_str()))?;
    u32::try_from(found + 1).ok()
}

/// Longest delay of a line, ns; writers do not keep lines strictly in order.
const MAX_DELAY: i64 = 10 * SECOND;

/// A clock that restarts at zero after each period, ns.
#[derive(Debug)]
pub(super) struct WrappingClock {
    period: i64,
    newest: i64,
    /// Sum of the past periods.
    base: i64,
}

impl WrappingClock {
    /// Creates a clock whose first period began `newest` ago.
    pub(super) fn new(period: i64, newest: i64) -> Self {
        Self { period, newest, base: 0 }
    }

    /// Returns the time since the start of the first period. A step back by more than half a period starts
    /// the next period. A time within [`MAX_DELAY`] on the other side of that step belongs to the previous
    /// period. Other steps back stay in their period.
    pub(super) fn since_start(&mut self, time: i64) -> i64 {
        if time + self.period / 2 < self.newest {
            self.base = self.base.saturating_add(self.period);
        } else if self.base > 0 && time >= self.period - MAX_DELAY && self.newest < MAX_DELAY {
            return self.base.saturating_add(time - self.period);
        }
        self.newest = time;
        self.base.saturating_add(time)
    }
}

/// A counter that restarts after each period, unless it proves to be longer.
#[derive(Debug)]
pub(super) struct TimeCounter {
    clock: WrappingClock,
    /// True if a time was read that exceeds the period.
    is_longer: bool,
}

impl TimeCounter {
    /// Creates a counter with a period in ns.
    pub(super) fn new(period: i64) -> Self {
        Self { clock: WrappingClock::new(period, 0), is_longer: false }
    }

    /// Returns the time since the start of the first period, ns. The upper half of a period may be negative.
    pub(super) fn since_start(&mut self, time: i64) -> i64 {
        let period = self.clock.period;
        self.is_longer |= !(-period / 2..period).contains(&time);
        if self.is_longer { time } else { self.clock.since_start(time.rem_euclid(period)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_starts_again_and_late_times_stay_in_their_period() {
        const PERIOD: i64 = 1 << 32;
        let mut clock = WrappingClock::new(PERIOD * 1000, 0);
        let micros =
            [PERIOD - 50, PERIOD - 20, PERIOD - 30, 10, PERIOD - 5, 40, 30, PERIOD / 2, PERIOD - 1, 3];
        let expected = [
            PERIOD - 50,
            PERIOD - 20,
            PERIOD - 30,
            PERIOD + 10,
            PERIOD - 5,
            PERIOD + 40,
            PERIOD + 30,
            PERIOD + PERIOD / 2,
            2 * PERIOD - 1,
            2 * PERIOD + 3,
        ];
        assert_eq!(micros.map(|micros| clock.since_start(micros * 1000) / 1000), expected);
    }

    #[test]
    fn dates_are_days_since_1970() {
        for (date, expected) in [
            ((1970, 1, 1), Some(0)),
            ((1969, 12, 31), Some(-1)),
            ((1899, 12, 31), None),
            ((2000, 2, 29), Some(11_016)),
            ((2000, 3, 1), Some(11_017)),
            ((2024, 12, 31), Some(20_088)),
            ((2023, 2, 29), None),
            ((2023, 0, 1), None),
            ((2023, 13, 1), None),
            ((2023, 1, 0), None),
        ] {
            assert_eq!(days(date.0, date.1, date.2), expected, "{date:?}");
        }
    }

    #[test]
    fn times_of_day_are_read_and_checked() {
        assert_eq!(time_of_day("01:02:03.5"), Some(3_723_500_000_000));
        assert_eq!(time_of_day("1:2:3"), Some(3_723_000_000_000));
        for field in ["", "1:2", "24:00:00", "1:60:0", "1:2:60", "1:2:3:4"] {
            assert_eq!(time_of_day(field), None, "{field}");
        }
    }
}
