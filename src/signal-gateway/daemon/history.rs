//! Stores the history of changes: in memory for clients, and in a file across restarts.

use std::fs::File;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, TryLockError};
use std::time::Duration;

use crate::io::awaited_thread::AwaitedThread;
use crate::io::clock::Clock;
use crate::io::history_file::{HistoryFile, ReadHistory, WriterState};
use crate::io::lock::lock;
use crate::io::recorder::log_of;
use crate::report::gateway::Changes;
use crate::report::text::counted;
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::gateway::event::Output;
use gateway_core::gateway::history::{
    Change, ChangeKind, History, HistoryEntry, HistoryPage, HistoryRequest, InBlackBox,
};

/// Maximum memory of the history, bytes: about eight hours at one change per second.
const MAX_BYTES: usize = 12 * 1024 * 1024;
/// Interval at which a changed history is written; a killed process loses at most this much.
const SAVE_INTERVAL: Duration = Duration::from_secs(60);
/// Maximum wait for the disk at the end, after all other waits.
const STOP_PATIENCE: Duration = Duration::from_millis(200);
/// Maximum number of changes that a killed process can have numbered but not written.
const MOST_UNWRITTEN: u64 = 100_000;
/// Subject of changes of the process itself.
const SUBJECT: &str = "gateway";

/// The history for its readers. Clones share it.
#[derive(Debug, Clone)]
pub(super) struct SharedHistory(Arc<Mutex<Shared>>);

#[derive(Debug)]
struct Shared {
    history: History,
    /// Folder of the black-box files.
    folder: Option<PathBuf>,
}

/// Reason why the frames of an entry cannot be shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum NoFrames {
    #[error("there is no change of this number, or no longer")]
    NoEntry,
    #[error(
        "no black box has the frames of this change: one is written around each change to ERROR, some seconds later"
    )]
    NotRecorded,
    #[error("the black box {0} is no longer there; [black_box] keep says how many are kept")]
    NoFile(String),
}

impl Shared {
    /// Returns the number of the next change.
    fn take(&mut self, notes: impl Iterator<Item = Note>) -> u64 {
        for note in notes {
            match note {
                Note::Change(change, at, stamp) => self.history.add(change, at, stamp),
                Note::Recorded(time, recording) => self.history.recorded(&time, &recording),
            }
        }
        self.history.next_number()
    }
}

impl SharedHistory {
    /// Returns the requested entries.
    pub(super) fn page(&self, request: HistoryRequest) -> HistoryPage {
        lock(&self.0).history.page(request)
    }

    /// Returns the log with the frames of an entry, the entry, and its place in the log.
    pub(super) fn frames(&self, number: u64) -> Result<(PathBuf, HistoryEntry, InBlackBox), NoFrames> {
        let shared = lock(&self.0);
        let entry = shared.history.entry(number).ok_or(NoFrames::NoEntry)?.clone();
        let folder = shared.folder.clone();
        drop(shared);
        let place = entry.black_box.clone().ok_or(NoFrames::NotRecorded)?;
        let found = folder.and_then(|folder| log_of(&folder, &place.recording).ok()?);
        match found {
            Some(log) => Ok((log, entry, place)),
            None => Err(NoFrames::NoFile(place.recording)),
        }
    }
}

/// Records the changes of the gateway.
pub(super) struct HistoryKeeper {
    pub(super) shared: SharedHistory,
    changes: Changes,
    /// Changes recorded while a client read the history, since the gateway's loop must not block.
    waiting: Vec<Note>,
    /// Number of the next change, without the changes that still wait.
    pub(super) next_number: u64,
    clock: Clock,
    /// Lock of the file, held while this process may write it.
    lock: Option<File>,
    writer: Option<HistoryWriter>,
}

enum Note {
    Change(Change, Option<MonoTime>, WallStamp),
    Recorded(RangeInclusive<MonoTime>, String),
}

impl HistoryKeeper {
    /// Creates an empty history, which is not written to a file.
    pub(super) fn new() -> Self {
        let shared = Shared { history: History::new(MAX_BYTES), folder: None };
        Self {
            shared: SharedHistory(Arc::new(Mutex::new(shared))),
            changes: Changes::default(),
            waiting: Vec::new(),
            next_number: 0,
            clock: Clock::start(),
            lock: None,
            writer: None,
        }
    }

    /// Continues the history of the file in this folder, records that the process has started, and writes the
    /// file from now on; returns the entries of the file. An unreadable file is left unchanged, and nothing
    /// is written.
    pub(super) fn begin(&mut self, folder: Option<&Path>) -> Vec<HistoryEntry> {
        let file = folder.and_then(|folder| self.restore(folder));
        // Greater than any number of an earlier process, unless the clock was set back.
        let millis = self.clock.now().wall.as_nanos() / 1_000_000;
        lock(&self.shared.0).history.go_on_from(u64::try_from(millis).unwrap_or(0));
        let earlier = lock(&self.shared.0).history.entries();
        self.note(ChangeKind::Started, format!("started, {}", env!("SIGNAL_GATEWAY_VERSION")));
        self.writer = file.and_then(|file| {
            let writer = HistoryWriter::start(file, self.shared.clone());
            writer.inspect_err(|error| tracing::warn!("the history is not written: {error}")).ok()
        });
        earlier
    }

