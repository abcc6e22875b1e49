//! BUSMASTER log files.
//!
//! ```text
//! ***BUSMASTER Ver 3.2.2***
//! ***START DATE AND TIME 5:3:2024 14:30:0:250***
//! ***HEX***
//! ***SYSTEM MODE***
//! 14:30:01:5000 Rx 1 0x1A0 s 3 01 02 03
//! ```
//! `***DEC***` makes identifiers and data decimal. The type is `s` for 11 bits, `x` for 29, followed by `r`
//! for a remote request. In system mode times are times of day (a step back by more than half a day is
//! midnight), in absolute mode times since the start, in relative mode times since the previous line. The
//! last part of a time is in milliseconds, or in tenths of a millisecond if it has four digits.
//!
//! A J1939 log has other columns: the time, the channel, the 29-bit identifier, and parameter group, type,
//! addresses and priority, which repeat information in the identifier.
//!
//! ```text
//! ***PROTOCOL J1939***
//! 12:38:37:7168 1 1ceafffe 0x00EA00 RQST_ACL FE  FF  007 Tx 3 00 EE 00
//! ```
//! A message of more than eight bytes is skipped: BUSMASTER assembles it from frames, which have their own
//! lines. A log of LIN is not read: its lines are bad.

use crate::clock::{DAY, WrappingClock, days, nanos, time_of_day};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{SpacedFields, fields, id, number, text};
use crate::format::{LineFormat, LineReader, begins};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "BUSMASTER",
    claims: |line| begins(line, &["***BUSMASTER"]),
    unit_ns: None,
    reader: |_| {
        let clock = WrappingClock::new(DAY, 0);
        let mode = TimeMode::System;
        Box::new(Busmaster { start: 0, decimal: false, j1939: false, mode, clock, elapsed: 0 })
    },
};

/// State from the headings, and the time.
#[derive(Debug)]
struct Busmaster {
    start: i64,
    decimal: bool,
    /// True between a J1939 heading and the heading of another protocol.
    j1939: bool,
    mode: TimeMode,
    /// Time since midnight before the start.
    clock: WrappingClock,
    /// Time since the start in relative mode, ns.
    elapsed: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TimeMode {
    System,
    Absolute,
    Relative,
}

impl LineReader for Busmaster {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        if let Some(heading) = line.strip_prefix(b"***") {
            return self.heading(heading.strip_suffix(b"***").unwrap_or(heading)).map(|()| None);
        }
        let mut fields = fields(text(line)?, if self.decimal { 10 } else { 16 });
        let time = fields.next().and_then(clock).ok_or(BadLine::NoTime)?;
        let frame = if self.j1939 { j1939_frame(&mut fields)? } else { Some(frame(&mut fields)?) };
        let nanos = self.advance(time);
        Ok(frame.map(|(channel, content)| LogEntry::numbered(nanos, channel, content)))
    }
}

impl Busmaster {
    fn heading(&mut self, heading: &[u8]) -> Result<(), BadLine> {
        match heading {
            b"HEX" => self.decimal = false,
            b"DEC" => self.decimal = true,
            b"SYSTEM MODE" => self.mode = TimeMode::System,
            b"ABSOLUTE MODE" => self.mode = TimeMode::Absolute,
            b"RELATIVE MODE" => self.mode = TimeMode::Relative,
            b"PROTOCOL J1939" => self.j1939 = true,
            other => {
                if other.starts_with(b"PROTOCOL ") {
                    self.j1939 = false;
                }
                if let Some(start) = other.strip_prefix(b"START DATE AND TIME ") {
                    self.start = text(start).ok().and_then(start_time).ok_or(BadLine::NoTime)?;
                    (self.clock, self.elapsed) = (WrappingClock::new(DAY, self.start.rem_euclid(DAY)), 0);
                }
            }
        }
        Ok(())
    }

    /// Returns the stamp of a line with this time, ns since 1970.
    fn advance(&mut self, time: i64) -> i64 {
        match self.mode {
            TimeMode::System => {
                let midnight = self.start - self.start.rem_euclid(DAY);
                midnight.saturating_add(self.clock.since_start(time))
            }
            TimeMode::Absolute => self.start.saturating_add(time),
            TimeMode::Relative => {
                self.elapsed = self.elapsed.saturating_add(time);
                self.start.saturating_add(self.elapsed)
            }
        }
    }
}

