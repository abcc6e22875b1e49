//! One line of a candump `-L` log: `(1436509052.249713) can0 044#2A366C2B`.
//!
//! Also read: CAN FD (`##`, flags digit), remote requests (`#R`), error frames (identifier bit 29),
//! a raw DLC (`_9` to `_F`), and the trailing ` R` / ` T` of newer versions. CAN XL is counted as
//! not supported. Lines that begin with `#` are comments; those of the black box are notes.

use std::fmt;

use crate::core::can::error_frame::ErrorFrame;
use crate::core::can::frame::{CanId, Frame, MAX_DATA};
use crate::core::can::note::Note;
use crate::core::time::WallStamp;

/// The longest line, bytes; a CAN FD frame needs 200.
pub const MAX_LINE: usize = 512;

/// A line that could be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line<'a> {
    /// Time of reception.
    pub stamp: WallStamp,
    /// Interface that received it.
    pub interface: &'a str,
    /// Content.
    pub content: Content,
}

/// The content of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// A data frame.
    Data(Frame),
    /// A remote request; carries no data.
    Remote,
    /// An error frame.
    Error(ErrorFrame),
    /// A note of the black box beside frames.
    Note(Note),
}

/// The reason why a line of a recording, in this format or [another](super::formats), cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BadLine {
    /// Longer than any line of the format.
    TooLong,
    /// Not text.
    NotText,
    /// No time where the format has it (here: `(seconds.fraction)` at the beginning).
    NoTime,
    /// No interface name or number where the format has it.
    NoInterface,
    /// No frame where the format has it (here: `ID#DATA`), or one of a kind it does not know.
    NoFrame,
    /// An identifier that is not written as the format does (here: 3 or 8 hexadecimal digits), or
    /// out of range.
    BadId,
    /// Data that is not bytes, or fewer than announced.
    BadData,
    /// A length that no frame has.
    BadLength,
    /// A CAN XL frame.
    CanXl,
}

impl fmt::Display for BadLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong => "too long for a line of a recording",
            Self::NotText => "not text",
            Self::NoTime => "the time is missing",
            Self::NoInterface => "the interface is missing",
            Self::NoFrame => "the frame is missing",
            Self::BadId => "invalid identifier",
            Self::BadData => "data is damaged or missing",
            Self::BadLength => "invalid data length",
            Self::CanXl => "CAN XL frames are not supported",
        })
    }
}

/// Reads one line, without its line end.
///
/// # Errors
/// The reason why it cannot be read.
pub fn parse_line(line: &[u8]) -> Result<Line<'_>, BadLine> {
    if line.len() > MAX_LINE {
        return Err(BadLine::TooLong);
    }
    let text = std::str::from_utf8(line).map_err(|_| BadLine::NotText)?;
    let mut words = text.split_ascii_whitespace();
    let stamp = words.next().and_then(time).ok_or(BadLine::NoTime)?;
    let interface = words.next().ok_or(BadLine::NoInterface)?;
    let (id, rest) = words.next().and_then(|word| word.split_once('#')).ok_or(BadLine::NoFrame)?;
    Ok(Line { stamp, interface, content: content(id, rest)? })
}

/// Reads a comment, `# (1436509052.249713) can0 link down`; `None` for one that is not a [`Note`].
pub fn parse_note(line: &[u8]) -> Option<Line<'_>> {
    let text = std::str::from_utf8(line.strip_prefix(b"#")?).ok()?;
    let mut words = text.split_ascii_whitespace();
    let stamp = words.next().and_then(time)?;
    let interface = words.next()?;
    Some(Line { stamp, interface, content: Content::Note(Note::parse(words)?) })
}

/// `(seconds.fraction)` with one to nine decimals.
fn time(word: &str) -> Option<WallStamp> {
    let (seconds, fraction) = word.strip_prefix('(')?.strip_suffix(')')?.split_once('.')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(seconds) || !digits(fraction) || fraction.len() > 9 {
        return None;
    }
    let seconds: i64 = seconds.parse().ok()?;
    let places = u32::try_from(fraction.len()).ok()?;
    let nanos = fraction.parse::<i64>().ok()? * 10_i64.pow(9 - places);
    Some(WallStamp::from_nanos(seconds.checked_mul(1_000_000_000)?.checked_add(nanos)?))
}

const EFF_FLAG: u32 = 0x8000_0000;
const ERR_FLAG: u32 = 0x2000_0000;

fn content(id: &str, rest: &str) -> Result<Content, BadLine> {
    let number = hex_number(id).ok_or(BadLine::BadId)?;
    let can_id = match id.len() {
        3 => CanId::standard(number),
        8 if number & ERR_FLAG != 0 => {
            let (bytes, length) = data(rest)?;
            let class = number & !(ERR_FLAG | EFF_FLAG);
            return Ok(Content::Error(ErrorFrame::new(class, &bytes[..length])));
        }
        8 => CanId::extended(number),
        _ => None,
    }
    .ok_or(BadLine::BadId)?;
    if let Some(fd) = rest.strip_prefix('#') {
        if fd.starts_with('#') {
            return Err(BadLine::CanXl);
        }
        // The first digit holds the FD flags (bit rate switch, error state), which nothing here needs.
        let payload = fd.strip_prefix(|flags: char| flags.is_ascii_hexdigit()).ok_or(BadLine::BadData)?;
        let (bytes, length) = data(payload)?;
        return Frame::fd(can_id, &bytes[..length]).map(Content::Data).ok_or(BadLine::BadLength);
    }
    if rest.starts_with(['R', 'r']) {
        return Ok(Content::Remote);
    }
    if rest.contains('#') {
        return Err(BadLine::CanXl);
    }
    let payload = match rest.split_once('_') {
        // A DLC above 8 is sent as it is, but the frame still has 8 bytes.
        Some((payload, dlc)) if matches!(hex_number(dlc), Some(9..=15)) => payload,
        Some(_) => return Err(BadLine::BadLength),
        None => rest,
    };
    let (bytes, length) = data(payload)?;
    Frame::classic(can_id, &bytes[..length]).map(Content::Data).ok_or(BadLine::BadLength)
}

