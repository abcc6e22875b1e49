//! slcan, the text protocol of LAWICEL's CANUSB and CAN232, as stored by a serial terminal, one frame per
//! line.
//!
//! ```text
//! t1A0301020304D2
//! T18FEF1000
//! ```
//! `t` and `r` have three digits of identifier, `T` and `R` eight; `r` and `R` are remote requests. `d`, `D`
//! (without a bit rate switch), `b` and `B` (with one) are CAN FD frames as written by `CANable` 2 and
//! python-can. A digit for the DLC follows, then data and, if the adapter is so configured, a stamp of four
//! digits. All numbers are hexadecimal.
//!
//! # Time
//! The stamp is in milliseconds, from a counter that restarts after 60 s (`0000` to `EA5F`). Without stamps
//! every stamp is the epoch.

use crate::clock::{SECOND, TimeCounter};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{id, length_of_dlc, number, packed_frame, text};
use crate::format::{LineFormat, LineReader, begins};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "slcan",
    // An FD line could also be a hexadecimal number.
    claims: |line| begins(line, &["t", "r"]) && text(line).and_then(parse).is_ok(),
    unit_ns: None,
    reader: |_| Box::new(Slcan(TimeCounter::new(PERIOD))),
};

#[derive(Debug)]
struct Slcan(TimeCounter);

const PERIOD: i64 = 60 * SECOND;

impl LineReader for Slcan {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        let (millis, content) = parse(text(line)?)?;
        let nanos = millis.map_or(0, |millis| self.0.since_start(i64::from(millis) * (SECOND / 1000)));
        Ok(Some(LogEntry::numbered(nanos, 0, content)))
    }
}

/// Reads the stamp in ms, if there is one, and the frame.
fn parse(line: &str) -> Result<(Option<u32>, EntryContent), BadLine> {
    let kind = line.chars().next().ok_or(BadLine::NoFrame)?;
    if !"tTrRdDbB".contains(kind) {
        return Err(BadLine::NoFrame);
    }
    let (extended, remote) = (kind.is_ascii_uppercase(), matches!(kind, 'r' | 'R'));
    let fd = matches!(kind, 'd' | 'D' | 'b' | 'B');
    let (digits, rest) = line[1..].split_at_checked(if extended { 8 } else { 3 }).ok_or(BadLine::BadId)?;
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, extended)?;
    let (dlc, rest) = rest.split_at_checked(1).ok_or(BadLine::BadLength)?;
    let dlc = number(dlc, 16).filter(|dlc| fd || *dlc <= 8);
    let length = dlc.and_then(|dlc| length_of_dlc(dlc, fd)).ok_or(BadLine::BadLength)?;
    let (data, stamp) = rest.split_at_checked(if remote { 0 } else { 2 * length }).ok_or(BadLine::BadData)?;
    let content = if remote { EntryContent::Remote } else { packed_frame(id, fd, data)? };
    let millis = match stamp.len() {
        0 => None,
        4 => {
            let millis = number(stamp, 16).filter(|millis| *millis < 60_000);
            Some(millis.ok_or(BadLine::NoTime)?)
        }
        _ => return Err(BadLine::BadLength),
    };
    Ok((millis, content))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn every_kind_of_line_is_read() {
        let lines = good(
            FORMAT,
            &[
                "t1A03010203",
                "T18FEF1000",
                "r1A08",
                "R18FEF1002",
                "d1A0101",
                "B18FEF1009000102030405060708090A0B",
            ],
        );
        let expected = [
            "0 can0 1A0#010203",
            "0 can0 18FEF100#",
            "0 can0 Remote",
            "0 can0 Remote",
            "0 can0 1A0##001",
            "0 can0 18FEF100##0000102030405060708090A0B",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn stamps_begin_again_after_a_minute() {
        let lines = good(FORMAT, &["t1A0101EA5F", "r1A000001"]);
        assert_eq!(lines, ["59999000 can0 1A0#01", "60001000 can0 Remote"]);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("", BadLine::NoFrame),
            ("x1A00", BadLine::NoFrame),
            ("t1A", BadLine::BadId),
            ("t8000", BadLine::BadId),
            ("T200000000", BadLine::BadId),
            ("t1A0", BadLine::BadLength),
            ("t1A09000102030405060708", BadLine::BadLength),
            ("t1A0201", BadLine::BadData),
            ("t1A01zz", BadLine::BadData),
            ("t1A010100", BadLine::BadLength),
            ("t1A0101EA60", BadLine::NoTime),
        ];
        assert_refused(FORMAT, &[], &cases);
    }
}