/// Parses `5:3:2024 14:30:0:250`: day, month, year, and a time of day.
fn start_time(text: &str) -> Option<i64> {
    let (date, time) = text.trim().split_once(' ')?;
    let mut parts = date.splitn(3, ':').map(|part| number(part, 10));
    let (day, month, year) = (parts.next()??, parts.next()??, parts.next()??);
    nanos(days(year, month, day), clock(time))
}

/// Parses `14:30:01:5000`, ns since midnight.
fn clock(field: &str) -> Option<i64> {
    let (time, fraction) = field.trim().rsplit_once(':')?;
    let unit = match fraction.len() {
        1..=3 => 1_000_000,
        4 => 100_000,
        _ => return None,
    };
    Some(time_of_day(time)? + i64::from(number(fraction, 10)?) * unit)
}

/// Reads channel and content after the time.
fn frame(fields: &mut SpacedFields<'_>) -> Result<(u32, EntryContent), BadLine> {
    if !matches!(fields.next(), Some("Rx" | "Tx")) {
        return Err(BadLine::NoFrame);
    }
    let channel = fields.channel()?;
    let identifier = fields.text(BadLine::NoFrame)?;
    let digits = identifier.strip_prefix("0x").unwrap_or(identifier);
    let identifier = number(digits, fields.radix).ok_or(BadLine::BadId)?;
    let (extended, remote) = match fields.next() {
        Some("s" | "S") => (false, false),
        Some("x" | "X") => (true, false),
        Some("sr" | "SR") => (false, true),
        Some("xr" | "XR") => (true, true),
        _ => return Err(BadLine::NoFrame),
    };
    let id = id(identifier, extended)?;
    let length = fields.length()?;
    if length > 8 {
        return Err(BadLine::BadLength);
    }
    if remote {
        return Ok((channel, EntryContent::Remote));
    }
    let content = fields.data_frame(id, false, length)?;
    fields.end()?;
    Ok((channel, content))
}

