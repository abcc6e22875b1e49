//! Two layouts without a name, as serial sniffers print them.
//!
//! ```text
//! 820298   0x085: 7C 33 80 00 47 E0 7C 7F
//! 02 00 00 05 F0 00 00 00
//! ```
//! The first: milliseconds, identifier, up to eight bytes; more than three digits are 29 bits.
//! The second has no time, so every stamp is the epoch: the length, four bytes of identifier (its
//! highest bit set for 29 bits), so many bytes of data, and a byte that is always 0. A line that was
//! cut or joined to the next has not the number of bytes that its length asks for, and is bad.

use super::words::{data_frame, decimal, id, nothing_more, number, text};
use super::{Entry, Interface, Lines};
use crate::core::time::WallStamp;
use crate::io::can::candump::{BadLine, Content};

/// Such lines have no headings.
#[derive(Debug, Clone, Copy)]
pub struct Plain;

impl Lines for Plain {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine> {
        parse_line(line).map(Some)
    }
}

/// Reads one line of either layout.
///
/// # Errors
/// The reason why it cannot be read.
pub fn parse_line(line: &[u8]) -> Result<Entry<'_>, BadLine> {
    let text = text(line)?;
    let (stamp, content) =
        if let Some((start, data)) = text.split_once(':') { timed(start, data)? } else { serial(text)? };
    Ok(Entry { stamp, interface: Interface::Numbered(0), content })
}

fn timed(start: &str, data: &str) -> Result<(WallStamp, Content), BadLine> {
    let (time, identifier) = start.split_once([' ', '\t']).ok_or(BadLine::NoTime)?;
    let nanos = decimal(time, 1_000_000).ok_or(BadLine::NoTime)?;
    let digits = identifier.trim().strip_prefix("0x").ok_or(BadLine::NoFrame)?;
    let id = id(number(digits, 16).ok_or(BadLine::BadId)?, digits.len() > 3)?;
    let mut words = data.split_ascii_whitespace();
    let length = words.clone().count();
    Ok((WallStamp::from_nanos(nanos), data_frame(id, false, length, &mut words, 16)?))
}

fn serial(text: &str) -> Result<(WallStamp, Content), BadLine> {
    let mut words = text.split_ascii_whitespace();
    let mut byte = || words.next().filter(|word| word.len() == 2).and_then(|word| number(word, 16));
    let length = byte().filter(|length| *length <= 8).ok_or(BadLine::BadLength)?;
    let identifier = (0..4).try_fold(0, |id, _| Some(id << 8 | byte()?)).ok_or(BadLine::BadId)?;
    let id = id(identifier & !(1 << 31), identifier >> 31 == 1)?;
    let length = usize::try_from(length).map_err(|_| BadLine::BadLength)?;
    let content = data_frame(id, false, length, &mut words, 16)?;
    if words.next() != Some("00") {
        return Err(BadLine::BadLength);
    }
    nothing_more(words)?;
    Ok((WallStamp::default(), content))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<String, BadLine> {
        parse_line(line.as_bytes()).map(|Entry { stamp, content, .. }| match content {
            Content::Data(frame) => format!("{} {frame}", stamp.as_nanos() / 1000),
            other @ (Content::Remote | Content::Error(_) | Content::Note(_)) => panic!("{other:?}"),
        })
    }

    #[test]
    fn both_layouts_are_read() {
        assert_eq!(read("820298   0x1A0: 01 02 fF").unwrap(), "820298000 1A0#0102FF");
        assert_eq!(read("1.5 0x18FEF100:").unwrap(), "1500 18FEF100#");
        assert_eq!(read("02 00 00 01 A0 01 02 00").unwrap(), "0 1A0#0102");
        assert_eq!(read("00 98 FE F1 00 00").unwrap(), "0 18FEF100#");
    }

    #[test]
    fn every_way_to_break_a_line_has_its_reason() {
        for (line, reason) in [
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
        ] {
            assert_eq!(read(line), Err(reason), "{line}");
        }
    }
}
