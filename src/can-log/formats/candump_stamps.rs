//! The stamps of [candump](super::candump), and the optional colours of its lines.

use crate::clock::{SECOND, days, nanos, time_of_day};
use crate::fields::{decimal, number, text};
use gateway_base::time::WallStamp;

/// Stamps below this are not absolute times: 2001-09-09, ns.
const MIN_ABSOLUTE: i64 = 1_000_000_000 * SECOND;

/// Returns the stamp of a line if it may be a difference, ns: candump writes differences with at least three
/// digits of seconds, and absolute times with ten.
pub(super) fn difference(line: &[u8]) -> Option<i64> {
    let line = text(line).ok()?;
    let (stamp, _) = stamped(line)?;
    let (time, _) = without_colour(line.trim_start()).trim_start().strip_prefix('(')?.split_once(')')?;
    let (seconds, fraction) = time.split_once('.')?;
    let is_written_so = (3..10).contains(&seconds.len()) && matches!(fraction.len(), 6 | 9);
    Some(stamp.as_nanos()).filter(|nanos| is_written_so && *nanos < MIN_ABSOLUTE)
}

/// Returns true if the stamps of these lines are differences: they fall again and again, and a quarter or
/// more of them are smaller than the previous stamp or than half of the largest. Stamps of `-tz` fall only if
/// two interfaces receive a frame at the same time.
pub(super) fn are_differences<'a>(lines: impl Iterator<Item = &'a [u8]>) -> bool {
    let (mut pairs, mut falls, mut small, mut largest) = (0_usize, 0, 0, 0);
    let mut last = None;
    for nanos in lines.filter_map(difference) {
        if let Some(last) = last.replace(nanos) {
            pairs += 1;
            falls += usize::from(nanos < last);
            small += usize::from(nanos < last || nanos < largest / 2);
        }
        largest = largest.max(nanos);
    }
    falls > 0 && falls * 20 >= pairs && small * 4 >= pairs
}

/// Reads `(seconds.fraction)` or `(2015-07-10 06:17:32.249713)`, with one to nine decimals, and returns the
/// rest. Seconds before 1970 are negative, as the gateway writes them.
pub(super) fn stamped(line: &str) -> Option<(WallStamp, &str)> {
    let (time, rest) = without_colour(line.trim_start()).trim_start().strip_prefix('(')?.split_once(')')?;
    let (_, fraction) = time.trim().split_once('.')?;
    if fraction.len() > 9 || !(rest.is_empty() || rest.starts_with([' ', '\t'])) {
        return None;
    }
    let nanos = match time.trim().split_once(' ') {
        Some((date, time)) => date_and_time(date, time),
        None => match time.trim().strip_prefix('-') {
            Some(before) => decimal(before, SECOND).map(|nanos| -nanos),
            None => decimal(time.trim(), SECOND),
        },
    };
    Some((nanos.map(WallStamp::from_nanos)?, rest))
}

/// Start of a terminal colour sequence, which ends with `m`.
const COLOUR: &str = "\x1B[";

/// Removes colours before a text.
fn without_colour(text: &str) -> &str {
    let rest = text.strip_prefix(COLOUR).and_then(|rest| rest.split_once('m'));
    rest.map_or(text, |(_, rest)| without_colour(rest))
}

/// Removes colours before and after a field.
pub(super) fn uncoloured(field: &str) -> &str {
    let field = without_colour(field);
    field.split_once(COLOUR).map_or(field, |(field, _)| field)
}

/// Reads `2015-07-10` and `06:17:32.249713`, not before 1970.
fn date_and_time(date: &str, time: &str) -> Option<i64> {
    let mut parts = date.splitn(3, '-').map(|part| number(part, 10));
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    nanos(days(year, month, day), time_of_day(time)).filter(|nanos| *nanos >= 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_differences_if_they_fall_again_and_again() {
        let burst = [8, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        for (millis, expected) in [
            (vec![0_i64, 3, 1], true),
            (vec![0, 1, 3], false),
            (vec![0], false),
            (vec![], false),
            // One message every 100 ms; bursts of frames with equal lengths.
            ([100, 101, 99].repeat(20), true),
            (burst.repeat(5), true),
            // Two interfaces; two recordings, one after the other; absolute stamps.
            (vec![0, 1, 0, 3, 4, 5, 7, 9], false),
            ((0..30).chain(0..30).collect(), false),
            (vec![1_700_000_000_300, 1_700_000_000_200, 1_700_000_000_400], false),
        ] {
            let lines = millis.iter().map(|ms| format!("({:03}.{:03}000) can0 123#", ms / 1000, ms % 1000));
            let lines: Vec<_> = lines.collect();
            assert_eq!(are_differences(lines.iter().map(String::as_bytes)), expected, "{millis:?}");
        }
        for lines in [
            ["(10.500000) can0 123#", "(10.400000) can0 123#"],
            ["(0000000002.500000) can0 123#", "(0000000000.400000) can0 123#"],
        ] {
            assert!(!are_differences(lines.iter().map(|line| line.as_bytes())), "{lines:?}");
        }
    }
}
