//! SavvyCAN and GVRET CSV.
//!
//! ```text
//! Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8
//! 166064000,0000021A,false,Rx,0,3,FE,36,12,,,,,
//! ```
//! The heading names the columns (`Dir` was added later) and may be repeated. Data columns beyond the length
//! are ignored. More than eight bytes are a CAN FD frame.
//!
//! # Time
//! Times are in microseconds; in GVRET files they come from the recorder's 32-bit counter, which restarts at
//! zero after 71.6 minutes, see [`TimeCounter`]; the buses are written in blocks, so lines are not strictly
//! in order. Some tools write the upper half of the counter as negative numbers. A file with a value beyond
//! 32 bits has a counter that does not wrap.

use crate::clock::TimeCounter;
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{columns, id, number, text};
use crate::format::{LineFormat, LineReader, begins};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "SavvyCAN or GVRET CSV",
    claims: |line| begins(line, &["Time Stamp,ID,"]),
    unit_ns: Some(1000),
    reader: |unit_ns| Box::new(Csv::new(unit_ns)),
};

#[derive(Debug)]
struct Csv {
    columns: CsvColumns,
    counter: TimeCounter,
    /// Unit of the counter, ns.
    unit_ns: i64,
}

impl Csv {
    fn new(unit_ns: i64) -> Self {
        // Those of the first GVRET files.
        Self { columns: [0, 1, 2, 3, 4, 5], counter: TimeCounter::new(NARROW * unit_ns), unit_ns }
    }
}

/// Positions of time, identifier, 29-bit flag, bus, length and data, which comes last.
type CsvColumns = [usize; 6];

fn of_heading(heading: &str) -> Option<CsvColumns> {
    let position = |name: &str| columns(heading, 0).position(|column| column.eq_ignore_ascii_case(name));
    let (time, id) = (position("Time Stamp")?, position("ID")?);
    let (extended, bus, length) = (position("Extended")?, position("Bus")?, position("LEN")?);
    let data = position("D1").unwrap_or(length + 1);
    let is_last = [time, id, extended, bus, length].iter().all(|column| *column < data);
    is_last.then_some([time, id, extended, bus, length, data])
}

/// Number of values of a 32-bit counter.
const NARROW: i64 = 1 << 32;

impl LineReader for Csv {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        let line = text(line)?;
        if begins(line.as_bytes(), &["Time Stamp"]) {
            self.columns = of_heading(line).ok_or(BadLine::NoFrame)?;
            return Ok(None);
        }
        let (count, bus, content) = parse(line, self.columns)?;
        Ok(Some(LogEntry::numbered(
            self.counter.since_start(count.saturating_mul(self.unit_ns)),
            bus,
            content,
        )))
    }
}

/// Reads one line: the counter's value, the bus, and the content.
fn parse(
    line: &str,
    [time, id_at, extended, bus, length, data]: CsvColumns,
) -> Result<(i64, u32, EntryContent), BadLine> {
    let field = |column| columns(line, column).next().unwrap_or_default();
    // A sign is accepted only if it has meaning.
    let time = Some(field(time)).filter(|time| !time.starts_with('+')).and_then(|time| time.parse().ok());
    let time = time.ok_or(BadLine::NoTime)?;
    let extended = match field(extended) {
        extended if extended.eq_ignore_ascii_case("true") || extended == "1" => true,
        extended if extended.eq_ignore_ascii_case("false") || extended == "0" => false,
        _ => return Err(BadLine::NoFrame),
    };
    let identifier = field(id_at);
    let digits = identifier.strip_prefix("0x").unwrap_or(identifier);
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, extended)?;
    let bus = columns(line, bus).channel()?;
    let length = columns(line, length).length()?;
    let content = columns(line, data).data_frame(id, length > 8, length)?;
    Ok((time, bus, content))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    const HEADING: &str = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8";

    #[test]
    fn columns_are_found_by_their_heading() {
        assert_eq!(good(FORMAT, &["5,000001A0,false,1,2,01,fF,00,"]), ["5 can1 1A0#01FF"]);
        let lines = [
            HEADING,
            "5,18FEF100,true,Rx,0,3,01,02,03,,,,,,",
            "6,1A0,false,Tx,1,12,1,2,3,4,5,6,7,8,9,A,B,C",
            "7,1A0,false,Rx,1,0",
        ];
        let expected = ["5 can0 18FEF100#010203", "6 can1 1A0##00102030405060708090A0B0C", "7 can1 1A0#"];
        assert_eq!(good(FORMAT, &lines), expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("Time Stamp,ID,Extended", BadLine::NoFrame),
            ("", BadLine::NoTime),
            ("+5,1A0,false,Rx,0,0", BadLine::NoTime),
            ("-,1A0,false,Rx,0,0", BadLine::NoTime),
            ("99999999999999999999,1A0,false,Rx,0,0", BadLine::NoTime),
            ("5", BadLine::NoFrame),
            ("5,1A0,maybe,Rx,0,0", BadLine::NoFrame),
            ("5,1G0,false,Rx,0,0", BadLine::BadId),
            ("5,800,false,Rx,0,0", BadLine::BadId),
            ("5,1A0,false,Rx,x,0", BadLine::NoInterface),
            ("5,1A0,false,Rx,0", BadLine::BadLength),
            ("5,1A0,false,Rx,0,9,1,2,3,4,5,6,7,8,9", BadLine::BadLength),
            ("5,1A0,false,Rx,0,65", BadLine::BadLength),
            ("5,1A0,false,Rx,0,2,00", BadLine::BadData),
            ("5,1A0,false,Rx,0,1,zz", BadLine::BadData),
        ];
        assert_refused(FORMAT, &[HEADING], &cases);
    }

    #[test]
    fn a_counter_of_32_bits_wraps_and_a_wide_one_does_not() {
        let mut counter = TimeCounter::new(NARROW * 1000);
        let values = [NARROW - 1, 5].map(|micros| counter.since_start(micros * 1000));
        assert_eq!(values, [(NARROW - 1) * 1000, (NARROW + 5) * 1000]);
        let mut counter = TimeCounter::new(NARROW * 1000);
        for micros in [3 * NARROW, 5, 1_700_000_000_000_000] {
            assert_eq!(counter.since_start(micros * 1000), micros * 1000);
        }
        assert_eq!(counter.since_start(i64::MIN), i64::MIN);
    }

    #[test]
    fn the_upper_half_of_a_counter_may_be_negative() {
        let half = NARROW / 2;
        let mut counter = TimeCounter::new(NARROW * 1000);
        let values =
            [half - 1, -half, -half + 7, -1, 3].map(|micros| counter.since_start(micros * 1000) / 1000);
        assert_eq!(values, [half - 1, half, half + 7, NARROW - 1, NARROW + 3]);
        let lines = good(
            FORMAT,
            &[HEADING, "-1000,1A0,false,Rx,0,0", "-400,1A0,false,Rx,0,0", "600,1A0,false,Rx,0,0"],
        );
        let start = NARROW - 1000;
        let expected = [start, start + 600, start + 1600].map(|micros| format!("{micros} can0 1A0#"));
        assert_eq!(lines, expected);
    }
}
