//! Reads recordings in any of the formats, plain or compressed, entry by entry in bounded memory.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufReader, Chain, Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use derive_more::Display;

use crate::bag_folder;
use crate::compression::decompressed;
use crate::counted_source::CountedSource;
use crate::entry::{BadLine, EntryContent, EntryInterface, LogEntry};
use crate::file_budget::{ENTRY_WORK, FileBudget};
use crate::format::{LineFormat, LineReader, ObjectReader, ObjectSource, Outcome, refused};
use crate::formats::{Format, HEAD, not_recognised, refuse_pending_rows, without_byte_order_mark};
use crate::lines::Lines;
use crate::{regular_file, standard_input};
use gateway_base::time::WallStamp;

/// Position of an interface in [`Log::interfaces`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct InterfaceIndex(pub usize);

/// One entry of a log, with the position of its interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogRecord {
    /// Time of reception.
    pub stamp: WallStamp,
    /// The interface that received it.
    pub interface: InterfaceIndex,
    /// The frame or note.
    pub content: EntryContent,
}

/// The point where a recording breaks off, because it was cut or is damaged.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("the recording breaks off at byte {bytes} ({reason}); frames read before it: {records}")]
pub struct Breakage {
    /// Number of frames and notes before it.
    pub records: u64,
    /// Number of bytes of the file before it.
    pub bytes: u64,
    /// Reason why nothing after it can be read.
    pub reason: String,
}

/// More frames than a bus can carry, by their stamps.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display(
    "the stamps of {interface} are not believable: {frames} frames in {:.3} s, and a bus carries at most {} a second; if \
     their unit is another one, give it with --time-unit",
    span.as_secs_f64(), MAX_RATE_HZ)]
pub struct Crowd {
    /// Name of the interface.
    pub interface: String,
    /// Number of its frames.
    pub frames: u64,
    /// Time from its first frame to its last.
    pub span: Duration,
}

/// Maximum number of data frames per second on a bus: at 1 Mbit/s, with 47 bits each.
const MAX_RATE_HZ: u128 = 21_000;
/// Minimum number of frames for judging their rate; fewer may be the burst of a buffer.
const MIN_CROWD: u64 = 1_000;

/// Number of frames of an interface, and their first and last stamp.
#[derive(Debug, Clone, Copy)]
struct FrameTimes {
    frames: u64,
    first: WallStamp,
    last: WallStamp,
}

/// Reads a log.
pub struct Log {
    reader: FormatReader,
    /// Number of lines or objects read from the current file.
    number: u64,
    /// Number of bytes read from the current file.
    consumed: Arc<AtomicU64>,
    /// Budget of all files.
    budget: FileBudget,
    interfaces: Vec<String>,
    times: Vec<FrameTimes>,
    records: u64,
    bad_lines: u64,
    first_bad: Option<(u64, BadLine)>,
    breakage: Option<Breakage>,
    /// The remaining files of a bag.
    rest: VecDeque<PathBuf>,
    is_ended: bool,
}

/// Number of entries that are searched for interface names.
const LOOK_AHEAD: usize = 20_000;
const BUFFER: usize = 64 << 10;
/// Number of unreadable lines after which no frame is expected, so that reading an endless source ends: as
/// many as a file of 10 MB can have.
const MAX_BAD_BEFORE_FIRST: u64 = 10_000_000;
/// Maximum number of interfaces; more indicate garbage, and count as bad lines.
const MAX_INTERFACES: usize = 64;

/// Reads lines or objects, and counts them.
enum FormatReader {
    Lines { lines: Lines<Source>, format: LineFormat, reader: Box<dyn LineReader> },
    Objects(Box<dyn ObjectReader>),
}

/// The beginning, used to recognise the format, and the rest.
type Source = Chain<Cursor<Vec<u8>>, Box<dyn Read + Send>>;

/// Returns the error for a recording without a frame.
pub fn no_frame() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "not one frame was read")
}

impl Log {
    /// Opens a log file, or all files of a bag's folder; `-` is standard input. Fails if the format is
    /// unknown or not supported.
    pub fn open(path: &Path) -> io::Result<Self> {
        if standard_input::is_named(path) {
            return Self::new(Box::new(standard_input::stream()?));
        }
        if path.is_dir() {
            let mut files = VecDeque::from(bag_folder::files(path)?);
            let first = files.pop_front().ok_or(io::ErrorKind::IsADirectory)?;
            return Ok(Self { rest: files, ..Self::open(&first)? });
        }
        Self::of_file(path, |file| Box::new(file))
    }

    /// Opens a file and reads it through `wrap`, e.g. to show its progress.
    pub fn of_file(path: &Path, wrap: impl FnOnce(File) -> Box<dyn Read + Send>) -> io::Result<Self> {
        refuse_pending_rows(path)?;
        Self::new(wrap(regular_file::open(path)?))
    }

