//! The output of candump with stamps: log lines (`-L`) and the long format (`-ta`).
//!
//! ```text
//! (1436509052.249713) can0 044#2A366C2B
//!  (1436509052.249713)  can0  044   [4]  2A 36 6C 2B
//! ```
//! From `-L` it also reads CAN FD (`##`, flags digit), remote requests (`#R`), error frames (identifier bit
//! 29), the flags for 29 bits and remote requests in an identifier of eight digits, as can-utils accepts
//! them; a raw DLC (`_9` to `_F`), and the trailing ` R` / ` T` of newer versions. From `-ta` it reads CAN FD
//! (a length of two digits), a raw DLC (`{F}`), `remote request`, and the flags of `-x`; bytes may be binary
//! (`-i`) or in reverse order (`-S`). Colours (`-c`), characters after the data (`-a`) and the explanation of
//! an error frame (`-e`) are skipped. CAN XL is counted as not supported. Lines that begin with `#` are
//! comments, or notes from the black box.
//!
//! Stamps may be padded and have a date (`-tA`). Stamps of `-tz` count from the start of the recording, so
//! they begin at the epoch. Stamps of `-td` are the time since the previous frame, cut to microseconds, and
//! are added up. They look like stamps of `-tz`, but fall again and again, so the beginning of a recording
//! distinguishes the two.

use memchr::memmem;

use super::candump_stamps::{stamped, uncoloured};
use crate::clock::SECOND;
use crate::entry::{BadLine, EntryContent, EntryInterface, LogEntry};
use crate::fields::{SpacedFields, data_frame, fields, length_of_dlc, number, text};
use crate::format::{LineFormat, LineReader, Outcome};
use can_signal::can::{CanId, ErrorFrame, Frame, LogNote, MAX_DATA};
use gateway_base::time::WallStamp;

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "candump (-L, -ta)",
    claims: |line| text(line).ok().and_then(stamped).is_some() || parse_note(line).is_some(),
    unit_ns: None,
    reader: |_| Box::new(Candump::default()),
};

/// The same format with `-td` stamps, which cannot be recognised from a single line.
pub(super) const DIFFERENCES: LineFormat = LineFormat {
    name: "candump -td",
    claims: |_| false,
    unit_ns: None,
    reader: |_| Box::new(Candump { sum: Some(WallStamp::default()), ..Candump::default() }),
};

/// Longest line, bytes; a CAN FD frame needs 200.
const MAX_LINE: usize = 512;

#[derive(Default)]
struct Candump {
    /// The sum of all stamps, if they are differences.
    sum: Option<WallStamp>,
    /// True if the next line may explain an error frame (`-e`).
    is_explained: bool,
}

impl LineReader for Candump {
    fn read<'a>(&mut self, line: &'a [u8]) -> Outcome<'a> {
        let is_explanation = std::mem::take(&mut self.is_explained);
        // Returned at once, since each copy of a frame costs as much as parsing some of its digits.
        if self.sum.is_none()
            && let Some(entry) = common_line(line)
        {
            return Ok(Some(entry));
        }
        let outcome = if line.starts_with(b"#") {
            Ok(parse_note(line))
        } else {
            match any_line(line) {
                Err(BadLine::NoTime) if is_explanation => Ok(None),
                outcome => {
                    self.is_explained = memmem::find(line, b"ERRORFRAME").is_some();
                    outcome.map(Some)
                }
            }
        };
        let Some(sum) = &mut self.sum else { return outcome };
        if let Some((difference, _)) = text(line).ok().and_then(stamped) {
            *sum = WallStamp::from_nanos(sum.as_nanos().saturating_add(difference.as_nanos()));
        }
        outcome.map(|entry| entry.map(|entry| LogEntry { stamp: *sum, ..entry }))
    }
}

/// Reads one line that is a frame or a note, without its line end.
pub fn parse_line(line: &[u8]) -> Result<LogEntry<'_>, BadLine> {
    Candump::default().read(line)?.ok_or(BadLine::NoTime)
}

