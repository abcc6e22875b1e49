//! What the text formats have in common: numbers, identifiers and payloads written as words.

use crate::core::can::error_frame::{ErrorFrame, class};
use crate::core::can::frame::{CanId, Frame, MAX_DATA};
use crate::io::can::candump::{BadLine, Content};

/// A controller saw the bus break a rule: all that a plain "error frame" says.
pub(super) fn bus_error() -> Content {
    Content::Error(ErrorFrame::new(class::PROTOCOL | class::BUS_ERROR, &[]))
}

/// The line as text.
pub(super) fn text(line: &[u8]) -> Result<&str, BadLine> {
    std::str::from_utf8(line).map_err(|_| BadLine::NotText)
}

/// An unsigned number without sign or prefix.
pub(super) fn number(word: &str, radix: u32) -> Option<u32> {
    word.bytes().all(|byte| byte.is_ascii_alphanumeric()).then(|| u32::from_str_radix(word, radix).ok())?
}

/// `12` or `12.345` units of `nanos` each, in nanoseconds, digits beyond them cut off.
pub(super) fn decimal(word: &str, nanos: i64) -> Option<i64> {
    let (whole, fraction) = word.split_once('.').unwrap_or((word, "0"));
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(whole) || !digits(fraction) {
        return None;
    }
    let fraction = &fraction[..fraction.len().min(18)];
    let scale = 10_i128.pow(u32::try_from(fraction.len()).ok()?);
    let part = fraction.parse::<i128>().ok()? * i128::from(nanos) / scale;
    whole.parse::<i64>().ok()?.checked_mul(nanos)?.checked_add(i64::try_from(part).ok()?)
}

/// An identifier in range.
pub(super) fn id(number: u32, extended: bool) -> Result<CanId, BadLine> {
    if extended { CanId::extended(number) } else { CanId::standard(number) }.ok_or(BadLine::BadId)
}

/// The bytes of an FD frame with this DLC.
pub(super) fn fd_length(dlc: u32) -> Option<usize> {
    const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
    LENGTHS.get(usize::try_from(dlc).ok()?).copied()
}

/// A data frame with the next `length` words as its bytes; later words stay where they are.
pub(super) fn data_frame<'a>(
    id: CanId,
    fd: bool,
    length: usize,
    words: &mut impl Iterator<Item = &'a str>,
    radix: u32,
) -> Result<Content, BadLine> {
    let mut bytes = [0; MAX_DATA];
    for byte in bytes.get_mut(..length).ok_or(BadLine::BadLength)? {
        let word = words.next().and_then(|word| number(word, radix)).ok_or(BadLine::BadData)?;
        *byte = u8::try_from(word).map_err(|_| BadLine::BadData)?;
    }
    frame(id, fd, &bytes[..length])
}

/// A data frame, if there can be one of this length.
pub(super) fn frame(id: CanId, fd: bool, data: &[u8]) -> Result<Content, BadLine> {
    let frame = if fd { Frame::fd(id, data) } else { Frame::classic(id, data) };
    frame.map(Content::Data).ok_or(BadLine::BadLength)
}

/// An error if words are left behind the data.
pub(super) fn nothing_more<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<(), BadLine> {
    if words.next().is_none() { Ok(()) } else { Err(BadLine::BadLength) }
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
        for word in
            ["", ".", "1.", ".5", "-1", "+1", "1e3", "99999999999999999999", "9223372036854.9", "1.2.3"]
        {
            assert_eq!(decimal(word, 1_000_000_000), None, "{word}");
        }
    }

    #[test]
    fn numbers_have_no_sign() {
        assert_eq!(number("fF", 16), Some(255));
        for word in ["+1", "-1", "", "0x1", "100000000"] {
            assert_eq!(number(word, 16), None, "{word}");
        }
    }
}
