//! A recording as inputs with virtual times.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io;
use std::time::Duration;

use super::routes::Routes;
use crate::io::sample_log::{LoggedSample, SampleContent, SampleLog};
use can_log::{EntryContent, InterfaceIndex, Log, LogRecord, is_without_frames};
use can_signal::can::{BusIndex, CanId, CanInput, IdMatch};
use gateway_base::time::gap_filling::MAX_SILENCE;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::Input;

/// Time for which deadlines are handled in a gap of a recording, unless it is played in real time.
pub(super) const FILLED_GAP: Duration = Duration::from_secs(60);

/// A stamp that precedes the previous one by less than this belongs to a late line; if by more, the
/// recorder's clock was set back.
const LATE_LINE: Duration = Duration::from_secs(1);

/// Maximum number of identifiers whose frames are counted: a J1939 group may use half a million.
const MAX_COUNTED_IDS: usize = 4096;

/// The replayed data: frames, and for a bag also its ROS 2 samples.
pub struct Recording {
    /// The frames; there may be none if there are samples.
    pub log: Log,
    /// The samples of the topics that the gateway subscribes to.
    pub samples: Option<SampleLog>,
}

impl From<Log> for Recording {
    fn from(log: Log) -> Self {
        Self { log, samples: None }
    }
}

/// An input of a recording.
#[derive(Debug)]
pub enum RecordedInput {
    /// Input of a bus.
    Can(CanInput),
    /// Sample of ROS 2.
    Sample(Box<LoggedSample>),
}

/// Counts of the entries read from a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RecordCounts {
    /// Number of entries of any kind, except samples of ROS 2.
    pub records: u64,
    /// Number of samples of ROS 2.
    pub samples: u64,
    /// Number of entries from interfaces without a configured bus.
    pub foreign: u64,
    /// Number of stamps earlier than a previous one.
    pub backwards: u64,
    /// Number of steps of the recorder's clock longer than [`MAX_SILENCE`].
    pub jumps: u64,
    /// Number of silences of all interfaces longer than `FILLED_GAP`, except jumps.
    pub gaps: u64,
    /// The longest of these silences.
    pub longest_gap: Duration,
}

impl RecordCounts {
    /// Returns true if nothing was read.
    pub fn is_empty(&self) -> bool {
        self.records + self.samples == 0
    }
}

pub(super) struct Tape {
    pub(super) log: Log,
    pub(super) samples: Option<SampleLog>,
    /// The record and the sample that have been read but not used yet.
    record: Option<LogRecord>,
    sample: Option<Box<LoggedSample>>,
    has_only_samples: bool,
    pub(super) routes: Routes,
    /// Virtual time, and the newest stamp read so far.
    clock: Option<Now>,
    /// Added to recorded stamps, ns.
    shift: i64,
    /// Stamp for the next record when the recording is repeated.
    start: Option<WallStamp>,
    /// The last input read; `None` once it has been taken, and at the end.
    pub(super) next: Option<(RecordedInput, Now)>,
    /// An input held back until the bad lines before it are passed on.
    held: Option<(RecordedInput, Now)>,
    bad_reported: u64,
    pub(super) counts: RecordCounts,
    /// The messages for which frames with the same or a similar identifier are counted.
    pub(super) counted: Vec<IdMatch>,
    /// Number of data frames by interface and counted identifier.
    pub(super) ids: BTreeMap<(InterfaceIndex, CanId), u64>,
}

impl RecordedInput {
    /// Returns the input of a bus; `None` for a sample.
    pub fn can(&self) -> Option<&CanInput> {
        if let Self::Can(input) = self { Some(input) } else { None }
    }

    /// Converts to an input of the gateway; `None` for a sample that is none, such as a call.
    pub fn into_input(self) -> Option<Input> {
        match self {
            Self::Can(input) => Some(input.into()),
            Self::Sample(sample) => match sample.content {
                SampleContent::Input(input) => Some(input),
                SampleContent::Call(TimedCall { call: GatewayCall::Note(bus, note), .. }) => {
                    note.input(bus).map(Input::from)
                }
                SampleContent::Call(_) | SampleContent::TurnReport(_) => None,
            },
        }
    }
}

