//! SavvyCAN and GVRET CSV.
//!
//! ```text
//! Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8
//! 166064000,0000021A,false,Rx,0,3,FE,36,12,,,,,
//! ```
//! The heading names the columns (`Dir` came later) and may come again. Data columns
//! beyond the length do not count. More than eight bytes are a CAN FD frame.
//!
//! # Time
//! Microseconds, of the recorder's 32-bit counter in GVRET files: it begins again at zero after
//! 71.6 minutes. A step back by more than half of that is taken for such a turn, and what lies
//! within [`LATE`] of it on its other side belongs there: the buses are written in blocks, so lines
//! are not quite in order. Other steps back stay what they are. A file that has shown a value
//! beyond 32 bits has a counter that does not turn.

use super::words::{data_frame, id, number, text};
use super::{Entry, Interface, Lines};
use crate::core::time::WallStamp;
use crate::io::can::candump::BadLine;

/// The longest delay of a line, µs.
pub const LATE: u64 = 10_000_000;

/// The columns of the heading, and the counter.
#[derive(Debug, Default)]
pub struct Csv {
    columns: Columns,
    counter: Counter,
}

/// Position of each column; the data is behind all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns {
    time: usize,
    id: usize,
    extended: usize,
    bus: usize,
    length: usize,
    data: usize,
}

impl Default for Columns {
    /// Those of the first GVRET files.
    fn default() -> Self {
        Self { time: 0, id: 1, extended: 2, bus: 3, length: 4, data: 5 }
    }
}

impl Columns {
    fn of_heading(heading: &str) -> Option<Self> {
        let place =
            |name: &str| heading.split(',').position(|column| column.trim().eq_ignore_ascii_case(name));
        let (time, id) = (place("Time Stamp")?, place("ID")?);
        let (extended, bus, length) = (place("Extended")?, place("Bus")?, place("LEN")?);
        let data = place("D1").unwrap_or(length + 1);
        let last = time.max(id).max(extended).max(bus).max(length);
        (last < data).then_some(Self { time, id, extended, bus, length, data })
    }
}

/// Microseconds of a counter that may have 32 bits only.
#[derive(Debug, Default)]
struct Counter {
    newest: u64,
    /// Microseconds of the turns so far.
    turned: u64,
    /// Whether a value has come that 32 bits cannot hold.
    wide: bool,
}

const TURN: u64 = 1 << 32;

impl Counter {
    /// Microseconds since the counter stood at zero first.
    fn unwrapped(&mut self, value: u64) -> u64 {
        self.wide |= value >= TURN;
        if self.wide {
            return value;
        }
        if value + TURN / 2 < self.newest {
            self.turned = self.turned.saturating_add(TURN);
        } else if self.turned > 0 && value + LATE >= TURN && self.newest < LATE {
            // From before the turn; the newest value stays.
            return self.turned.saturating_sub(TURN).saturating_add(value);
        }
        self.newest = value;
        self.turned.saturating_add(value)
    }
}

impl Lines for Csv {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine> {
        if line.get(..10).is_some_and(|start| start.eq_ignore_ascii_case(b"Time Stamp")) {
            self.columns = Columns::of_heading(text(line)?).ok_or(BadLine::NoFrame)?;
            return Ok(None);
        }
        let (time, entry) = parse_line(line, self.columns)?;
        let micros = i64::try_from(self.counter.unwrapped(time)).unwrap_or(i64::MAX);
        Ok(Some(Entry { stamp: WallStamp::from_nanos(micros.saturating_mul(1000)), ..entry }))
    }
}

/// Reads one line: the counter's value, µs, and the entry with a stamp that is still to be made.
///
/// # Errors
/// The reason why it cannot be read.
pub fn parse_line(line: &[u8], columns: Columns) -> Result<(u64, Entry<'_>), BadLine> {
    let text = text(line)?;
    let word = |column: usize| text.split(',').nth(column).unwrap_or("").trim();
    let time = word(columns.time);
    let time = time.bytes().all(|byte| byte.is_ascii_digit()).then(|| time.parse::<u64>().ok()).flatten();
    let time = time.ok_or(BadLine::NoTime)?;
    let extended = match word(columns.extended) {
        extended if extended.eq_ignore_ascii_case("true") || extended == "1" => true,
        extended if extended.eq_ignore_ascii_case("false") || extended == "0" => false,
        _ => return Err(BadLine::NoFrame),
    };
    let written = word(columns.id);
    let digits = written.strip_prefix("0x").unwrap_or(written);
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, extended)?;
    let bus = number(word(columns.bus), 10).ok_or(BadLine::NoInterface)?;
    let length = number(word(columns.length), 10).and_then(|length| usize::try_from(length).ok());
    let length = length.ok_or(BadLine::BadLength)?;
    let mut data = text.split(',').skip(columns.data).map(str::trim);
    let content = data_frame(id, length > 8, length, &mut data, 16)?;
    Ok((time, Entry { stamp: WallStamp::default(), interface: Interface::Numbered(bus), content }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::can::candump::Content;

    const HEADING: &str = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8";

    fn read(lines: &[&str]) -> Vec<Result<String, BadLine>> {
        let mut csv = Csv::default();
        lines
            .iter()
            .filter_map(|line| csv.read(line.as_bytes()).transpose())
            .map(|entry| {
                entry.map(|Entry { stamp, interface, content }| match content {
                    Content::Data(frame) => format!("{} {interface} {frame}", stamp.as_nanos() / 1000),
                    other @ (Content::Remote | Content::Error(_) | Content::Note(_)) => panic!("{other:?}"),
                })
            })
            .collect()
    }

    #[test]
    fn columns_are_found_by_their_heading() {
        assert_eq!(read(&["5,000001A0,false,1,2,01,fF,00,"]), [Ok("5 can1 1A0#01FF".into())]);
        let lines = [
            HEADING,
            "5,18FEF100,true,Rx,0,3,01,02,03,,,,,,",
            "6,1A0,false,Tx,1,12,1,2,3,4,5,6,7,8,9,A,B,C",
            "7,1A0,false,Rx,1,0",
        ];
        let expected = ["5 can0 18FEF100#010203", "6 can1 1A0##00102030405060708090A0B0C", "7 can1 1A0#"];
        assert_eq!(read(&lines).into_iter().map(Result::unwrap).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn every_way_to_break_a_line_has_its_reason() {
        for (line, reason) in [
            ("Time Stamp,ID,Extended", BadLine::NoFrame),
            ("", BadLine::NoTime),
            ("-5,1A0,false,Rx,0,0", BadLine::NoTime),
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
        ] {
            assert_eq!(read(&[HEADING, line]).pop(), Some(Err(reason)), "{line}");
        }
    }

    #[test]
    fn a_counter_of_32_bits_turns_and_late_lines_stay_on_their_side() {
        let mut counter = Counter::default();
        let values = [TURN - 50, TURN - 20, TURN - 30, 10, TURN - 5, 40, 30, TURN / 2, TURN - 1, 3];
        let expected = [
            TURN - 50,
            TURN - 20,
            TURN - 30,
            TURN + 10,
            TURN - 5,
            TURN + 40,
            TURN + 30,
            TURN + TURN / 2,
            2 * TURN - 1,
            2 * TURN + 3,
        ];
        assert_eq!(values.map(|value| counter.unwrapped(value)), expected);
    }

    #[test]
    fn a_wide_counter_never_turns() {
        let mut counter = Counter::default();
        for value in [3 * TURN, 5, 1_700_000_000_000_000] {
            assert_eq!(counter.unwrapped(value), value);
        }
    }
}
