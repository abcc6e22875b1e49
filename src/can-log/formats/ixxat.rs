//! IXXAT canAnalyser traces as CSV.
//!
//! ```text
//! ASCII Trace IXXAT canAnalyser V2.8
//! Date: 12:3:2010
//! "Time","Identifier (hex)","Format","Flags","Data (hex)"
//! "00:01:03.03","223","Std","","00 00 00 00 49 00 00 01 "
//! ```
//! The times are times of day or begin with the trace; no file states which, so the date is not used. Only
//! frames without flags are supported. There is one bus. See `loadIXXATFile` of `SavvyCAN`.

use crate::clock::{DAY, WrappingClock, time_of_day};
use crate::entry::{BadLine, LogEntry};
use crate::fields::{columns, fields, id, number, text};
use crate::format::{LineFormat, LineReader, Outcome, begins};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "IXXAT CSV",
    claims: |line| begins(line, &["ASCII Trace IXXAT"]),
    unit_ns: None,
    reader: |_| Box::new(Ixxat(WrappingClock::new(DAY, 0))),
};

struct Ixxat(WrappingClock);

impl LineReader for Ixxat {
    fn read<'a>(&mut self, line: &'a [u8]) -> Outcome<'a> {
        if !line.starts_with(b"\"") {
            return Ok(None);
        }
        let mut columns = columns(text(line)?, 0).map(|field| field.trim_matches('"'));
        let mut next = || columns.next().unwrap_or_default();
        let (time, identifier, form, flags, data) = (next(), next(), next(), next(), next());
        if time == "Time" {
            let is_known = identifier.contains("(hex)") && data.contains("(hex)");
            return if is_known { Ok(None) } else { Err(BadLine::NoFrame) };
        }
        let is_extended = match form {
            "Std" => false,
            "Ext" => true,
            _ => return Err(BadLine::NoFrame),
        };
        if !flags.trim().is_empty() {
            return Err(BadLine::NoFrame);
        }
        let nanos = self.0.since_start(time_of_day(time).ok_or(BadLine::NoTime)?);
        let id = id(number(identifier, 16).ok_or(BadLine::BadId)?, is_extended)?;
        let length = data.split_ascii_whitespace().count();
        let content = fields(data, 16).data_frame(id, length > 8, length)?;
        Ok(Some(LogEntry::numbered(nanos, 0, content)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn frames_are_read_and_midnight_is_passed() {
        let lines = [
            "ASCII Trace IXXAT canAnalyser V2.8",
            "Date: 12:3:2010",
            "\"Time\",\"Identifier (hex)\",\"Format\",\"Flags\",\"Data (hex)\"",
            "\"00:01:03.03\",\"223\",\"Std\",\"\",\"00 49 01 \"",
            "\"23:59:59.5\",\"18FEF100\",\"Ext\",\"\",\"\"",
            "\"0:00:00.5\",\"00000123\",\"Std\",\"\",\"FF\"",
        ];
        let expected = ["63030000 can0 223#004901", "86399500000 can0 18FEF100#", "86400500000 can0 123#FF"];
        assert_eq!(good(FORMAT, &lines), expected);
    }

    #[test]
    fn what_is_not_known_is_not_read() {
        assert_refused(
            FORMAT,
            &[],
            &[
                ("\"Time\",\"Identifier (dec)\",\"Format\",\"Flags\",\"Data (hex)\"", BadLine::NoFrame),
                ("\"00:01:03.03\",\"223\",\"Std\",\"Rtr\",\"\"", BadLine::NoFrame),
                ("\"00:01:03.03\",\"223\",\"\",\"\",\"\"", BadLine::NoFrame),
                ("\"63.03\",\"223\",\"Std\",\"\",\"\"", BadLine::NoTime),
                ("\"00:01:03.03\",\"823\",\"Std\",\"\",\"\"", BadLine::BadId),
                ("\"00:01:03.03\",\"223\",\"Std\",\"\",\"1FF\"", BadLine::BadData),
            ],
        );
    }
}