impl Tape {
    pub(super) fn new(Recording { log, samples }: Recording, routes: Routes) -> Self {
        Self {
            log,
            samples,
            record: None,
            sample: None,
            has_only_samples: false,
            routes,
            clock: None,
            shift: 0,
            start: None,
            next: None,
            held: None,
            bad_reported: 0,
            counts: RecordCounts::default(),
            counted: Vec::new(),
            ids: BTreeMap::new(),
        }
    }

    /// Returns the virtual time of the last entry read, of whatever interface.
    pub(super) fn length(&self) -> MonoTime {
        self.clock.map_or(MonoTime::ZERO, |clock| clock.mono)
    }

    pub(super) fn rewind(&mut self, Recording { log, samples }: Recording) {
        (self.log, self.samples) = (log, samples);
        self.bad_reported = 0;
        self.start = self.clock.map(|clock| clock.wall.after(Duration::from_millis(1)));
    }

    /// Reads the next input, which replaces the previous one.
    pub(super) fn read_next(&mut self) -> io::Result<()> {
        self.next = self.held.take();
        while self.next.is_none() {
            if let Some(sample) = self.next_sample()? {
                self.counts.samples += 1;
                let (_, now) = self.advance(sample.logged);
                self.next = Some((RecordedInput::Sample(sample), now));
                break;
            }
            let read = self.next_record();
            // Borrowed, since copying a record costs as much as the rest of this function.
            let record = match &read {
                Ok(Some(record)) => record,
                Ok(None) => {
                    self.next = self.new_bad_lines().map(RecordedInput::Can).zip(self.clock);
                    break;
                }
                Err(_) => return read.map(drop),
            };
            self.counts.records += 1;
            if let EntryContent::Data(frame) = &record.content
                && self.counted.iter().any(|ids| ids.resembles(frame.id()))
            {
                let is_full = self.ids.len() >= MAX_COUNTED_IDS;
                match self.ids.entry((record.interface, frame.id())) {
                    Entry::Occupied(mut count) => *count.get_mut() += 1,
                    Entry::Vacant(_) if is_full => {}
                    Entry::Vacant(first) => drop(first.insert(1)),
                }
            }
            let (stamp, now) = self.advance(record.stamp);
            self.next = self.input(record, stamp).map(|input| (RecordedInput::Can(input), now));
            self.counts.foreign += u64::from(self.next.is_none());
            if let Some(bad) = self.new_bad_lines() {
                self.held = self.next.replace((RecordedInput::Can(bad), now));
            }
        }
        Ok(())
    }

    /// Returns the next sample, if it was received before the next record.
    fn next_sample(&mut self) -> io::Result<Option<Box<LoggedSample>>> {
        let Some(samples) = &mut self.samples else { return Ok(None) };
        if self.sample.is_none() {
            self.sample = samples.next_sample()?.map(Box::new);
        }
        if self.record.is_none() && !self.has_only_samples {
            self.record = match self.log.next_record() {
                Err(error) if is_without_frames(&error) && self.sample.is_some() => {
                    self.has_only_samples = true;
                    None
                }
                read => read?,
            };
        }
        let is_first = match (&self.record, &self.sample) {
            (Some(record), Some(sample)) => sample.logged.as_nanos() < record.stamp.as_nanos(),
            (record, _) => record.is_none(),
        };
        Ok(self.sample.take_if(|_| is_first))
    }

    /// Returns the next record; call [`Self::next_sample`] before.
    fn next_record(&mut self) -> io::Result<Option<LogRecord>> {
        if self.samples.is_some() { Ok(self.record.take()) } else { self.log.next_record() }
    }

    /// Returns the bad lines since the last call. They count for the first bus, since a bad line names none.
    fn new_bad_lines(&mut self) -> Option<CanInput> {
        let count = self.log.bad_lines() - std::mem::replace(&mut self.bad_reported, self.log.bad_lines());
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        (count > 0).then_some(CanInput::BadRecords { bus: BusIndex(0), count })
    }

    fn input(&self, record: &LogRecord, stamp: WallStamp) -> Option<CanInput> {
        let bus = self.routes.bus_of(&self.log.interfaces()[record.interface.0])?;
        match record.content {
            EntryContent::Data(frame) => Some(CanInput::Frame { bus, frame, stamp }),
            EntryContent::Error(error) => Some(CanInput::ErrorFrame { bus, error }),
            EntryContent::Note(note) => note.input(bus),
            EntryContent::Remote => None,
        }
    }

