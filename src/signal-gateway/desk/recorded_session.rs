//! A discovery on a recording, with the driver's actions as marks in the recording or in a separate file.

use std::io;
use std::time::Duration;

use can_log::{EntryContent, Log, no_frame};
use can_signal::can::{BusIndex, DriverMark, LogNote};
use gateway_base::time::MonoTime;
use vehicle_bringup::discovery::capture::Capture;
use vehicle_bringup::discovery::findings::DiscoveryFindings;
use vehicle_bringup::discovery::timeline::ActionTimeline;

/// The frames of a recording, and its marks.
#[derive(Debug)]
pub struct RecordedSession {
    /// Frames of the recording, by message.
    pub capture: Capture,
    /// The driver's actions, ascending.
    pub marks: Vec<(MonoTime, DriverMark)>,
    /// Interfaces of the recording, by [`BusIndex`].
    pub interfaces: Vec<String>,
}

/// Time of a mark, seconds: since the first entry of the recording, or since 1970 like its stamps.
pub type MarkTime = f64;

/// Mark times from this on are stamps, seconds: no recording is that long.
const FIRST_STAMP: f64 = 100_000_000.0;

impl RecordedSession {
    /// Reads a recording to its end; `marks` come before those in it.
    pub fn read(mut log: Log, marks: &[(MarkTime, DriverMark)]) -> io::Result<Self> {
        let (mut capture, mut noted) = (Capture::default(), Vec::new());
        let (mut first, mut first_s, mut now) = (None, 0.0, MonoTime::ZERO);
        while let Some(record) = log.next_record()? {
            let stamp = record.stamp.as_nanos();
            let since = stamp.saturating_sub(*first.get_or_insert_with(|| {
                first_s = f64::from(record.stamp.sec()) + f64::from(record.stamp.nanosec()) / 1e9;
                stamp
            }));
            now = now.max(MonoTime::from_nanos(u64::try_from(since).unwrap_or(0)));
            let bus = BusIndex(u8::try_from(record.interface.0).unwrap_or(u8::MAX));
            match record.content {
                EntryContent::Data(frame) => capture.add(bus, &frame, now),
                EntryContent::Note(LogNote::Mark(mark)) => noted.push((now, mark)),
                EntryContent::Note(_) | EntryContent::Remote | EntryContent::Error(_) => {}
            }
        }
        if capture.frames() == 0 {
            return Err(no_frame());
        }
        if let Some(breakage) = log.breakage() {
            return Err(io::Error::new(io::ErrorKind::InvalidData, breakage.to_string()));
        }
        let time = |seconds: MarkTime| {
            let since = if seconds < FIRST_STAMP { seconds } else { seconds - first_s };
            MonoTime::ZERO.after(Duration::try_from_secs_f64(since.max(0.0)).unwrap_or(Duration::MAX))
        };
        noted.extend(marks.iter().map(|(at, mark)| (time(*at), *mark)));
        noted.sort_by_key(|(at, _)| *at);
        Ok(Self { capture, marks: noted, interfaces: log.interfaces().to_vec() })
    }

    /// Returns the requests that the marks represent.
    pub fn timeline(&self) -> ActionTimeline {
        let (start, end) = self.capture.span().unwrap_or_default();
        ActionTimeline::new(&self.marks, start..end)
    }

    /// Returns the signals that follow the marks.
    pub fn findings(&self) -> DiscoveryFindings {
        DiscoveryFindings::new(&self.capture, &self.timeline())
    }
}

/// A line that is not a mark.
#[derive(Debug, thiserror::Error)]
#[error(
    "line {number}: expected SECONDS and quiet, left, right, hazard or off, as in `12.5 left`, found `{line}`"
)]
pub struct InvalidMark {
    /// Number of the line, from 1.
    pub number: u32,
    /// The line without its comment.
    pub line: String,
}

/// Parses marks: a time and a mark per line; `#` begins a comment.
pub fn marks(text: &str) -> Result<Vec<(MarkTime, DriverMark)>, InvalidMark> {
    let mut marks = Vec::new();
    for (number, line) in (1_u32..).zip(text.lines()) {
        let line = line.split_once('#').map_or(line, |(before, _)| before);
        let fields: Vec<_> = line.split_whitespace().collect();
        let mark = match fields.as_slice() {
            [] => continue,
            [time, name] => {
                let time = time.trim_matches(['(', ')']).parse().ok();
                let time = time.filter(|time: &f64| time.is_finite() && *time >= 0.0);
                time.zip(DriverMark::from_name(name))
            }
            _ => None,
        };
        marks.push(mark.ok_or_else(|| InvalidMark { number, line: line.trim().to_owned() })?);
    }
    Ok(marks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_from_text_and_from_the_recording() {
        let text = "# a drive\n1.5 left\n(1700000004.0) off\n";
        let marks = marks(text).unwrap();
        let log = "(1700000000.000000) can0 123#00\n# (1700000006.000000) can0 mark right\n\
                   (1700000009.000000) can0 123#01\n";
        let log = Log::new(Box::new(io::Cursor::new(log.as_bytes().to_vec()))).unwrap();
        let session = RecordedSession::read(log, &marks).unwrap();
        let times: Vec<_> =
            session.marks.iter().map(|(at, mark)| (at.as_nanos() / 1_000_000, *mark)).collect();
        assert_eq!(times, [(1500, DriverMark::Left), (4000, DriverMark::Off), (6000, DriverMark::Right)]);
        assert_eq!((session.capture.frames(), session.interfaces.as_slice()), (2, &["can0".to_owned()][..]));
    }

    #[test]
    fn a_line_that_is_not_a_mark_is_refused_with_its_number() {
        for text in ["1.0 left\nleft", "\n2 up", "1 left now", "-1 off"] {
            assert!(marks(text).unwrap_err().to_string().contains("as in `12.5 left`"), "{text}");
        }
        assert_eq!(marks("1.0 left\nleft").unwrap_err().number, 2);
    }
}
