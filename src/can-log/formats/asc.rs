//! Vector ASC, as written by CANoe, CANalyzer and many other tools.
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
//! The length of a frame is its data length code, one hexadecimal digit. CSS Electronics also writes CAN FD
//! frames in this form, without `CANFD` and with a decimal code: `d 10` and 16 bytes. Only a code of 9 to 15
//! is ambiguous, since a classic frame with such a code has 8 bytes; the number of bytes in the line decides,
//! and a line with any other number is bad.
//!
//! `base dec` makes identifiers and data decimal. `timestamps absolute` counts from the start of the
//! measurement, `relative` from the previous line, whatever its content. The start is the date of the first
//! trigger block, or the date of the heading, also written as `Thu, 09 Nov 2023 17:10:55 GMT`. A chip status,
//! with error counters or without, is the state of the controller. Statistics, transmit requests (`TxRq`) and
//! other events are skipped; an event that has a direction like a frame, but is not a frame, counts as bad.

use crate::clock::{SECOND, days, month, nanos, time_of_day};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{
    SpacedFields, bus_error, data_frame, fields, id, length_of_dlc, number, text_before_comment,
};
use crate::format::{LineFormat, LineReader, begins};
use can_signal::can::{CanId, ControllerReport, ControllerState, ErrorCounters, LogNote};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "Vector ASC",
    claims: |line| begins(line, &["date ", "base ", "// version", "begin triggerblock"]),
    unit_ns: None,
    reader: |_| Box::<Asc>::default(),
};

/// State from the headings, and the time.
#[derive(Debug, Default)]
struct Asc {
    /// Start of the measurement, ns since 1970.
    start: i64,
    triggered: bool,
    decimal: bool,
    relative: bool,
    /// Time of the newest line since the start, ns.
    elapsed: i64,
}

/// Beginnings of lines without a time.
const HEADINGS: [&str; 5] = ["internal", "no", "begin", "end", "//"];

impl LineReader for Asc {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        if !line.first().is_some_and(u8::is_ascii_digit) {
            return self.heading(line).map(|()| None);
        }
        let mut fields = fields(text_before_comment(line), if self.decimal { 10 } else { 16 });
        let time = fields.time(SECOND)?;
        let event = event(&mut fields)?;
        self.elapsed = if self.relative { self.elapsed.saturating_add(time) } else { time };
        let nanos = self.start.saturating_add(self.elapsed);
        Ok(event.map(|(channel, content)| LogEntry::numbered(nanos, channel, content)))
    }
}