    /// Returns the record's stamp after shifting, and its virtual time.
    fn advance(&mut self, recorded: WallStamp) -> (WallStamp, Now) {
        if let Some(start) = self.start.take() {
            self.shift = start.as_nanos().saturating_sub(recorded.as_nanos());
        }
        let stamp = WallStamp::from_nanos(recorded.as_nanos().saturating_add(self.shift));
        let clock = self.clock.get_or_insert(Now { mono: MonoTime::ZERO, wall: stamp });
        let nanos = stamp.as_nanos().saturating_sub(clock.wall.as_nanos());
        let size = Duration::from_nanos(nanos.unsigned_abs());
        if nanos >= 0 {
            if size > MAX_SILENCE {
                self.counts.jumps += 1;
            } else if size > FILLED_GAP {
                self.counts.gaps += 1;
                self.counts.longest_gap = self.counts.longest_gap.max(size);
            }
            clock.mono = clock.mono.after(size.min(MAX_SILENCE));
            clock.wall = stamp;
        } else if size < LATE_LINE {
            self.counts.backwards += 1;
        } else {
            self.counts.jumps += 1;
            clock.wall = stamp;
        }
        (stamp, *clock)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tape(text: &str) -> Tape {
        let log = Log::new(Box::new(io::Cursor::new(text.as_bytes().to_vec()))).unwrap();
        Tape::new(log.into(), Routes(vec![("can0".into(), BusIndex(0))]))
    }

    fn all(tape: &mut Tape) -> Vec<(u64, String)> {
        let read_next = || {
            tape.read_next().unwrap();
            tape.next.take()
        };
        std::iter::from_fn(read_next)
            .map(|(input, now)| (now.mono.as_nanos() / 1_000_000, text(&input)))
            .collect()
    }

    fn text(input: &RecordedInput) -> String {
        let RecordedInput::Can(input) = input else { return format!("{input:?}") };
        match input {
            CanInput::Frame { frame, stamp, .. } => format!("{frame} {}", stamp.as_nanos() / 1_000_000),
            other @ (CanInput::Link { .. }
            | CanInput::Drops { .. }
            | CanInput::ErrorFrame { .. }
            | CanInput::Controller { .. }
            | CanInput::BadRecords { .. }) => format!("{other:?}"),
        }
    }

    #[test]
    fn late_lines_do_not_turn_the_clock_back_and_jumps_do_not_stop_it() {
        let mut tape = tape(
            "(10.0) can0 001#\n(10.5) can0 002#\n(10.4) can0 003#\n(10.6) can1 004#\n(99999.0) can0 005#\n\
             (20.0) can0 006#\n(20.1) can0 007#\n",
        );
        let frames = all(&mut tape);
        let times: Vec<_> = frames.iter().map(|(ms, _)| *ms).collect();
        assert_eq!(times, [0, 500, 500, 3_600_600, 3_600_600, 3_600_700]);
        assert_eq!(frames[2].1, "003# 10400", "the frame keeps its own stamp");
        assert_eq!(
            tape.counts,
            RecordCounts { records: 7, foreign: 1, backwards: 1, jumps: 2, ..RecordCounts::default() }
        );
    }

    #[test]
    fn bad_lines_come_before_the_frame_behind_them_and_at_the_end() {
        let mut tape = tape("(1.0) can0 001#\nx\ny\n(2.0) can0 002#\nz\n");
        let order: Vec<_> = all(&mut tape).into_iter().map(|(_, text)| text).collect();
        let bad = |count| format!("{:?}", CanInput::BadRecords { bus: BusIndex(0), count });
        assert_eq!(order, ["001# 1000".to_owned(), bad(2), "002# 2000".to_owned(), bad(1)]);
    }

    #[test]
    fn a_repeated_recording_goes_on_in_time() {
        let text = "(5.0) can0 001#\n(5.1) can0 002#\n";
        let mut tape = tape(text);
        all(&mut tape);
        tape.rewind(Log::new(Box::new(io::Cursor::new(text.as_bytes().to_vec()))).unwrap().into());
        assert_eq!(all(&mut tape), [(101, "001# 5101".to_owned()), (201, "002# 5201".to_owned())]);
    }
}
