//! The scanner shared by the text formats: reads fields of a line as times, channels, identifiers and data.

use std::str::SplitAsciiWhitespace;

use crate::entry::{BadLine, EntryContent};
use can_signal::can::error_frame::class;
use can_signal::can::{CanId, ErrorFrame, Frame, MAX_DATA};

/// The fields of a line, from left to right. A missing or malformed field gives the [`BadLine`] of its kind.
#[derive(Clone)]
pub(super) struct LineFields<I> {
    fields: I,
    /// Radix of identifiers and data.
    pub(super) radix: u32,
}

pub(super) type SpacedFields<'a> = LineFields<SplitAsciiWhitespace<'a>>;

/// Splits a line at white space.
pub(super) fn fields(line: &str, radix: u32) -> SpacedFields<'_> {
    LineFields { fields: line.split_ascii_whitespace(), radix }
}

/// Splits a line at commas, starting with the field at `column`; data is hexadecimal.
pub(super) fn columns(line: &str, column: usize) -> LineFields<impl Iterator<Item = &str>> {
    LineFields { fields: line.split(',').skip(column).map(str::trim), radix: 16 }
}

impl<'a, I: Iterator<Item = &'a str>> Iterator for LineFields<I> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        self.fields.next()
    }
}

impl<'a, I: Iterator<Item = &'a str>> LineFields<I> {
    /// Reads any field; `missing` is the error if there is none.
    pub(super) fn text(&mut self, missing: BadLine) -> Result<&'a str, BadLine> {
        self.next().ok_or(missing)
    }

    /// Reads a decimal number in units of `unit_ns`, and returns ns.
    pub(super) fn time(&mut self, unit_ns: i64) -> Result<i64, BadLine> {
        self.next().and_then(|field| decimal(field, unit_ns)).ok_or(BadLine::NoTime)
    }

    pub(super) fn channel(&mut self) -> Result<u32, BadLine> {
        self.next().and_then(|field| number(field, 10)).ok_or(BadLine::NoInterface)
    }

    pub(super) fn length(&mut self) -> Result<usize, BadLine> {
        let length = self.next().and_then(|field| number(field, 10));
        length.and_then(|length| usize::try_from(length).ok()).ok_or(BadLine::BadLength)
    }

    /// Reads `length` fields as the bytes of a data frame.
    pub(super) fn data_frame(&mut self, id: CanId, fd: bool, length: usize) -> Result<EntryContent, BadLine> {
        let mut bytes = [0; MAX_DATA];
        for byte in bytes.get_mut(..length).ok_or(BadLine::BadLength)? {
            let field = self.fields.next().and_then(|field| number(field, self.radix));
            *byte = field.and_then(|field| u8::try_from(field).ok()).ok_or(BadLine::BadData)?;
        }
        data_frame(id, fd, &bytes[..length])
    }

    /// Returns the number of remaining fields that are bytes, up to the first other field.
    pub(super) fn byte_count(&self) -> usize
    where
        I: Clone,
    {
        let is_byte = |field: &&str| number(field, self.radix).is_some_and(|byte| byte <= 0xFF);
        self.fields.clone().take_while(is_byte).count()
    }

    /// Fails if fields remain.
    pub(super) fn end(&mut self) -> Result<(), BadLine> {
        if self.next().is_none() { Ok(()) } else { Err(BadLine::BadLength) }
    }
}

pub(super) fn text(line: &[u8]) -> Result<&str, BadLine> {
    std::str::from_utf8(line).map_err(|_| BadLine::NotText)
}

/// Returns the fields before the first bytes that are not text, since comments may use any character set.
pub(super) fn text_before_comment(line: &[u8]) -> &str {
    text(line).unwrap_or_else(|_| {
        let valid = line.utf8_chunks().next().map_or("", |chunk| chunk.valid());
        // Characters directly before them belong to the same field.
        valid.rfind([' ', '\t']).map_or("", |end| &valid[..end])
    })
}

