//! CRTD, as written by OVMS.
//!
//! ```text
//! 1542473901.020305 CXX OVMS CAN log
//! 1542473901.020305 1R11 402 FA 01 C3
//! 1542473901.021 2T29 18FEF100 01
//! ```
//! The time is in seconds since 1970, or since the start of the module. `R` means received, `T` sent,
//! followed by 11 or 29 for the bits of the identifier; the digit before the letter is the bus number, 1 if
//! missing. Types that begin with `C` are comments, events and statistics.

use crate::clock::SECOND;
use crate::entry::{BadLine, LogEntry};
use crate::fields::{fields, id, number, text, text_before_comment};
use crate::format::{EachLine, LineFormat, Outcome};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "CRTD",
    claims: |line| read(line, SECOND).is_ok(),
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(EachLine { unit_ns, read }),
};

fn read(line: &[u8], unit_ns: i64) -> Outcome<'_> {
    let mut fields = fields(text_before_comment(line), 16);
    let nanos = fields.time(unit_ns)?;
    let kind = fields.text(BadLine::NoFrame)?;
    if kind.len() == 3 && kind.starts_with('C') && kind.bytes().all(|byte| byte.is_ascii_uppercase()) {
        return Ok(None);
    }
    text(line)?;
    let digits = kind.bytes().take_while(u8::is_ascii_digit).count();
    let (bus, kind) = kind.split_at(digits);
    let bus = if bus.is_empty() { 1 } else { number(bus, 10).ok_or(BadLine::NoInterface)? };
    let extended = match kind {
        "R11" | "T11" => false,
        "R29" | "T29" => true,
        _ => return Err(BadLine::NoFrame),
    };
    let id = id(fields.next().and_then(|field| number(field, 16)).ok_or(BadLine::BadId)?, extended)?;
    let length = fields.clone().count();
    let content = fields.data_frame(id, length > 8, length)?;
    Ok(Some(LogEntry::numbered(nanos, bus, content)))
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
                "169.000 CXX OVMS CRTD 3.1",
                "1542473901.020305 R11 1A0 01 02 fF",
                "1542473901.021 2T29 18FEF100",
                "1542473901.022 CEV vehicle.on",
                "1542473901.5 3R11 1A0 00 01 02 03 04 05 06 07 08 09 0A 0B",
            ],
        );
        let expected = [
            "1542473901020305 can1 1A0#0102FF",
            "1542473901021000 can2 18FEF100#",
            "1542473901500000 can3 1A0##0000102030405060708090A0B",
        ];
        assert_eq!(lines, expected);
        assert_eq!(read(b"1.0 CXX caf\xE9", SECOND), Ok(None), "a comment in another character set");
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("", BadLine::NoTime),
            ("now R11 1A0", BadLine::NoTime),
            ("1.0", BadLine::NoFrame),
            ("1.0 R12 1A0", BadLine::NoFrame),
            ("1.0 CX 1A0", BadLine::NoFrame),
            ("1.0 99999999999R11 1A0", BadLine::NoInterface),
            ("1.0 1R11", BadLine::BadId),
            ("1.0 1R11 800", BadLine::BadId),
            ("1.0 1R29 20000000", BadLine::BadId),
            ("1.0 1R11 1A0 0g", BadLine::BadData),
            ("1.0 1R11 1A0 1 2 3 4 5 6 7 8 9", BadLine::BadLength),
        ];
        assert_refused(FORMAT, &[], &cases);
        assert_eq!(read(b"1.0 1R11 1A0 \xFF", SECOND), Err(BadLine::NotText));
    }
}
