//! The car-hacking data sets of the Hacking and Countermeasure Research Lab (HCRL), both forms.
//!
//! ```text
//! 1478198376.389427,0316,8,05,21,68,09,21,21,00,6f,R
//! Timestamp: 1479121434.850202        ID: 0350    000    DLC: 8    05 28 84 66 6d 00 00 a2
//! ```
//! Time is in seconds since 1970; identifiers have four hexadecimal digits for 11 bits. The data of the first
//! form is followed by `R`, or by `T` for an injected frame; both were on the bus. The second form is the
//! text of a message in early versions of python-can; its flags are `000`, or `010` with eight digits for 29
//! bits. Other flags are bad. There is one bus.

use crate::clock::SECOND;
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{LineFields, columns, fields, id, number, text};
use crate::format::{EachLine, LineFormat, Outcome};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "HCRL data set",
    claims: |line| read(line, SECOND).is_ok(),
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(EachLine { unit_ns, read }),
};

fn read(line: &[u8], unit_ns: i64) -> Outcome<'_> {
    let line = text(line)?;
    let (nanos, content) = match line.strip_prefix("Timestamp:") {
        Some(rest) => named(fields(rest, 16), unit_ns)?,
        None => labelled(columns(line, 0), unit_ns)?,
    };
    Ok(Some(LogEntry::numbered(nanos, 0, content)))
}

fn labelled<'a>(
    mut fields: LineFields<impl Iterator<Item = &'a str>>,
    unit_ns: i64,
) -> Result<(i64, EntryContent), BadLine> {
    let nanos = fields.time(unit_ns)?;
    let content =
        frame(&mut fields, |_, is_extended| if is_extended { Err(BadLine::BadId) } else { Ok(()) })?;
    if !matches!(fields.next(), Some("R" | "T")) {
        return Err(BadLine::BadLength);
    }
    fields.end()?;
    Ok((nanos, content))
}

fn named<'a>(
    mut fields: LineFields<impl Iterator<Item = &'a str>>,
    unit_ns: i64,
) -> Result<(i64, EntryContent), BadLine> {
    let nanos = fields.time(unit_ns)?;
    expect(&mut fields, "ID:")?;
    let content = frame(&mut fields, |fields, is_extended| {
        expect(fields, if is_extended { "010" } else { "000" })?;
        expect(fields, "DLC:")
    })?;
    fields.end()?;
    Ok((nanos, content))
}

fn expect<'a>(fields: &mut LineFields<impl Iterator<Item = &'a str>>, expected: &str) -> Result<(), BadLine> {
    if fields.next() == Some(expected) { Ok(()) } else { Err(BadLine::NoFrame) }
}

/// Reads identifier, the field `between`, length and data.
fn frame<'a, I: Iterator<Item = &'a str>>(
    fields: &mut LineFields<I>,
    between: impl Fn(&mut LineFields<I>, bool) -> Result<(), BadLine>,
) -> Result<EntryContent, BadLine> {
    let digits = fields.text(BadLine::NoFrame)?;
    let is_extended = digits.len() == 8;
    let number = number(digits, 16).filter(|_| is_extended || digits.len() == 4).ok_or(BadLine::BadId)?;
    let id = id(number, is_extended)?;
    between(fields, is_extended)?;
    let length = fields.length()?;
    fields.data_frame(id, false, length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn both_forms_are_read() {
        let lines = good(
            FORMAT,
            &[
                "1478198376.389427,0316,8,05,21,68,09,21,21,00,6f,R",
                "1478198376.5,05f0,2,01,00,T",
                "Timestamp: 1479121434.850202        ID: 0350    000    DLC: 2    05 a2",
                "Timestamp: 1512572656.323818    ID: 18fef100    010    DLC: 1    1d",
            ],
        );
        let expected = [
            "1478198376389427 can0 316#052168092121006F",
            "1478198376500000 can0 5F0#0100",
            "1479121434850202 can0 350#05A2",
            "1512572656323818 can0 18FEF100#1D",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("x,0316,0,R", BadLine::NoTime),
            ("1.0", BadLine::NoFrame),
            ("1.0,316,0,R", BadLine::BadId),
            ("1.0,0800,0,R", BadLine::BadId),
            ("1.0,0316,x,R", BadLine::BadLength),
            ("1.0,0316,2,00,R", BadLine::BadData),
            ("1.0,0316,1,00,00,R", BadLine::BadLength),
            ("1.0,0316,1,00", BadLine::BadLength),
            ("1.0,0316,1,00,R,R", BadLine::BadLength),
            ("Timestamp: 1.0 ID: 0350 100 DLC: 0", BadLine::NoFrame),
            ("Timestamp: 1.0 ID: 0350 000 DLC: 1 00 00", BadLine::BadLength),
            ("Timestamp: 1.0 ID: 00000350 000 DLC: 0", BadLine::NoFrame),
            ("1.0,18fef100,0,R", BadLine::BadId),
            ("Timestamp: soon ID: 0350 000 DLC: 0", BadLine::NoTime),
        ];
        assert_refused(FORMAT, &[], &cases);
    }
}
