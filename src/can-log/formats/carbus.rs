//! Traces of CARBUS Analyzer (`.trc`), whose lines end with carriage returns alone.
//!
//! ```text
//! @ TEXT @ 2 @ 64 @ 0 @ 55 @ 10078 @ 00:00:10.078 @
//! 46,016  1  0004  45A  8  5A 04 00 00 00 00 00 00  00000000  Z
//! ```
//! A line has time, bus, kind, identifier, length and data separated by tabs; the remaining fields are
//! unused. Three digits are an identifier of 11 bits. The digits after the comma of a time are milliseconds
//! in version 2, which the first line states, and microseconds in version 3, which `SavvyCAN` writes without
//! leading zeros. See its `loadCARBUSAnalyzerFile`.

use std::io::{self, BufRead, Read};

use crate::clock::SECOND;
use crate::entry::{BadLine, LogEntry};
use crate::fields::fields;
use crate::fields::{decimal, id, number, text_before_comment};
use crate::format::{MAX_LINE, Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome};

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "CARBUS Analyzer trace",
    mark: Mark::Magics(&[b"@ TEXT @"]),
    reader: |source| Ok(Box::new(Carbus { source, line: Vec::new(), unit_ns: MICROSECOND })),
};

/// A CAN frame; other kinds are unknown.
const FRAME: &str = "0004";

const MICROSECOND: i64 = SECOND / 1_000_000;

struct Carbus {
    source: ObjectSource,
    line: Vec<u8>,
    /// Unit of the second number of a time, ns.
    unit_ns: i64,
}

impl ObjectReader for Carbus {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        self.line.clear();
        (&mut self.source).take(MAX_LINE as u64).read_until(b'\r', &mut self.line)?;
        let line = self.line.trim_ascii();
        if line.starts_with(b"@ TEXT @ 2 @") {
            self.unit_ns = 1000 * MICROSECOND;
        }
        Ok(match self.line.len() {
            0 => None,
            MAX_LINE if !self.line.ends_with(b"\r") => Some(Err(BadLine::TooLong)),
            _ if line.is_empty() || line.starts_with(b"@") => Some(Ok(None)),
            _ => Some(entry(text_before_comment(line), self.unit_ns).map(Some)),
        })
    }
}

fn entry(line: &str, unit_ns: i64) -> Result<LogEntry<'static>, BadLine> {
    let mut fields = fields(line, 16);
    let nanos = time(fields.text(BadLine::NoTime)?, unit_ns).ok_or(BadLine::NoTime)?;
    let bus = fields.channel()?;
    if fields.next() != Some(FRAME) {
        return Err(BadLine::NoFrame);
    }
    let digits = fields.text(BadLine::BadId)?;
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, digits.len() > 3)?;
    let length = fields.length()?;
    Ok(LogEntry::numbered(nanos, bus, fields.data_frame(id, length > 8, length)?))
}

/// Reads seconds and, after a comma, a number in a smaller unit; returns ns.
fn time(field: &str, unit_ns: i64) -> Option<i64> {
    let (seconds, rest) = field.split_once(',')?;
    let rest = decimal(rest, unit_ns).filter(|rest| *rest < SECOND)?;
    decimal(seconds, SECOND)?.checked_add(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::objects;

    #[test]
    fn lines_are_read_up_to_what_is_not_used() {
        let file = b"@ TEXT @ 3 @ 64 @ 0 @ 5 @ 10078 @ 00:00:10.078 @\r46,016500\t1\t0004\t45A\t3\t5A 04 FF\t00000000\tZ  \t\r\
            46,734\t2\t0004\t18FEF100\t2\t24 00\t00000000\t$\xFF\t\r47,0\t1\t0004\t123\t0\t\t00000000\t\t\r\r\
            47,1\t1\t0008\t123\t0\t\t00000000\t\t\r47,1\t1\t0004\t800\t0\t\t0\t\t\r47,1\t1\t0004\t123\t2\t01\t\r47.5";
        let expected = [
            Ok("46016500 can1 45A#5A04FF"),
            Ok("46000734 can2 18FEF100#2400"),
            Ok("47000000 can1 123#"),
            Err(BadLine::NoFrame),
            Err(BadLine::BadId),
            Err(BadLine::BadData),
            Err(BadLine::NoTime),
        ];
        assert_eq!(objects(FORMAT, file).unwrap(), expected.map(|entry| entry.map(str::to_owned)));
        let version_2 =
            b"@ TEXT @ 2 @ 64 @\r46,016\t1\t0004\t45A\t0\t\t0\t\t\r46,1000\t1\t0004\t45A\t0\t\t0\t\t\r";
        let expected = [Ok("46016000 can1 45A#".to_owned()), Err(BadLine::NoTime)];
        assert_eq!(objects(FORMAT, version_2).unwrap(), expected);
        let long = [&b"@ TEXT @ 3 @\r"[..], &[b'1'; MAX_LINE], b"\r1,5\t1\t0004\t123\t0\r"].concat();
        let expected = [Err(BadLine::TooLong), Ok("1000005 can1 123#".to_owned())];
        assert_eq!(objects(FORMAT, &long).unwrap(), expected);
    }
}
