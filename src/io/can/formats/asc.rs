//! Vector ASC, as CANoe, CANalyzer and many others write it.
//!
//! ```text
//! date Tue Mar 5 02:30:00.250 pm 2024
//! base hex  timestamps absolute
//! Begin Triggerblock Tue Mar 5 02:30:00.250 pm 2024
//!    0.010000 1  1A0             Rx   d 3 01 02 03  Length = 0 …
//!    0.011000 2  18FEF100x       Tx   r
//!    0.012000 1  ErrorFrame
//!    0.013000 CANFD   1 Rx 1A1 Name 1 0 9 12 00 01 … (duration, length, flags, …)
//! ```
//! `base dec` makes identifiers and data decimal. `timestamps absolute` counts from the start of
//! the measurement, `relative` from the line before, whatever that held. The start is the date of
//! the first trigger block, or that of the heading. Statistics, chip states, requests to send
//! (`TxRq`) and other events are not frames and are passed over; what has a direction where a frame
//! has it but is none counts as bad.

use super::calendar::{days, month, nanos, time_of_day};
use super::words::{bus_error, data_frame, decimal, id, number, text};
use super::{Entry, Interface, Lines};
use crate::core::can::frame::CanId;
use crate::core::time::WallStamp;
use crate::io::can::candump::{BadLine, Content};

/// The headings so far.
#[derive(Debug, Default)]
pub struct Asc {
    /// Start of the measurement, ns since 1970.
    start: i64,
    triggered: bool,
    decimal: bool,
    relative: bool,
    /// Time of the newest line since the start, ns.
    elapsed: i64,
}

/// One event: nanoseconds as in the line, and interface and content of a frame.
type Event = (i64, Option<(u32, Content)>);

/// The beginnings of lines without a time.
const HEADINGS: [&str; 5] = ["internal", "no", "begin", "end", "//"];

impl Lines for Asc {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine> {
        if !line.first().is_some_and(u8::is_ascii_digit) {
            return self.heading(line).map(|()| None);
        }
        let (time, event) = parse_line(line, if self.decimal { 10 } else { 16 })?;
        self.elapsed = if self.relative { self.elapsed.saturating_add(time) } else { time };
        Ok(event.map(|(channel, content)| Entry {
            stamp: WallStamp::from_nanos(self.start.saturating_add(self.elapsed)),
            interface: Interface::Numbered(channel),
            content,
        }))
    }
}

impl Asc {
    fn heading(&mut self, line: &[u8]) -> Result<(), BadLine> {
        // Comments may be in any character set.
        let text = String::from_utf8_lossy(line).to_ascii_lowercase();
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["date", date @ ..] if !self.triggered => self.start = start(date).ok_or(BadLine::NoTime)?,
            ["begin", "triggerblock", date @ ..] if !self.triggered => {
                self.start = start(date).unwrap_or(self.start);
                self.triggered = true;
            }
            ["base", base, rest @ ..] => {
                self.decimal = *base == "dec";
                self.relative = rest.contains(&"relative");
            }
            ["date", ..] => {}
            [first, ..] if HEADINGS.iter().any(|heading| first.starts_with(heading)) => {}
            _ => return Err(BadLine::NoTime),
        }
        Ok(())
    }
}

const HOUR: i64 = 3_600_000_000_000;

/// `Tue Mar 5 02:30:00.250 pm 2024`, in lower case; am and pm may be missing.
fn start(words: &[&str]) -> Option<i64> {
    let [_weekday, name, day, time, rest @ ..] = words else { return None };
    let (half, year) = match rest {
        [half @ ("am" | "pm"), year] => (Some(*half), year),
        [year] => (None, year),
        _ => return None,
    };
    let time = time_of_day(time)?;
    let time = match half {
        Some("am") if time >= 12 * HOUR => time - 12 * HOUR,
        Some("pm") if time < 12 * HOUR => time + 12 * HOUR,
        Some(_) | None => time,
    };
    nanos(days(number(year, 10)?, month(name)?, number(day, 10)?), Some(time))
}