impl Asc {
    fn heading(&mut self, line: &[u8]) -> Result<(), BadLine> {
        // Comments may be in any character set.
        let text = String::from_utf8_lossy(line).to_ascii_lowercase();
        let fields: Vec<&str> = text.split_ascii_whitespace().collect();
        match fields.as_slice() {
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

const HOUR: i64 = 3600 * SECOND;

/// Parses `Tue Mar 5 02:30:00.250 pm 2024` or `Tue, 05 Mar 2024 14:30:00 GMT`, in lower case; am and pm are
/// optional.
fn start(date: &[&str]) -> Option<i64> {
    let (half, name, day, time, year) = match date {
        [_weekday, name, day, time, half @ ("am" | "pm"), year] => (Some(*half), name, day, time, year),
        [_weekday, name, day, time, year] => (None, name, day, time, year),
        [_weekday, day, name, year, time, "gmt" | "utc"] => (None, name, day, time, year),
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

/// Reads channel and content after the time; returns `None` for an event that is not a frame.
fn event(fields: &mut SpacedFields<'_>) -> Result<Option<(u32, EntryContent)>, BadLine> {
    let first = fields.text(BadLine::NoInterface)?;
    if first.eq_ignore_ascii_case("CANFD") {
        let channel = fields.channel()?;
        Ok(fd(fields)?.map(|content| (channel, content)))
    } else if first.eq_ignore_ascii_case("CANXL") {
        Err(BadLine::CanXl)
    } else if first.eq_ignore_ascii_case("CAN") {
        let channel = fields.next().and_then(|channel| number(channel, 10));
        Ok(channel
            .zip(chip_status(fields))
            .map(|(channel, report)| (channel, EntryContent::Note(LogNote::Controller(report)))))
    } else if let Some(channel) = number(first, 10) {
        Ok(classic(fields)?.map(|content| (channel, content)))
    } else {
        Ok(None)
    }
}

/// Reads `Status:chip status error passive - TxErr: 132 RxErr: 0`; returns `None` for another status.
fn chip_status(fields: &mut SpacedFields<'_>) -> Option<ControllerReport> {
    let [first, second] = [fields.next()?, fields.next()?];
    if !(first.eq_ignore_ascii_case("Status:chip") && second.eq_ignore_ascii_case("status")) {
        return None;
    }
    let text = fields.collect::<Vec<_>>().join(" ").to_ascii_lowercase();
    let (state, counters) = text.split_once('-').unwrap_or((&text, ""));
    let state = match state.trim() {
        "error active" | "active" => ControllerState::ErrorActive,
        "error passive" | "passive" => ControllerState::Passive,
        "bus off" | "busoff" => ControllerState::BusOff,
        state if state.contains("warning") => ControllerState::Warning,
        _ => return None,
    };
    let counter = |name: &str| {
        let (_, behind) = counters.split_once(name)?;
        behind.split_ascii_whitespace().next()?.parse().ok()
    };
    let counters = counter("txerr:").zip(counter("rxerr:")).map(|(tx, rx)| ErrorCounters { tx, rx });
    Some(ControllerReport { state, counters, restart_ms: None })
}

fn classic(fields: &mut SpacedFields<'_>) -> Result<Option<EntryContent>, BadLine> {
    let name = fields.text(BadLine::NoFrame)?;
    if name.eq_ignore_ascii_case("ErrorFrame") {
        return Ok(Some(bus_error()));
    }
    let id = identifier(name, fields.radix);
    match fields.next() {
        Some("Rx" | "Tx") => {}
        Some("TxRq") => return Ok(None),
        // Statistics and similar events have neither.
        _ => return if id.is_ok() { Err(BadLine::NoFrame) } else { Ok(None) },
    }
    let id = id?;
    match fields.next() {
        Some("d" | "D") => {}
        Some("r" | "R") => return Ok(Some(EntryContent::Remote)),
        _ => return Err(BadLine::NoFrame),
    }
    let dlc = fields.next().and_then(|dlc| number(dlc, 10).or_else(|| number(dlc, 16)));
    let dlc = dlc.ok_or(BadLine::BadLength)?;
    let [classic, fd] = [false, true].map(|fd| length_of_dlc(dlc, fd));
    let is_fd = classic != fd && fd == Some(fields.byte_count());
    let length = if is_fd { fd } else { classic.filter(|length| dlc <= 8 || *length == fields.byte_count()) };
    fields.data_frame(id, is_fd, length.ok_or(BadLine::BadLength)?).map(Some)
}

const FD_FRAME: u32 = 1 << 12;
const REMOTE_FRAME: u32 = 1 << 4;

fn fd(fields: &mut SpacedFields<'_>) -> Result<Option<EntryContent>, BadLine> {
    match fields.next() {
        Some("Rx" | "Tx") => {}
        Some("TxRq") => return Ok(None),
        _ => return Err(BadLine::NoFrame),
    }
    let name = fields.text(BadLine::NoFrame)?;
    if name.eq_ignore_ascii_case("ErrorFrame") {
        return Ok(Some(bus_error()));
    }
    let id = identifier(name, fields.radix)?;
    // The bit rate switch, after the optional symbolic name; then the error state and the DLC.
    let mut rate_switch = fields.next();
    if rate_switch.is_some_and(|field| !matches!(field, "0" | "1")) {
        rate_switch = fields.next();
    }
    let _error_state_and_dlc = (fields.next(), fields.next());
    let length = fields.length()?;
    let content = fields.data_frame(id, true, length)?;
    // After the data: duration, length in bits, flags. Without them it is an FD frame. Some writers leave the
    // flags zero; only an FD frame has a bit rate switch or more than eight bytes.
    let must_be_fd = rate_switch == Some("1") || length > 8;
    let flags = fields.nth(2).and_then(|flags| number(flags, 16)).unwrap_or(FD_FRAME);
    match content {
        EntryContent::Data(_) if flags & REMOTE_FRAME != 0 => Ok(Some(EntryContent::Remote)),
        EntryContent::Data(frame) if flags & FD_FRAME == 0 && !must_be_fd => {
            data_frame(id, false, frame.data()).map(Some)
        }
        EntryContent::Data(_) | EntryContent::Remote | EntryContent::Error(_) | EntryContent::Note(_) => {
            Ok(Some(content))
        }
    }
}

/// Parses `1A0`, or `18FEF100x` for 29 bits.
fn identifier(field: &str, radix: u32) -> Result<CanId, BadLine> {
    let bare = field.strip_suffix(['x', 'X']);
    id(number(bare.unwrap_or(field), radix).ok_or(BadLine::BadId)?, bare.is_some())
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
                "0.0191 CAN 1 Status:chip status error active",
                "0.0192 CAN 2 Status:chip status error passive - TxErr: 132 RxErr: 0",
                "0.0193 CAN 2 Status:chip status bus off",
                "0.0194 CAN 1 Status:receive queue overrun",
                "0.020 CANFD 1 Rx 1A1 0 0 0 0 10 10 10 0 0",
                "0.021 1  1A0 Rx d 0",
                "End TriggerBlock",
            ],
        );
        let start = 1_709_649_000_250_000_u64;
        let expected = [
            (10_000, "can1 1A0#0102FF"),
            (11_000, "can2 Remote"),
            (12_000, "can1 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
            (13_000, "can1 1A1##00102030405060708090A0B0C"),
            (14_000, "can1 1A1#0708"),
            (15_000, "can2 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
            (16_000, "can1 1A0#0102030405060708"),
            (19_100, "can1 Note(Controller(error-active))"),
            (19_200, "can2 Note(Controller(error-passive tx 132 rx 0))"),
            (19_300, "can2 Note(Controller(bus-off))"),
            (20_000, "can1 Remote"),
            (21_000, "can1 1A0#"),
        ];
        let expected: Vec<_> =
            expected.iter().map(|(time, text)| format!("{} {text}", start + time)).collect();
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_long_frame_or_a_rate_switch_is_fd_whatever_the_flags() {
        let lines = good(
            FORMAT,
            &[
                "base hex  timestamps absolute",
                "0.001 CANFD 1 Rx 1A1 0 0 9 12 1 2 3 4 5 6 7 8 9 a b c 0 0 0 0 0 0 0 0",
                "0.002 CANFD 1 Rx 1A1 Lamps 1 0 2 2 7 8 0 0 0 0 0",
                "0.003 CANFD 1 Rx 1A1 Lamps 0 0 2 2 7 8 0 0 0 0 0",
            ],
        );
        let expected =
            ["1000 can1 1A1##00102030405060708090A0B0C", "2000 can1 1A1##00708", "3000 can1 1A1#0708"];
        assert_eq!(lines, expected);
    }

    #[test]
    fn bytes_in_the_line_tell_a_long_frame_from_a_code_above_eight() {
        let bytes = |count: usize| " 01".repeat(count);
        let frame = |dlc: &str, count| format!("1.0 1 123 Rx d {dlc}{}  Length = 0 ID = 291", bytes(count));
        for (dlc, count, is_fd) in [
            ("8", 8, false),
            ("9", 8, false),
            ("9", 12, true),
            ("a", 8, false),
            ("a", 16, true),
            ("10", 8, false),
            ("10", 16, true),
            ("15", 8, false),
            ("15", 64, true),
            ("f", 64, true),
        ] {
            let mark = if is_fd { "##0" } else { "#" };
            let expected = format!("1000000 can1 123{mark}{}", "01".repeat(count));
            assert_eq!(good(FORMAT, &["base hex", &frame(dlc, count)]), [expected], "{dlc} {count}");
        }
        for (dlc, count) in [("9", 9), ("9", 7), ("10", 12), ("15", 16), ("16", 16), ("16", 8)] {
            let line = frame(dlc, count);
            assert_refused(FORMAT, &["base hex"], &[(&line, BadLine::BadLength)]);
        }
    }

    #[test]
    fn decimal_base_and_relative_times_are_applied() {
        let lines = good(
            FORMAT,
            &[
                "base dec  timestamps relative",
                "0.5 1 416 Rx d 2 10 255",
                "0.5 1 Statistic: D 12 R 0 XD 0",
                "0.5 1 419361024x Rx d 1 0",
            ],
        );
        assert_eq!(lines, ["500000 can1 1A0#0AFF", "1500000 can1 18FEF100#00"]);
    }

    #[test]
    fn the_first_trigger_block_sets_the_start() {
        let lines = good(
            FORMAT,
            &[
                "date Tue Mar 5 02:30:00 pm 2024",
                "Begin Triggerblock Tue Mar 5 14:30:01 2024",
                "1.0 1 1A0 Rx d 0",
                "End TriggerBlock",
                "Begin Triggerblock Tue Mar 5 14:30:09 2024",
                "9.0 1 1A0 Rx d 0",
            ],
        );
        assert_eq!(lines, ["1709649002000000 can1 1A0#", "1709649010000000 can1 1A0#"]);
        let http = start(&["thu,", "09", "nov", "2023", "17:10:55", "gmt"]);
        assert_eq!(http, Some(1_699_549_855_000_000_000));
        assert_eq!(start(&["mo", "jan", "1", "12:00:00", "am", "2024"]), Some(1_704_067_200_000_000_000));
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("garbage", BadLine::NoTime),
            ("date sometime", BadLine::NoTime),
            ("1.x 1 1A0 Rx d 0", BadLine::NoTime),
            ("1.0", BadLine::NoInterface),
            ("1.0 CANFD x Rx", BadLine::NoInterface),
            ("1.0 CANXL 1 Rx 1A0", BadLine::CanXl),
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
        ];
        assert_refused(FORMAT, &[], &cases);
        assert_eq!(Asc::default().read(b"\xFF\xFE"), Err(BadLine::NoTime));
    }
}
