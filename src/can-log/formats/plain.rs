//! Two unnamed layouts printed by serial sniffers.
//!
//! ```text
//! 820298   0x085: 7C 33 80 00 47 E0 7C 7F
//! 02 00 00 05 F0 00 00 00
//! ```
//! The first has milliseconds, identifier, up to eight bytes; more than three digits mean 29 bits. The second
//! has no time, so every stamp is the epoch: the length, four bytes of identifier (highest bit set for 29
//! bits), the data bytes, and a byte that is always 0. A line that was cut or joined to the next has the
//! wrong number of bytes for its length, and is bad.

use crate::clock::SECOND;
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{SpacedFields, decimal, fields, id, number, text};
use crate::format::{EachLine, LineFormat, Outcome};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "serial sniffer",
    claims: |line| read(line, SECOND).is_ok(),
    unit_ns: Some(SECOND / 1000),
    reader: |unit_ns| Box::new(EachLine { unit_ns, read }),
};

fn read(line: &[u8], unit_ns: i64) -> Outcome<'_> {
    let text = text(line)?;
    let (nanos, content) = match text.split_once(':') {
        Some((start, data)) => timed(start, unit_ns, fields(data, 16))?,
        None => (0, serial(fields(text, 16))?),
    };
    Ok(Some(LogEntry::numbered(nanos, 0, content)))
}

fn timed(start: &str, unit_ns: i64, mut data: SpacedFields<'_>) -> Result<(i64, EntryContent), BadLine> {
    let (time, identifier) = start.split_once([' ', '\t']).ok_or(BadLine::NoTime)?;
    let nanos = decimal(time, unit_ns).ok_or(BadLine::NoTime)?;
    let digits = identifier.trim().strip_prefix("0x").ok_or(BadLine::NoFrame)?;
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, digits.len() > 3)?;
    let length = data.clone().count();
    Ok((nanos, data.data_frame(id, false, length)?))
}

fn serial(mut fields: SpacedFields<'_>) -> Result<EntryContent, BadLine> {
    let mut byte = || fields.next().filter(|field| field.len() == 2).and_then(|field| number(field, 16));
    let length = byte().filter(|length| *length <= 8).ok_or(BadLine::BadLength)?;
    let identifier = (0..4).try_fold(0, |id, _| Some(id << 8 | byte()?)).ok_or(BadLine::BadId)?;
    let id = id(identifier & !(1 << 31), identifier >> 31 == 1)?;
    let length = usize::try_from(length).map_err(|_| BadLine::BadLength)?;
    let content = fields.data_frame(id, false, length)?;
    if fields.next() != Some("00") {
        return Err(BadLine::BadLength);
    }
    fields.end()?;
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn both_layouts_are_read() {
        let lines = good(
            FORMAT,
            &["820298   0x1A0: 01 02 fF", "1.5 0x18FEF100:", "02 00 00 01 A0 01 02 00", "00 98 FE F1 00 00"],
        );
        let expected =
            ["820298000 can0 1A0#0102FF", "1500 can0 18FEF100#", "0 can0 1A0#0102", "0 can0 18FEF100#"];
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("", BadLine::BadLength),
            ("x 0x1A0: 01", BadLine::NoTime),
            ("0x1A0: 01", BadLine::NoTime),
            ("1 1A0: 01", BadLine::NoFrame),
            ("1 0xG: 01", BadLine::BadId),
            ("1 0x800: 01", BadLine::BadId),
            ("1 0x1A0: 1 2 3 4 5 6 7 8 9", BadLine::BadLength),
            ("1 0x1A0: zz", BadLine::BadData),
            ("09 00 00 01 A0 1 2 3 4 5 6 7 8 9 00", BadLine::BadLength),
            ("02 00 00", BadLine::BadId),
            ("02 00 00 08 00 01 02 00", BadLine::BadId),
            ("02 00 00 01 A0 01", BadLine::BadData),
            ("02 00 00 01 A0 01 02", BadLine::BadLength),
            ("02 00 00 01 A0 01 02 03", BadLine::BadLength),
            ("02 00 00 01 A0 01 02 00 00", BadLine::BadLength),
        ];
        assert_refused(FORMAT, &[], &cases);
    }
}