/// Reads channel and content after the time in a J1939 log; `None` for a message of several frames.
fn j1939_frame(fields: &mut SpacedFields<'_>) -> Result<Option<(u32, EntryContent)>, BadLine> {
    let channel = fields.channel()?;
    let identifier = number(fields.text(BadLine::NoFrame)?, fields.radix).ok_or(BadLine::BadId)?;
    let id = id(identifier, true)?;
    // Parameter group, type, source, destination and priority come before the direction.
    if !matches!(fields.nth(5), Some("Rx" | "Tx")) {
        return Err(BadLine::NoFrame);
    }
    let length = fields.length()?;
    if length > 8 {
        return Ok(None);
    }
    let content = fields.data_frame(id, false, length)?;
    fields.end()?;
    Ok(Some((channel, content)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    const START: &str = "***START DATE AND TIME 5:3:2024 14:30:0:250***";

    #[test]
    fn every_kind_of_line_is_read() {
        let lines = good(
            FORMAT,
            &[
                START,
                "***HEX***",
                "***SYSTEM MODE***",
                "***CHANNEL 1 - Any - 500000 bps***",
                "14:30:01:5000 Rx 1 0x1A0 s 3 01 02 fF",
                "14:30:01:7 Tx 2 18FEF100 x 0",
                "14:30:01:507 Rx 1 0x1A0 sr 8",
                "***STOP LOGGING SESSION***",
            ],
        );
        let expected = [
            "1709649001500000 can1 1A0#0102FF",
            "1709649001007000 can2 18FEF100#",
            "1709649001507000 can1 Remote",
        ];
        assert_eq!(lines, expected);
        assert_eq!(good(FORMAT, &["***DEC***", "0:0:1:0 Rx 1 416 s 2 10 255"]), ["1000000 can1 1A0#0AFF"]);
    }

    #[test]
    fn frames_of_j1939_are_read_and_assembled_messages_passed_over() {
        let long = format!("14:30:03:0 1 18feca00 0x00FECA BROADCAST 00  FF  006 Rx 10 {}", "01 ".repeat(10));
        let lines = good(
            FORMAT,
            &[
                "***BUSMASTER 2.5.0***",
                "***PROTOCOL J1939***",
                START,
                "***HEX***",
                "14:30:01:5000 1 18eeff00 0x00EE00 ACL 00  FF  006 Tx 8 01 00 00 00 00 00 00 80",
                "14:30:02:7168 2 1ceafffe 0x00EA00 RQST_ACL FE  FF  007 Rx 3 00 EE 00",
                &long,
                "***DEC***",
                "14:30:04:0 1 419361024 065265 DATA 000 255 006 Rx 2 010 255",
                "***PROTOCOL CAN***",
                "14:30:05:0 Rx 1 416 s 1 255",
            ],
        );
        let expected = [
            "1709649001500000 can1 18EEFF00#0100000000000080",
            "1709649002716800 can2 1CEAFFFE#00EE00",
            "1709649004000000 can1 18FEF100#0AFF",
            "1709649005000000 can1 1A0#FF",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn each_kind_of_time_is_recognised() {
        let frames = ["0:0:1:0 Rx 1 1A0 s 0", "0:0:3:0 Rx 1 1A0 s 0"];
        let seconds = |mode| {
            good(FORMAT, &[START, mode, frames[0], frames[1]])
                .iter()
                .map(|line| {
                    line.split(' ').next().unwrap().parse::<i64>().unwrap() / 1000 - 1_709_649_000_250
                })
                .collect::<Vec<_>>()
        };
        assert_eq!(seconds("***ABSOLUTE MODE***"), [1000, 3000]);
        assert_eq!(seconds("***RELATIVE MODE***"), [1000, 4000]);
        // The start was at half past two in the afternoon, so these times belong to the following night.
        assert_eq!(seconds("***SYSTEM MODE***"), [34_200_750, 34_202_750]);
    }

    #[test]
    fn midnight_is_the_next_day_and_a_late_line_stays_before_it() {
        let lines = good(
            FORMAT,
            &[
                "***START DATE AND TIME 31:12:2024 23:59:59:0***",
                "23:59:59:900 Rx 1 1A0 s 0",
                "00:00:00:100 Rx 1 1A0 s 0",
                "23:59:59:950 Rx 1 1A0 s 0",
                "00:00:00:200 Rx 1 1A0 s 0",
            ],
        );
        let midnight = 1_735_689_600_000_000_i64;
        let expected =
            [-100_000, 100_000, -50_000, 200_000].map(|micros| format!("{} can1 1A0#", midnight + micros));
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("***START DATE AND TIME 31:2:2024 1:1:1:1***", BadLine::NoTime),
            ("24:00:00:0 Rx 1 1A0 s 0", BadLine::NoTime),
            ("1:0:0:00000 Rx 1 1A0 s 0", BadLine::NoTime),
            ("1:0:0:0 Rz 1 1A0 s 0", BadLine::NoFrame),
            ("1:0:0:0 Rx y 1A0 s 0", BadLine::NoInterface),
            ("1:0:0:0 Rx 1", BadLine::NoFrame),
            ("1:0:0:0 Rx 1 1G0 s 0", BadLine::BadId),
            ("1:0:0:0 Rx 1 800 s 0", BadLine::BadId),
            ("1:0:0:0 Rx 1 1A0 q 0", BadLine::NoFrame),
            ("1:0:0:0 Rx 1 1A0 s 9 1 2 3 4 5 6 7 8 9", BadLine::BadLength),
            ("1:0:0:0 Rx 1 1A0 s 1 1 2", BadLine::BadLength),
            ("1:0:0:0 Rx 1 1A0 s 2 1", BadLine::BadData),
        ];
        assert_refused(FORMAT, &[], &cases);
        let cases = [
            ("1:0:0:0 x 18eeff00 0x00EE00 ACL 00 FF 006 Tx 0", BadLine::NoInterface),
            ("1:0:0:0 1", BadLine::NoFrame),
            ("1:0:0:0 1 0x18eeff00 0x00EE00 ACL 00 FF 006 Tx 0", BadLine::BadId),
            ("1:0:0:0 1 20000000 0x00EE00 ACL 00 FF 006 Tx 0", BadLine::BadId),
            ("1:0:0:0 1 18eeff00 0x00EE00 ACL 00 FF Tx 0", BadLine::NoFrame),
            ("1:0:0:0 1 18eeff00 0x00EE00 ACL 00 FF 006 Tx", BadLine::BadLength),
            ("1:0:0:0 1 18eeff00 0x00EE00 ACL 00 FF 006 Tx 1", BadLine::BadData),
            ("1:0:0:0 1 18eeff00 0x00EE00 ACL 00 FF 006 Tx 1 00 00", BadLine::BadLength),
        ];
        assert_refused(FORMAT, &["***PROTOCOL J1939***"], &cases);
    }
}