    /// Reads the file in this folder; returns it if it may be written.
    fn restore(&mut self, folder: &Path) -> Option<HistoryFile> {
        lock(&self.shared.0).folder = Some(folder.to_owned());
        let file = HistoryFile::in_folder(folder);
        let (claimed, read) = match file.claim().and_then(|claimed| Ok((claimed, file.read()?))) {
            Ok(claimed) => claimed,
            Err(error) => {
                let path = file.path.display();
                tracing::warn!(
                    "the history is not kept over the end of the process: {path}: {error}; give it a folder \
                     of its own by [black_box] folder, or move the file away"
                );
                return None;
            }
        };
        let now = self.clock.now();
        let mut shared = lock(&self.shared.0);
        if let Some(ReadHistory { writer, entries, unreadable }) = read {
            let unreadable = unreadable + shared.history.restore(entries);
            if unreadable > 0 {
                let lines = counted(unreadable, "line");
                let text = format!("{lines} of the history could not be read");
                tracing::warn!("{}: {text}", file.path.display());
                shared.history.add(process(ChangeKind::Missing, text), None, now.wall);
            }
            if writer == WriterState::Running {
                let next = shared.history.next_number();
                shared.history.go_on_from(next + MOST_UNWRITTEN);
                let text = "the run before did not end in order; its last minute may be missing";
                shared.history.add(process(ChangeKind::Missing, text.to_owned()), None, now.wall);
            }
        }
        drop(shared);
        self.lock = claimed;
        Some(file)
    }

    /// Records the changes in an output.
    pub(super) fn given_out(&mut self, output: &Output, at: MonoTime) {
        let changes = self.changes.of(output);
        if !changes.is_empty() {
            let stamp = self.clock.now().wall;
            self.waiting.extend(changes.into_iter().map(|event| Note::Change(event.change, Some(at), stamp)));
        }
        if !self.waiting.is_empty() {
            self.take_over();
        }
    }

    /// Records that the frames of this time are in a black-box recording.
    pub(super) fn recorded(&mut self, time: RangeInclusive<MonoTime>, recording: String) {
        self.waiting.push(Note::Recorded(time, recording));
        self.take_over();
    }

    /// Moves waiting changes into the history, unless a client is reading it at this moment.
    fn take_over(&mut self) {
        let mut shared = match self.shared.0.try_lock() {
            Ok(shared) => shared,
            Err(TryLockError::WouldBlock) => return,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        self.next_number = shared.take(self.waiting.drain(..));
    }

    /// Records the end of the process, and starts the last write of the history.
    pub(super) fn end(&mut self) {
        self.note(ChangeKind::Stopped, "stopped".to_owned());
        if let Some(writer) = &mut self.writer {
            writer.stop = None;
        }
    }

    /// Waits until the history is written. Call it after everything else has ended, which gives the disk more
    /// time.
    pub(super) fn wait(self) {
        if self.writer.is_some_and(|writer| !writer.thread.ends_within(STOP_PATIENCE)) {
            tracing::warn!("the end of the history is not written: the disk is too slow");
        }
    }

    fn note(&mut self, kind: ChangeKind, text: String) {
        let now = self.clock.now();
        self.waiting.push(Note::Change(process(kind, text), None, now.wall));
        self.next_number = lock(&self.shared.0).take(self.waiting.drain(..));
    }
}

/// Returns a change of the process itself.
fn process(kind: ChangeKind, text: String) -> Change {
    let level = if kind == ChangeKind::Missing { Level::Warn } else { Level::Ok };
    Change { kind, level, subject: SUBJECT.to_owned(), text, remedy: String::new() }
}

/// Writes the file in a thread: at intervals, and at the end.
struct HistoryWriter {
    /// Dropped to stop it.
    stop: Option<Sender<()>>,
    thread: AwaitedThread,
}

impl HistoryWriter {
    fn start(file: HistoryFile, shared: SharedHistory) -> std::io::Result<Self> {
        let (stop, stopped) = channel();
        let thread = AwaitedThread::start("history", move || write_until(&stopped, &file, &shared))?;
        Ok(Self { stop: Some(stop), thread })
    }
}

fn write_until(stopped: &Receiver<()>, file: &HistoryFile, shared: &SharedHistory) {
    let (mut written, mut is_failing) = (None, false);
    // The first write is immediate, so that the file shows that this process is running.
    let mut interval = Duration::ZERO;
    loop {
        let is_over = stopped.recv_timeout(interval) != Err(RecvTimeoutError::Timeout);
        interval = SAVE_INTERVAL;
        let (revision, entries) = {
            let shared = lock(&shared.0);
            let revision = Some(shared.history.revision());
            (revision, if revision == written && !is_over { Vec::new() } else { shared.history.entries() })
        };
        if revision != written || is_over {
            let writer = if is_over { WriterState::Stopped } else { WriterState::Running };
            match file.write(&entries, writer) {
                Ok(()) => (written, is_failing) = (revision, false),
                Err(error) if is_failing => tracing::debug!("{}: {error}", file.path.display()),
                Err(error) => {
                    is_failing = true;
                    tracing::warn!("the history is not written: {}: {error}", file.path.display());
                }
            }
        }
        if is_over {
            return;
        }
    }
}