    /// Reads from any source, decompressed if necessary, in any of the formats. Fails if its first bytes
    /// cannot be read, or if the format is unknown or not supported.
    pub fn new(source: Box<dyn Read + Send>) -> io::Result<Self> {
        let budget = FileBudget::default();
        let (reader, consumed) = FormatReader::of_source(source, &budget)?;
        Ok(Self {
            reader,
            number: 0,
            consumed,
            budget,
            interfaces: Vec::new(),
            times: Vec::new(),
            records: 0,
            bad_lines: 0,
            first_bad: None,
            breakage: None,
            rest: VecDeque::new(),
            is_ended: false,
        })
    }

    /// Interprets the stamps in a unit, ns, instead of the usual unit of the format. Call it before the first
    /// entry is read. Fails if the format has a fixed unit.
    pub fn in_time_unit(mut self, unit_ns: i64) -> io::Result<Self> {
        match &mut self.reader {
            FormatReader::Lines { format, reader, .. } if format.unit_ns.is_some() => {
                *reader = (format.reader)(unit_ns);
            }
            FormatReader::Lines { .. } | FormatReader::Objects(_) => {
                return Err(refused(
                    "the format of this recording says in which unit its stamps are",
                    "leave out --time-unit",
                ));
            }
        }
        Ok(self)
    }

    /// Returns the interface names at the beginning of a file; none if it cannot be read twice.
    pub fn interfaces_in(path: &Path) -> Vec<String> {
        if standard_input::is_named(path) {
            return Vec::new();
        }
        let Ok(mut log) = Self::open(path) else { return Vec::new() };
        for _ in 0..LOOK_AHEAD {
            if !matches!(log.next_record(), Ok(Some(_))) {
                break;
            }
        }
        log.interfaces
    }

    /// Returns the next entry; unreadable lines are counted and skipped. A file that was cut or is damaged
    /// ends there, and [`Self::breakage`] returns where. Fails if the file cannot be read, or breaks off
    /// before its first entry.
    pub fn next_record(&mut self) -> io::Result<Option<LogRecord>> {
        while !self.is_ended {
            let read = self.next_whole_record();
            // Borrowed: a copy of each record would cost as much as the rest of this function.
            if let Ok(Some(record)) = &read {
                self.records += 1;
                self.note_time(record);
                return read;
            }
            match read {
                Ok(_) => {}
                // Another file of the bag may have frames.
                Err(error) if is_without_frames(&error) && (self.records > 0 || !self.rest.is_empty()) => {}
                Err(error) if self.records > 0 && is_breakage(&error) => {
                    let (records, bytes) = (self.records, self.consumed.load(Ordering::Relaxed));
                    self.breakage.get_or_insert(Breakage { records, bytes, reason: error.to_string() });
                }
                Err(error) => return Err(error),
            }
            match self.rest.pop_front() {
                Some(next) => {
                    (self.reader, self.consumed) =
                        FormatReader::of_source(Box::new(regular_file::open(&next)?), &self.budget)?;
                    self.number = 0;
                }
                None => self.is_ended = true,
            }
        }
        Ok(None)
    }

    fn note_time(&mut self, record: &LogRecord) {
        let stamp = record.stamp;
        let none = FrameTimes { frames: 0, first: stamp, last: stamp };
        if self.times.len() < self.interfaces.len() {
            self.times.resize(self.interfaces.len(), none);
        }
        if let (Some(times), EntryContent::Data(_)) = (self.times.get_mut(record.interface.0), record.content)
        {
            times.frames += 1;
            times.last = stamp;
        }
    }

    fn next_whole_record(&mut self) -> io::Result<Option<LogRecord>> {
        while let Some(entry) = self.reader.next()? {
            self.number += 1;
            self.budget.spend(ENTRY_WORK)?;
            let reason = match entry {
                Ok(None) => continue,
                Ok(Some(LogEntry { stamp, interface, content })) => {
                    match position(&mut self.interfaces, interface) {
                        Ok(interface) => return Ok(Some(LogRecord { stamp, interface, content })),
                        Err(reason) => reason,
                    }
                }
                Err(reason) => reason,
            };
            self.bad_lines += 1;
            if self.records == 0 && self.bad_lines == MAX_BAD_BEFORE_FIRST {
                return Err(refused(
                    format!("none of its first {MAX_BAD_BEFORE_FIRST} lines can be read"),
                    "check that it is a recording, and not damaged",
                ));
            }
            self.first_bad.get_or_insert((self.number, reason));
        }
        Ok(None)
    }

    /// Returns the budget of the recording, for other readers of the same files.
    pub fn budget(&self) -> &FileBudget {
        &self.budget
    }

    /// Returns the interface names so far, in order of appearance.
    pub fn interfaces(&self) -> &[String] {
        &self.interfaces
    }

    /// Returns the number of unreadable lines (in a binary format: objects) so far.
    pub fn bad_lines(&self) -> u64 {
        self.bad_lines
    }