/// Reads one line that begins with a time; `radix` is that of identifiers and data. An event that
/// is not a frame has a time only.
///
/// # Errors
/// The reason why it cannot be read.
pub fn parse_line(line: &[u8], radix: u32) -> Result<Event, BadLine> {
    // Comments behind an event can have bytes that are not text; the words before them count.
    let line = text(line).or_else(|reason| {
        let valid = std::str::from_utf8(line).err().map_or(0, |error| error.valid_up_to());
        std::str::from_utf8(&line[..valid]).map_err(|_| reason)
    })?;
    let mut words = line.split_ascii_whitespace();
    let time = words.next().and_then(|word| decimal(word, 1_000_000_000)).ok_or(BadLine::NoTime)?;
    let Some(second) = words.next() else { return Err(BadLine::NoInterface) };
    let event = if second.eq_ignore_ascii_case("CANFD") {
        let channel = words.next().and_then(|word| number(word, 10)).ok_or(BadLine::NoInterface)?;
        fd(&mut words, radix)?.map(|content| (channel, content))
    } else if let Some(channel) = number(second, 10) {
        classic(&mut words, radix)?.map(|content| (channel, content))
    } else {
        None
    };
    Ok((time, event))
}

fn classic<'a>(words: &mut impl Iterator<Item = &'a str>, radix: u32) -> Result<Option<Content>, BadLine> {
    let name = words.next().ok_or(BadLine::NoFrame)?;
    if name.eq_ignore_ascii_case("ErrorFrame") {
        return Ok(Some(bus_error()));
    }
    let id = identifier(name, radix);
    match words.next() {
        Some("Rx" | "Tx") => {}
        Some("TxRq") => return Ok(None),
        // Statistics and the like have neither.
        _ => return if id.is_ok() { Err(BadLine::NoFrame) } else { Ok(None) },
    }
    let id = id?;
    match words.next() {
        Some("d" | "D") => {}
        Some("r" | "R") => return Ok(Some(Content::Remote)),
        _ => return Err(BadLine::NoFrame),
    }
    let dlc = words.next().and_then(|word| number(word, if word.len() == 1 { 16 } else { radix }));
    // A DLC above 8 is sent as it is, but the frame still has 8 bytes.
    let length = fd_free_length(dlc).ok_or(BadLine::BadLength)?;
    data_frame(id, false, length, words, radix).map(Some)
}

fn fd_free_length(dlc: Option<u32>) -> Option<usize> {
    let dlc = usize::try_from(dlc?).ok()?;
    (dlc <= 15).then_some(dlc.min(8))
}

const FD_FRAME: u32 = 1 << 12;
const REMOTE_FRAME: u32 = 1 << 4;

fn fd<'a>(words: &mut impl Iterator<Item = &'a str>, radix: u32) -> Result<Option<Content>, BadLine> {
    match words.next() {
        Some("Rx" | "Tx") => {}
        Some("TxRq") => return Ok(None),
        _ => return Err(BadLine::NoFrame),
    }
    let name = words.next().ok_or(BadLine::NoFrame)?;
    if name.eq_ignore_ascii_case("ErrorFrame") {
        return Ok(Some(bus_error()));
    }
    let id = identifier(name, radix)?;
    // The bit rate switch, behind a symbolic name if there is one; then the error state and the DLC.
    if words.next().is_some_and(|word| !matches!(word, "0" | "1")) {
        words.next();
    }
    let mut words = words.skip(2);
    let length = words.next().and_then(|word| number(word, 10)).ok_or(BadLine::BadLength)?;
    let length = usize::try_from(length).map_err(|_| BadLine::BadLength)?;
    let content = data_frame(id, true, length, &mut words, radix)?;
    // Behind the data: duration, length in bits, flags. Without them it is an FD frame.
    let flags = words.nth(2).and_then(|word| number(word, 16)).unwrap_or(FD_FRAME);
    match content {
        Content::Data(_) if flags & REMOTE_FRAME != 0 => Ok(Some(Content::Remote)),
        Content::Data(frame) if flags & FD_FRAME == 0 => {
            super::words::frame(id, false, frame.data()).map(Some)
        }
        Content::Data(_) | Content::Remote | Content::Error(_) | Content::Note(_) => Ok(Some(content)),
    }
}

/// `1A0`, or `18FEF100x` for 29 bits.
fn identifier(word: &str, radix: u32) -> Result<CanId, BadLine> {
    let bare = word.strip_suffix(['x', 'X']);
    id(number(bare.unwrap_or(word), radix).ok_or(BadLine::BadId)?, bare.is_some())
}

#[cfg(test)]
mod tests {
    use super::super::shown;
    use super::*;

    fn read(lines: &[&str]) -> Vec<Result<String, BadLine>> {
        shown(&mut Asc::default(), lines)
    }

    fn good(lines: &[&str]) -> Vec<String> {
        read(lines).into_iter().map(Result::unwrap).collect()
    }

