//! The CSV format of comma's cabana, which panda's scripts also read and write.
//!
//! ```text
//! time,addr,bus,data
//! 240.479,0x1A0,0,0x0ACC0ADE
//! 0.06194250166663551,308,0,08007c630a00d064
//! ```
//! Newer versions write identifier and data with `0x` (`exportToCSV` in openpilot's
//! `tools/cabana/utils/export.cc`); older versions wrote the identifier in decimal and data without a prefix
//! (panda's `can_replay.py`). So an identifier without `0x` is decimal. The format does not state the kind of
//! frame: an identifier above `7FF` has 29 bits, more than eight bytes are CAN FD. Time is in seconds since
//! the start of the route. A bus number from 128 on marks frames sent by panda itself.

use crate::clock::SECOND;
use crate::entry::{BadLine, LogEntry};
use crate::fields::{columns, id, number, packed_frame, text};
use crate::format::{EachLine, LineFormat, Outcome};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "cabana CSV",
    claims: is_heading,
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(EachLine { unit_ns, read }),
};

fn is_heading(line: &[u8]) -> bool {
    line.eq_ignore_ascii_case(b"time,addr,bus,data")
}

fn read(line: &[u8], unit_ns: i64) -> Outcome<'_> {
    if is_heading(line) {
        return Ok(None);
    }
    let mut fields = columns(text(line)?, 0);
    let nanos = fields.time(unit_ns)?;
    let identifier = fields.text(BadLine::NoFrame)?;
    let number = match identifier.strip_prefix("0x") {
        Some(digits) => number(digits, 16),
        None => number(identifier, 10),
    };
    let number = number.ok_or(BadLine::BadId)?;
    let id = id(number, number > 0x7FF)?;
    let bus = fields.channel()?;
    let data = fields.text(BadLine::BadData)?;
    let digits = data.strip_prefix("0x").unwrap_or(data);
    fields.end()?;
    Ok(Some(LogEntry::numbered(nanos, bus, packed_frame(id, digits.len() > 16, digits)?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn old_and_new_lines_are_read() {
        let lines = good(
            FORMAT,
            &[
                "time,addr,bus,data",
                "240.479,0x1a0,0,0x0ACC",
                "0.06194250166663551,308,128,08007c630a00d064",
                "1.0,0x18FEF100,1,0x",
                "2.0,416,2,000102030405060708090a0b",
            ],
        );
        let expected = [
            "240479000 can0 1A0#0ACC",
            "61942 can128 134#08007C630A00D064",
            "1000000 can1 18FEF100#",
            "2000000 can2 1A0##0000102030405060708090A0B",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("x,416,0,00", BadLine::NoTime),
            ("1.0", BadLine::NoFrame),
            ("1.0,1a0,0,00", BadLine::BadId),
            ("1.0,0x20000000,0,00", BadLine::BadId),
            ("1.0,416,x,00", BadLine::NoInterface),
            ("1.0,416,0", BadLine::BadData),
            ("1.0,416,0,0", BadLine::BadData),
            ("1.0,416,0,zz", BadLine::BadData),
            ("1.0,416,0,00,1", BadLine::BadLength),
            ("1.0,416,0,000102030405060708", BadLine::BadLength),
        ];
        assert_refused(FORMAT, &["time,addr,bus,data"], &cases);
    }
}