fn hex_number(text: &str) -> Option<u32> {
    // from_str_radix would take a sign.
    if text.bytes().all(|byte| byte.is_ascii_hexdigit()) { u32::from_str_radix(text, 16).ok() } else { None }
}

fn data(text: &str) -> Result<([u8; MAX_DATA], usize), BadLine> {
    let mut bytes = [0; MAX_DATA];
    let pairs = text.as_bytes().chunks(2);
    let length = pairs.len();
    if length > MAX_DATA {
        return Err(BadLine::BadLength);
    }
    for (byte, pair) in bytes.iter_mut().zip(pairs) {
        let [high, low] = pair else { return Err(BadLine::BadData) };
        *byte = hex_digit(*high).zip(hex_digit(*low)).map(|(h, l)| h << 4 | l).ok_or(BadLine::BadData)?;
    }
    Ok((bytes, length))
}

fn hex_digit(char: u8) -> Option<u8> {
    match char {
        b'0'..=b'9' => Some(char - b'0'),
        b'a'..=b'f' => Some(char - b'a' + 10),
        b'A'..=b'F' => Some(char - b'A' + 10),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(line: &str) -> Frame {
        match parse_line(line.as_bytes()).unwrap().content {
            Content::Data(frame) => frame,
            other @ (Content::Remote | Content::Error(_) | Content::Note(_)) => panic!("{other:?}"),
        }
    }

    #[test]
    fn every_kind_of_line_is_read() {
        let line = parse_line(b"(1436509052.249713) vcan0 044#2A366C").unwrap();
        assert_eq!(line.stamp, WallStamp::from_nanos(1_436_509_052_249_713_000));
        assert_eq!(line.interface, "vcan0");
        assert_eq!(frame("(0.000001) can0 044#2A366C").to_string(), "044#2A366C");
        assert_eq!(frame("(0.000001) can0 0CFDCC27#ff00 R").id(), CanId::Extended(0x0CFD_CC27));
        assert_eq!(frame("(0.000001) can0 123##10102030405060708090A0B0C").data().len(), 12);
        assert_eq!(frame("(0.000001) can0 123#1122334455667788_F T").data().len(), 8);
        assert_eq!(frame("(0.000001) can0 123#").data().len(), 0);
        let remote = parse_line(b"(0.1) can0 123#R8").unwrap();
        assert_eq!((remote.content, remote.stamp.as_nanos()), (Content::Remote, 100_000_000));
        let error = parse_line(b"(0.1) can0 20000204#000800000000607F").unwrap();
        let warning = ErrorFrame::new(0x204, &[0, 8, 0, 0, 0, 0, 96, 127]);
        assert_eq!(error.content, Content::Error(warning));
    }

    #[test]
    fn every_way_to_break_a_line_has_its_reason() {
        for (line, reason) in [
            ("", BadLine::NoTime),
            ("(12) can0 123#00", BadLine::NoTime),
            ("(99999999999999999999.0) can0 123#00", BadLine::NoTime),
            ("(1.0)", BadLine::NoInterface),
            ("(1.0) can0", BadLine::NoFrame),
            ("(1.0) can0 12300", BadLine::NoFrame),
            ("(1.0) can0 12#00", BadLine::BadId),
            ("(1.0) can0 800#00", BadLine::BadId),
            ("(1.0) can0 +23#00", BadLine::BadId),
            ("(1.0) can0 123#0", BadLine::BadData),
            ("(1.0) can0 123#0G", BadLine::BadData),
            ("(1.0) can0 123##", BadLine::BadData),
            ("(1.0) can0 20000004#R", BadLine::BadData),
            ("(1.0) can0 123#112233445566778899", BadLine::BadLength),
            ("(1.0) can0 123##0112233445566778899", BadLine::BadLength),
            ("(1.0) can0 123#11_2", BadLine::BadLength),
            ("(1.0) can0 00000123#81:00:12345678#1122", BadLine::CanXl),
        ] {
            assert_eq!(parse_line(line.as_bytes()), Err(reason), "{line}");
        }
        assert_eq!(parse_line(&[b' '; 600]), Err(BadLine::TooLong));
        assert_eq!(parse_line(b"(1.0) can\xFF 123#"), Err(BadLine::NotText));
    }

    proptest! {
        #[test]
        fn what_a_frame_prints_is_what_is_read(
            id in 0..0x800_u32,
            extended in any::<bool>(),
            data in proptest::collection::vec(any::<u8>(), 0..=8),
            fd in any::<bool>(),
        ) {
            let id = if extended { CanId::extended(id) } else { CanId::standard(id) }.unwrap();
            let sent = if fd { Frame::fd(id, &data) } else { Frame::classic(id, &data) }.unwrap();
            prop_assert_eq!(frame(&format!("(1.5) can0 {sent}")), sent);
        }

        #[test]
        fn any_bytes_are_read_or_refused(line in proptest::collection::vec(any::<u8>(), 0..600)) {
            let _outcome = parse_line(&line);
        }
    }
}
