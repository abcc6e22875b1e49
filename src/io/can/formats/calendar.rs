//! Dates as recordings write them, in nanoseconds since 1970. Time zones are not written, see
//! [the formats](super).

use super::words::decimal;

const SECOND: i64 = 1_000_000_000;
pub(super) const DAY: i64 = 86_400 * SECOND;

/// Days from 1970-01-01 to a date of the Gregorian calendar, years 1900 to 2200.
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
    // 719,163 days lie before 1970-01-01 in this reckoning, its own day among them.
    Some(i64::from(years * 365 + leap_days + day_of_year) - 719_163)
}

/// A date and a time of day.
pub(super) fn nanos(date: Option<i64>, time_of_day: Option<i64>) -> Option<i64> {
    date?.checked_mul(DAY)?.checked_add(time_of_day?)
}

/// `hh:mm:ss` or `hh:mm:ss.fff`, in nanoseconds.
pub(super) fn time_of_day(word: &str) -> Option<i64> {
    let mut parts = word.splitn(3, ':');
    let hours = parts.next().and_then(|part| part.parse::<u8>().ok()).filter(|hours| *hours < 24)?;
    let minutes = parts.next().and_then(|part| part.parse::<u8>().ok()).filter(|minutes| *minutes < 60)?;
    let seconds = parts.next().and_then(|part| decimal(part, SECOND)).filter(|nanos| *nanos < 60 * SECOND)?;
    Some((i64::from(hours) * 60 + i64::from(minutes)) * 60 * SECOND + seconds)
}

/// The number of a month by its English or German short name.
pub(super) fn month(word: &str) -> Option<u32> {
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
    let word = word.to_lowercase();
    let found = NAMES.iter().position(|names| names.contains(&word.as_str()))?;
    u32::try_from(found + 1).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for word in ["", "1:2", "24:00:00", "1:60:0", "1:2:60", "1:2:3:4"] {
            assert_eq!(time_of_day(word), None, "{word}");
        }
    }
}