    #[test]
    fn every_kind_of_line_is_read() {
        let lines = good(&[
            "date Tue Mar 5 02:30:00.250 pm 2024",
            "base hex  timestamps absolute",
            "internal events logged",
            "// version 13.0.0",
            "Begin Triggerblock Tue Mar 5 02:30:00.250 pm 2024",
            "0.000000 Start of measurement",
            "0.010000 1  1A0             Rx   d 3 01 02 fF  Length = 0 BitCount = 60 ID = 416",
            "0.011000 2  18FEF100x       Tx   r 8",
            "0.012000 1  ErrorFrame Flags = 0xe",
            "0.013 CANFD 1 Rx 1A1 BodyLamps 1 0 9 12 1 2 3 4 5 6 7 8 9 a b c 130000 130 303000 0 0",
            "0.014 CANFD 1 Rx 1A1 0 0 2 2 7 8 130000 130 0 0 0",
            "0.015 CANFD 2 Tx ErrorFrame Not Acknowledge error",
            "0.016 1  1A0 Rx d f 1 2 3 4 5 6 7 8",
            "0.017 1  1A0 TxRq d 1 2",
            "0.018 1  Statistic: D 12 R 0 XD 0",
            "0.019 CAN 1 Status:chip status error active",
            "0.020 CANFD 1 Rx 1A1 0 0 0 0 10 10 10 0 0",
            "0.021 1  1A0 Rx d 0",
            "End TriggerBlock",
        ]);
        let start = 1_709_649_000_250_000_u64;
        let expected = [
            (10_000, "can1 1A0#0102FF"),
            (11_000, "can2 Remote"),
            (12_000, "can1 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
            (13_000, "can1 1A1##00102030405060708090A0B0C"),
            (14_000, "can1 1A1#0708"),
            (15_000, "can2 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
            (16_000, "can1 1A0#0102030405060708"),
            (20_000, "can1 Remote"),
            (21_000, "can1 1A0#"),
        ];
        let expected: Vec<_> =
            expected.iter().map(|(time, text)| format!("{} {text}", start + time)).collect();
        assert_eq!(lines, expected);
    }

    #[test]
    fn decimal_base_and_relative_times_are_applied() {
        let lines = good(&[
            "base dec  timestamps relative",
            "0.5 1 416 Rx d 2 10 255",
            "0.5 CAN 1 Status:chip status error active",
            "0.5 1 419361024x Rx d 1 0",
        ]);
        assert_eq!(lines, ["500000 can1 1A0#0AFF", "1500000 can1 18FEF100#00"]);
    }

    #[test]
    fn the_first_trigger_block_sets_the_start() {
        let lines = good(&[
            "date Tue Mar 5 02:30:00 pm 2024",
            "Begin Triggerblock Tue Mar 5 14:30:01 2024",
            "1.0 1 1A0 Rx d 0",
            "End TriggerBlock",
            "Begin Triggerblock Tue Mar 5 14:30:09 2024",
            "9.0 1 1A0 Rx d 0",
        ]);
        assert_eq!(lines, ["1709649002000000 can1 1A0#", "1709649010000000 can1 1A0#"]);
        assert_eq!(start(&["mo", "jan", "1", "12:00:00", "am", "2024"]), Some(1_704_067_200_000_000_000));
    }

    #[test]
    fn every_way_to_break_a_line_has_its_reason() {
        for (line, reason) in [
            ("garbage", BadLine::NoTime),
            ("date sometime", BadLine::NoTime),
            ("1.x 1 1A0 Rx d 0", BadLine::NoTime),
            ("1.0", BadLine::NoInterface),
            ("1.0 CANFD x Rx", BadLine::NoInterface),
            ("1.0 1", BadLine::NoFrame),
            ("1.0 1 1A0 Rz d 0", BadLine::NoFrame),
            ("1.0 1 1A0 Rx q 0", BadLine::NoFrame),
            ("1.0 1 LampState Rx d 0", BadLine::BadId),
            ("1.0 1 800 Rx d 0", BadLine::BadId),
            ("1.0 1 1A0 Rx d 10 00", BadLine::BadLength),
            ("1.0 1 1A0 Rx d", BadLine::BadLength),
            ("1.0 1 1A0 Rx d 2 00", BadLine::BadData),
            ("1.0 1 1A0 Rx d 1 100", BadLine::BadData),
            ("1.0 CANFD 1 Rx 1A0 0 0 9 9 1 2 3 4 5 6 7 8 9", BadLine::BadLength),
            ("1.0 CANFD 1 Rx 1A0 0 0 f 99999 1", BadLine::BadLength),
        ] {
            assert_eq!(read(&[line]), [Err(reason)], "{line}");
        }
        assert_eq!(Asc::default().read(b"\xFF\xFE"), Err(BadLine::NoTime));
    }
}
