//! The CSV format of python-can (`can.CSVWriter`).
//!
//! ```text
//! timestamp,arbitration_id,extended,remote,error,dlc,data
//! 1483389946.197,0xdadada,1,0,0,6,WzQyLCA5XQ==
//! ```
//! The time is in seconds since 1970, data is Base64. The format does not name buses, so all frames belong to
//! `can0`; nor does it state whether a frame of up to eight bytes was CAN FD, so it is read as a classic
//! frame.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::clock::SECOND;
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{bus_error, columns, data_frame, id, number, text};
use crate::format::{EachLine, LineFormat, Outcome, begins};
use can_signal::can::MAX_DATA;

const HEADING: &str = "timestamp,arbitration_id,extended,remote,error,dlc,data";

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "python-can CSV",
    claims: |line| begins(line, &[HEADING]),
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(EachLine { unit_ns, read }),
};

fn read(line: &[u8], unit_ns: i64) -> Outcome<'_> {
    if begins(line, &[HEADING]) {
        return Ok(None);
    }
    let mut fields = columns(text(line)?, 0);
    let nanos = fields.time(unit_ns)?;
    let identifier = fields.text(BadLine::NoFrame)?;
    let number = identifier.strip_prefix("0x").and_then(|digits| number(digits, 16));
    let mut flag = || match fields.next() {
        Some("0") => Ok(false),
        Some("1") => Ok(true),
        _ => Err(BadLine::NoFrame),
    };
    let (extended, remote, error) = (flag()?, flag()?, flag()?);
    let content = if error {
        bus_error()
    } else {
        let id = id(number.ok_or(BadLine::BadId)?, extended)?;
        let length = fields.length()?;
        if remote { EntryContent::Remote } else { data(id, length, fields.text(BadLine::BadData)?)? }
    };
    Ok(Some(LogEntry::numbered(nanos, 0, content)))
}

fn data(id: can_signal::can::frame::CanId, length: usize, text: &str) -> Result<EntryContent, BadLine> {
    // The decoder requires space for whole groups of three bytes.
    let mut bytes = [0; MAX_DATA + 3];
    let decoded = STANDARD.decode_slice(text, &mut bytes).map_err(|_| BadLine::BadData)?;
    if decoded != length {
        return Err(BadLine::BadLength);
    }
    data_frame(id, length > 8, &bytes[..length])
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
                HEADING,
                "1483389946.197,0x1a0,0,0,0,3,AQL/",
                "1483389946.2,0x18fef100,1,0,0,0,",
                "1483389946.3,0x1a0,0,1,0,8,",
                "1483389946.4,0x0,1,0,1,0,",
                "1483389946.5,0x1a0,0,0,0,12,AAECAwQFBgcICQoL",
            ],
        );
        let expected = [
            "1483389946197000 can0 1A0#0102FF",
            "1483389946200000 can0 18FEF100#",
            "1483389946300000 can0 Remote",
            "1483389946400000 can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })",
            "1483389946500000 can0 1A0##0000102030405060708090A0B",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let long = format!("1.0,0x1a0,0,0,0,64,{}", "A".repeat(1000));
        let cases = [
            ("x,0x1a0,0,0,0,0,", BadLine::NoTime),
            ("1.0", BadLine::NoFrame),
            ("1.0,0x1a0,2,0,0,0,", BadLine::NoFrame),
            ("1.0,1a0,0,0,0,0,", BadLine::BadId),
            ("1.0,0x800,0,0,0,0,", BadLine::BadId),
            ("1.0,0x1a0,0,0,0,x,", BadLine::BadLength),
            ("1.0,0x1a0,0,0,0,2,AQL/", BadLine::BadLength),
            ("1.0,0x1a0,0,0,0,9,AAECAwQFBgcI", BadLine::BadLength),
            ("1.0,0x1a0,0,0,0,3,AQL", BadLine::BadData),
            ("1.0,0x1a0,0,0,0,3", BadLine::BadData),
            (&long, BadLine::BadData),
        ];
        assert_refused(FORMAT, &[HEADING], &cases);
    }
}