/// Reads a classic data frame as `-L` writes it, much faster than [`any_line`]: long recordings have hardly
/// anything else. Returns `None` for all other lines.
fn common_line(line: &[u8]) -> Option<LogEntry<'_>> {
    let rest = line.strip_prefix(b"(")?;
    let (seconds, length) = leading::<10>(rest, 10);
    let rest = rest[length..].strip_prefix(b".")?;
    let (micros, places) = leading::<10>(rest, 6);
    if length == 0 || places != 6 {
        return None;
    }
    let (interface, rest) = until(rest[places..].strip_prefix(b") ")?, b' ')?;
    let (id, digits) = leading::<16>(rest, 8);
    let id = match digits {
        3 => CanId::standard(u32::try_from(id).ok()?)?,
        8 => CanId::extended(u32::try_from(id).ok()?)?,
        _ => return None,
    };
    let nanos = i64::try_from(seconds).ok()?.checked_mul(SECOND)?;
    let nanos = nanos.checked_add(i64::try_from(micros).ok()? * 1000)?;
    let mut bytes = [0; 8];
    let (pairs, []) = rest[digits..].strip_prefix(b"#")?.as_chunks::<2>() else { return None };
    let data = bytes.get_mut(..pairs.len())?;
    for (byte, [high, low]) in data.iter_mut().zip(pairs) {
        *byte = digit(*high)? << 4 | digit(*low)?;
    }
    let frame = Frame::classic(id, data)?;
    let is_name = !interface.is_empty() && interface.iter().all(u8::is_ascii_graphic);
    let interface = EntryInterface::Named(text(interface).ok().filter(|_| is_name)?);
    Some(LogEntry { stamp: WallStamp::from_nanos(nanos), interface, content: EntryContent::Data(frame) })
}

/// Splits at the first `end` within 16 bytes.
fn until(text: &[u8], end: u8) -> Option<(&[u8], &[u8])> {
    let at = text.iter().take(16).position(|byte| *byte == end)?;
    Some((&text[..at], &text[at + 1..]))
}

/// Reads the digits at the beginning of a text, at most `most`, which is at most ten. Returns their value and
/// count.
#[inline]
fn leading<const RADIX: u8>(text: &[u8], most: usize) -> (u64, usize) {
    let (mut value, mut length) = (0_u64, 0);
    for byte in text.iter().take(most) {
        let digit = DIGITS[usize::from(*byte)];
        if digit >= RADIX {
            break;
        }
        // Ten digits are far from an overflow, so the check for each digit is avoided.
        value = value.wrapping_mul(u64::from(RADIX)).wrapping_add(u64::from(digit));
        length += 1;
    }
    (value, length)
}

/// Value of each byte as a hexadecimal digit; [`NO_DIGIT`] for other bytes.
static DIGITS: [u8; 256] = {
    let mut digits = [NO_DIGIT; 256];
    let mut digit = 0_u8;
    while digit < 16 {
        digits[b"0123456789ABCDEF"[digit as usize] as usize] = digit;
        digits[b"0123456789abcdef"[digit as usize] as usize] = digit;
        digit += 1;
    }
    digits
};
const NO_DIGIT: u8 = 0xFF;

/// Returns the value of a hexadecimal digit.
fn digit(byte: u8) -> Option<u8> {
    Some(DIGITS[usize::from(byte)]).filter(|digit| *digit != NO_DIGIT)
}

fn any_line(line: &[u8]) -> Result<LogEntry<'_>, BadLine> {
    if line.len() > MAX_LINE {
        return Err(BadLine::TooLong);
    }
    let (stamp, rest) = stamped(text(line)?).ok_or(BadLine::NoTime)?;
    let mut fields = fields(rest, 16);
    let interface = fields.next().map(uncoloured).filter(|interface| !interface.is_empty());
    let interface = EntryInterface::Named(interface.ok_or(BadLine::NoInterface)?);
    let first = fields.text(BadLine::NoFrame)?;
    let content = match first.split_once('#') {
        Some((id, rest)) => content(id, rest)?,
        None => long_content(first, fields)?,
    };
    Ok(LogEntry { stamp, interface, content })
}

/// Reads a comment such as `# (1436509052.249713) can0 link down`; returns `None` if it is not a [`LogNote`].
fn parse_note(line: &[u8]) -> Option<LogEntry<'_>> {
    let (stamp, rest) = stamped(text(line.strip_prefix(b"#")?).ok()?)?;
    let mut fields = fields(rest, 16);
    let interface = EntryInterface::Named(fields.next()?);
    Some(LogEntry { stamp, interface, content: EntryContent::Note(LogNote::parse(fields)?) })
}

/// Flags of SocketCAN above the 29 bits of an identifier; the highest flag, for 29 bits, follows from eight
/// digits.
const REMOTE_FLAG: u32 = 0x4000_0000;
const ERROR_FLAG: u32 = 0x2000_0000;
const ID_MASK: u32 = 0x1FFF_FFFF;

/// The identifier of a frame, or the class of an error frame.
enum Identifier {
    Frame(CanId),
    Remote,
    Error(u32),
}

fn identifier(id: &str) -> Result<Identifier, BadLine> {
    let flagged = number(id, 16).ok_or(BadLine::BadId)?;
    let id = match id.len() {
        3 => CanId::standard(flagged),
        8 if flagged & ERROR_FLAG != 0 => return Ok(Identifier::Error(flagged & ID_MASK)),
        8 if flagged & REMOTE_FLAG != 0 => return Ok(Identifier::Remote),
        8 => CanId::extended(flagged & ID_MASK),
        _ => None,
    };
    id.map(Identifier::Frame).ok_or(BadLine::BadId)
}