    /// Returns number and fault of the first unreadable line or object.
    pub fn first_bad(&self) -> Option<(u64, BadLine)> {
        self.first_bad
    }

    /// Returns the interface with the highest frame rate, if it exceeds the capacity of a bus. Frames without
    /// times are ignored.
    pub fn densest(&self) -> Option<Crowd> {
        let crowds = self.interfaces.iter().zip(&self.times).filter_map(|(interface, times)| {
            let FrameTimes { frames, first, last } = *times;
            let nanos = u64::try_from(last.as_nanos().saturating_sub(first.as_nanos())).ok()?;
            let rate_hz = (u128::from(frames) * 1_000_000_000).checked_div(nanos.into())?;
            let crowd = Crowd { interface: interface.clone(), frames, span: Duration::from_nanos(nanos) };
            (frames >= MIN_CROWD && rate_hz > MAX_RATE_HZ).then_some((rate_hz, crowd))
        });
        crowds.max_by_key(|(rate_hz, _)| *rate_hz).map(|(_, crowd)| crowd)
    }

    /// Returns where the file broke off; `None` before that, and for a whole file.
    pub fn breakage(&self) -> Option<&Breakage> {
        self.breakage.as_ref()
    }
}

/// Returns true for the error about a bag whose topics have no frames.
pub fn is_without_frames(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::Unsupported
}

/// Returns true for an error in the content of a file, rather than of the disk.
#[allow(clippy::wildcard_enum_match_arm)] // there are forty kinds
pub fn is_breakage(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::UnexpectedEof
            | io::ErrorKind::FileTooLarge
            | io::ErrorKind::InvalidData
            | io::ErrorKind::InvalidInput
            | io::ErrorKind::Other
    )
}

/// Returns the position of an interface, which is added if it is new.
fn position(names: &mut Vec<String>, interface: EntryInterface<'_>) -> Result<InterfaceIndex, BadLine> {
    let known = names.iter().position(|name| interface.is(name));
    if known.is_none() {
        if names.len() == MAX_INTERFACES {
            return Err(BadLine::NoInterface);
        }
        names.push(interface.to_string());
    }
    Ok(InterfaceIndex(known.unwrap_or(names.len() - 1)))
}

impl FormatReader {
    /// Reads a source, decompressed if necessary. Also returns the counter of the bytes read from it.
    fn of_source(source: Box<dyn Read + Send>, budget: &FileBudget) -> io::Result<(Self, Arc<AtomicU64>)> {
        let source = CountedSource::new(BufReader::with_capacity(BUFFER, source), budget.clone());
        let consumed = source.consumed();
        Ok((Self::new(decompressed(Box::new(source), budget)?, budget)?, consumed))
    }

    /// Recognises the format by the beginning of `source`, and reads no more than necessary.
    fn new(mut source: Box<dyn Read + Send>, budget: &FileBudget) -> io::Result<Self> {
        let mut head = Vec::with_capacity(HEAD);
        let mut format = None;
        while format.is_none() && head.len() < HEAD {
            let mut piece = [0; 512];
            let room = piece.len().min(HEAD - head.len());
            match source.read(&mut piece[..room]) {
                Ok(0) => break,
                Ok(read) => head.extend(&piece[..read]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
            format = Format::of(&head, true);
        }
        let last = head.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
        let format = format.or_else(|| Format::of(&head, false));
        let format = format.or_else(|| Format::of_line(without_byte_order_mark(last).trim_ascii()));
        let Some(format) = format else { return Err(not_recognised(&head)) };
        let text = head.len() - without_byte_order_mark(&head).len();
        let mut head = Cursor::new(head);
        if let Format::Lines(_) = format {
            head.set_position(text as u64);
        }
        let source = head.chain(source);
        Ok(match format {
            Format::Lines(format) => {
                Self::Lines { lines: Lines::new(source), format, reader: format.usual_reader() }
            }
            Format::Objects(format) => {
                let bytes = Box::new(BufReader::with_capacity(BUFFER, source));
                let source = ObjectSource { bytes, budget: budget.clone() };
                Self::Objects((format.reader)(source)?)
            }
        })
    }

    /// Returns the entry of the next line or object.
    fn next(&mut self) -> io::Result<Option<Outcome<'_>>> {
        match self {
            Self::Objects(reader) => reader.next_object(),
            Self::Lines { lines, reader, .. } => {
                let Some(line) = lines.next_line()? else { return Ok(None) };
                let text = match line {
                    Ok(line) => line.trim_ascii(),
                    Err(reason) => return Ok(Some(Err(reason))),
                };
                Ok(Some(if text.is_empty() { Ok(None) } else { reader.read(text) }))
            }
        }
    }
}

impl std::fmt::Debug for Log {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Log({} bad)", self.bad_lines)
    }
}

#[cfg(test)]
mod tests;