/// Parses an unsigned number without sign or prefix.
pub(super) fn number(field: &str, radix: u32) -> Option<u32> {
    // from_str_radix would accept a sign.
    field.bytes().all(|byte| byte.is_ascii_alphanumeric()).then(|| u32::from_str_radix(field, radix).ok())?
}

/// Parses a number such as `12` or `12.345` in units of `unit_ns`, and returns ns; further digits are cut
/// off.
pub(super) fn decimal(field: &str, unit_ns: i64) -> Option<i64> {
    let (whole, fraction) = field.split_once('.').unwrap_or((field, "0"));
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(whole) || !digits(fraction) {
        return None;
    }
    let fraction = &fraction[..fraction.len().min(18)];
    let scale = 10_i128.pow(u32::try_from(fraction.len()).ok()?);
    let part = i128::from(fraction.parse::<i64>().ok()?) * i128::from(unit_ns) / scale;
    whole.parse::<i64>().ok()?.checked_mul(unit_ns)?.checked_add(i64::try_from(part).ok()?)
}

pub(super) fn id(number: u32, extended: bool) -> Result<CanId, BadLine> {
    if extended { CanId::extended(number) } else { CanId::standard(number) }.ok_or(BadLine::BadId)
}

/// Returns the number of data bytes for a DLC; `None` above 15. A classic frame with a DLC above 8 still has
/// 8 bytes.
pub(super) fn length_of_dlc(dlc: u32, fd: bool) -> Option<usize> {
    const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
    let length = *LENGTHS.get(usize::try_from(dlc).ok()?)?;
    Some(if fd { length } else { length.min(8) })
}

pub(super) fn data_frame(id: CanId, fd: bool, data: &[u8]) -> Result<EntryContent, BadLine> {
    let frame = if fd { Frame::fd(id, data) } else { Frame::classic(id, data) };
    frame.map(EntryContent::Data).ok_or(BadLine::BadLength)
}

/// Reads a data frame whose bytes are written as pairs of hexadecimal digits without separators.
pub(super) fn packed_frame(id: CanId, fd: bool, digits: &str) -> Result<EntryContent, BadLine> {
    let (pairs, []) = digits.as_bytes().as_chunks::<2>() else { return Err(BadLine::BadData) };
    let mut bytes = [0; MAX_DATA];
    let data = bytes.get_mut(..pairs.len()).ok_or(BadLine::BadLength)?;
    for (byte, pair) in data.iter_mut().zip(pairs) {
        let value = text(pair).ok().and_then(|pair| number(pair, 16));
        *byte = value.and_then(|value| u8::try_from(value).ok()).ok_or(BadLine::BadData)?;
    }
    data_frame(id, fd, data)
}

/// Returns the error frame for a recording that does not state the kind of error: a protocol violation.
pub(super) fn bus_error() -> EntryContent {
    EntryContent::Error(ErrorFrame::new(class::PROTOCOL | class::BUS_ERROR, &[]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_scale_exactly_and_never_overflow() {
        assert_eq!(decimal("1.2", 1_000_000), Some(1_200_000));
        assert_eq!(decimal("12", 1_000_000_000), Some(12_000_000_000));
        assert_eq!(decimal("0.5", 86_400_000_000_000), Some(43_200_000_000_000));
        assert_eq!(decimal("0.9999999999999999999999", 1000), Some(999));
        for field in
            ["", ".", "1.", ".5", "-1", "+1", "1e3", "99999999999999999999", "9223372036854.9", "1.2.3"]
        {
            assert_eq!(decimal(field, 1_000_000_000), None, "{field}");
        }
    }

    #[test]
    fn numbers_have_no_sign() {
        assert_eq!(number("fF", 16), Some(255));
        for field in ["+1", "-1", "", "0x1", "100000000"] {
            assert_eq!(number(field, 16), None, "{field}");
        }
    }
}