/// Reads content in the `-ta` format, starting with the field after the interface.
fn long_content(first: &str, mut fields: SpacedFields<'_>) -> Result<EntryContent, BadLine> {
    let id = if matches!(first, "RX" | "TX") {
        // Two flags: bit rate switch and error state.
        fields.nth(2).ok_or(BadLine::NoFrame)?
    } else {
        first
    };
    let length = fields.text(BadLine::NoFrame)?;
    let identifier = identifier(id)?;
    let (fd, length) = match length.as_bytes() {
        [b'[', _, _, _, _, b']'] => return Err(BadLine::CanXl),
        [b'[', digits @ .., b']'] => (digits.len() == 2, number(text(digits)?, 10)),
        [b'{', dlc @ .., b'}'] => (false, number(text(dlc)?, 16)),
        _ => return Err(BadLine::NoFrame),
    };
    let length = length.ok_or(BadLine::BadLength)?;
    let length = if fd { usize::try_from(length).ok() } else { length_of_dlc(length, false) };
    let length = length.ok_or(BadLine::BadLength)?;
    match identifier {
        Identifier::Frame(_) if fields.clone().next() == Some("remote") => Ok(EntryContent::Remote),
        Identifier::Remote => Ok(EntryContent::Remote),
        Identifier::Frame(id) => data_frame(id, fd, &long_data(fields, length)?[..length]),
        Identifier::Error(class) => {
            Ok(EntryContent::Error(ErrorFrame::new(class, &long_data(fields, length)?[..length])))
        }
    }
}

/// Reads `length` bytes of two hexadecimal digits, or eight binary ones; back quotes separate bytes in
/// reverse order.
fn long_data(fields: SpacedFields<'_>, length: usize) -> Result<[u8; MAX_DATA], BadLine> {
    let is_reversed = fields.clone().next().is_some_and(|field| field.contains('`'));
    let mut digits = fields.flat_map(|field| field.split('`')).map(uncoloured);
    let mut bytes = [0; MAX_DATA];
    let data = bytes.get_mut(..length).ok_or(BadLine::BadLength)?;
    for byte in &mut *data {
        let digits = digits.next().unwrap_or_default();
        let value = number(digits, if digits.len() == 8 { 2 } else { 16 });
        let value = value.filter(|_| matches!(digits.len(), 1 | 2 | 8));
        *byte = value.and_then(|value| u8::try_from(value).ok()).ok_or(BadLine::BadData)?;
    }
    if is_reversed {
        data.reverse();
    }
    Ok(bytes)
}

/// Reads content in the `-L` format on both sides of the `#`.
fn content(id: &str, rest: &str) -> Result<EntryContent, BadLine> {
    let can_id = match identifier(id)? {
        Identifier::Frame(id) => id,
        Identifier::Remote => return Ok(EntryContent::Remote),
        Identifier::Error(class) => {
            let (bytes, length) = data(rest)?;
            return Ok(EntryContent::Error(ErrorFrame::new(class, &bytes[..length])));
        }
    };
    if let Some(fd) = rest.strip_prefix('#') {
        if fd.starts_with('#') {
            return Err(BadLine::CanXl);
        }
        // The first digit holds the unused FD flags (bit rate switch, error state).
        let payload = fd.strip_prefix(|flags: char| flags.is_ascii_hexdigit()).ok_or(BadLine::BadData)?;
        let (bytes, length) = data(payload)?;
        return data_frame(can_id, true, &bytes[..length]);
    }
    if rest.starts_with(['R', 'r']) {
        return Ok(EntryContent::Remote);
    }
    if rest.contains('#') {
        return Err(BadLine::CanXl);
    }
    let payload = match rest.split_once('_') {
        // Such a DLC is sent unchanged, but the frame still has 8 bytes.
        Some((payload, dlc)) if matches!(number(dlc, 16), Some(9..=15)) => payload,
        Some(_) => return Err(BadLine::BadLength),
        None => rest,
    };
    let (bytes, length) = data(payload)?;
    data_frame(can_id, false, &bytes[..length])
}

/// Parses pairs of hexadecimal digits, and counts them.
fn data(text: &str) -> Result<([u8; MAX_DATA], usize), BadLine> {
    let mut bytes = [0; MAX_DATA];
    let pairs = text.as_bytes().chunks(2);
    let length = pairs.len();
    if length > MAX_DATA {
        return Err(BadLine::BadLength);
    }
    for (byte, pair) in bytes.iter_mut().zip(pairs) {
        let [high, low] = pair else { return Err(BadLine::BadData) };
        *byte = digit(*high).zip(digit(*low)).map(|(high, low)| high << 4 | low).ok_or(BadLine::BadData)?;
    }
    Ok((bytes, length))
}

#[cfg(test)]
mod tests;
