//! CANHacker trace (`.trc`, a different format from PCAN's).
//!
//! ```text
//! Time   ID     DLC Data                    Comment
//! 18.876 070      8 00 B0 C8 64 9D B0 01 D6
//! 18,880 18FEF100 2 00 01
//! ```
//! An identifier of more than three digits has 29 bits. Text after the data is a comment; `RTR` in place of
//! the data is a remote request.
//!
//! # Time
//! Times are seconds with a point or comma, from an adapter's counter that restarts after 60 s. In a file
//! with a time of 60 s or more, the counter does not restart.

use crate::clock::{SECOND, TimeCounter};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{decimal, fields, id, number, text, text_before_comment};
use crate::format::{LineFormat, LineReader};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "CANHacker",
    claims: is_heading,
    unit_ns: None,
    reader: |_| Box::new(CanHacker(TimeCounter::new(60 * SECOND))),
};

#[derive(Debug)]
struct CanHacker(TimeCounter);

fn is_heading(line: &[u8]) -> bool {
    let Ok(line) = text(line) else { return false };
    line.split_ascii_whitespace().take(4).eq(["Time", "ID", "DLC", "Data"])
}

impl LineReader for CanHacker {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        if is_heading(line) {
            return Ok(None);
        }
        let mut fields = fields(text_before_comment(line), 16);
        let time = fields.text(BadLine::NoTime)?.replace(',', ".");
        let time = decimal(&time, SECOND).ok_or(BadLine::NoTime)?;
        let identifier = fields.text(BadLine::NoFrame)?;
        let id = id(number(identifier, 16).ok_or(BadLine::BadId)?, identifier.len() > 3)?;
        let length = fields.length()?;
        if length > 8 {
            return Err(BadLine::BadLength);
        }
        let is_remote = fields.clone().next().is_some_and(|field| field.eq_ignore_ascii_case("RTR"));
        let content = if is_remote { EntryContent::Remote } else { fields.data_frame(id, false, length)? };
        Ok(Some(LogEntry::numbered(self.0.since_start(time), 0, content)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    const HEADING: &str = "Time   ID     DLC Data                    Comment";

    #[test]
    fn every_kind_of_line_is_read() {
        let lines = good(
            FORMAT,
            &[HEADING, "00.000 1A0      3 01 02 fF ignition on", "18,880 18FEF100 0", "19.5 1A0 8 RTR"],
        );
        assert_eq!(lines, ["0 can0 1A0#0102FF", "18880000 can0 18FEF100#", "19500000 can0 Remote"]);
    }

    #[test]
    fn a_counter_of_a_minute_wraps_and_a_longer_one_does_not() {
        let lines = good(FORMAT, &["59.900 1A0 0", "00.100 1A0 0", "00.050 1A0 0"]);
        assert_eq!(lines, ["59900000 can0 1A0#", "60100000 can0 1A0#", "60050000 can0 1A0#"]);
        let lines = good(FORMAT, &["59.900 1A0 0", "60.100 1A0 0", "20.0 1A0 0"]);
        assert_eq!(lines, ["59900000 can0 1A0#", "60100000 can0 1A0#", "20000000 can0 1A0#"]);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("", BadLine::NoTime),
            ("soon 1A0 0", BadLine::NoTime),
            ("1.0", BadLine::NoFrame),
            ("1.0 1G0 0", BadLine::BadId),
            ("1.0 800 0", BadLine::BadId),
            ("1.0 20000000 0", BadLine::BadId),
            ("1.0 1A0", BadLine::BadLength),
            ("1.0 1A0 9 1 2 3 4 5 6 7 8 9", BadLine::BadLength),
            ("1.0 1A0 2 00", BadLine::BadData),
            ("1.0 1A0 1 100", BadLine::BadData),
        ];
        assert_refused(FORMAT, &[HEADING], &cases);
        let torn = FORMAT.usual_reader().read(b"1.0 1A0 2 01 0\xFF");
        assert_eq!(torn, Err(BadLine::BadData), "half a field is not a field");
        assert!(FORMAT.usual_reader().read(b"1.0 1A0 1 01 caf\xE9").is_ok(), "a comment");
    }
}
