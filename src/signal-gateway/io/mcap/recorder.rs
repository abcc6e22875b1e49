//! The bags of a folder, and the thread that writes them.
//!
//! Each start begins a bag `gateway_<counter>_<time>`. The counter continues from the existing folders, so it
//! orders them whatever the clock says. To make room, the oldest bags are removed first, then the oldest
//! files of the current bag.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::bag::{Bag, FileLimits};
use super::encoder::{Encoder, RecordedMessage};
use crate::io::awaited_thread::AwaitedThread;
use crate::io::lock::lock;
use crate::process_status::recordings::McapState;
use can_signal::can::CanInput;
use gateway_base::time::{Now, WallStamp};
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::Output;
use ros_messages::cdr::{CdrBytes, Endian};

/// Maximum number of queued events; each needs a few hundred bytes.
const MAX_WAITING: usize = 50_000;
/// Interval at which the thread processes the queue.
const TAKE_INTERVAL: Duration = Duration::from_millis(100);
/// Interval at which chunks are closed and written; a killed process loses at most this much.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum number of bytes that wait for a disk that accepts no data; further events are lost and counted.
const MAX_PENDING_BYTES: usize = 16 << 20;
/// Interval between attempts to write to a folder that could not be written.
const RETRY: Duration = Duration::from_secs(10);

const PREFIX: &str = "gateway_";

/// Size limits of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecorderLimits {
    /// Limits after which a bag continues in a new file.
    pub file: FileLimits,
    /// Size of all bags in the folder, bytes; the oldest are removed.
    pub total_bytes: u64,
}

/// A recording in progress.
#[derive(Debug)]
pub struct McapRecorder {
    queue: Arc<RecorderQueue>,
    thread: AwaitedThread,
    /// Number of calls so far.
    calls: AtomicU64,
}

/// Something to record, with its log time.
#[derive(Debug)]
enum RecordedEvent {
    Received(CanInput, WallStamp),
    GivenOut(Output, WallStamp),
    Sample { subscription: usize, bytes: CdrBytes, endian: Endian, at: WallStamp },
    Call(TimedCall),
}

#[derive(Debug, Default)]
struct RecorderQueue {
    waiting: Mutex<QueuedEvents>,
    stopping: Condvar,
    state: Mutex<McapState>,
}

#[derive(Debug, Default)]
struct QueuedEvents {
    events: Vec<RecordedEvent>,
    /// Number of events lost to a full queue since the thread last read it.
    lost: u64,
    is_stopping: bool,
}

impl McapRecorder {
    /// Starts the thread, which creates the folder if it is missing, and retries while it cannot be written.
    /// Fails if the thread cannot be started.
    pub fn start(folder: &Path, limits: RecorderLimits, encoder: Encoder) -> io::Result<Self> {
        let queue = Arc::new(RecorderQueue::default());
        lock(&queue.state).folder = folder.display().to_string();
        let mut writer = BagWriter {
            queue: Arc::clone(&queue),
            folder: folder.to_owned(),
            limits,
            encoder,
            bag: None,
            cause: None,
            older: Vec::new(),
            next_try: Instant::now(),
            next_flush: Instant::now(),
        };
        let thread = AwaitedThread::start("mcap", move || writer.run())?;
        Ok(Self { queue, thread, calls: AtomicU64::new(0) })
    }

    /// Records an input of a bus. Never blocks: if the queue is full, the input is lost and counted.
    pub fn received(&self, input: CanInput, at: WallStamp) {
        self.push(RecordedEvent::Received(input, at));
    }

    /// Records an output that was published at `at`. Never blocks.
    pub fn given_out(&self, output: Output, at: WallStamp) {
        self.push(RecordedEvent::GivenOut(output, at));
    }

    /// Records a received ROS 2 sample; `subscription` is the position of its subscription. Never blocks.
    pub fn sample(&self, subscription: usize, bytes: CdrBytes, endian: Endian, at: WallStamp) {
        self.push(RecordedEvent::Sample { subscription, bytes, endian, at });
    }

    /// Records a call of the gateway. Never blocks. A lost call leaves a gap in the numbers.
    pub fn call(&self, call: GatewayCall, at: Now) {
        let number = self.calls.fetch_add(1, Ordering::Relaxed) + 1;
        self.push(RecordedEvent::Call(TimedCall { number, at, call }));
    }

    fn push(&self, event: RecordedEvent) {
        let mut waiting = lock(&self.queue.waiting);
        if waiting.events.len() < MAX_WAITING {
            waiting.events.push(event);
        } else {
            waiting.lost += 1;
        }
    }

    /// Returns the current state.
    pub fn state(&self) -> McapState {
        lock(&self.queue.state).clone()
    }

    /// Writes all queued events and ends the bag; waits at most for `patience`.
    pub fn stop(&self, patience: Duration) {
        lock(&self.queue.waiting).is_stopping = true;
        self.queue.stopping.notify_all();
        if !self.thread.ends_within(patience) {
            tracing::warn!("the recording is not complete: the disk is too slow");
        }
    }
}

/// State of the writing thread.
struct BagWriter {
    queue: Arc<RecorderQueue>,
    folder: PathBuf,
    limits: RecorderLimits,
    encoder: Encoder,
    /// `None` while the folder cannot be written.
    bag: Option<Bag>,
    /// Error of the last attempt to begin a bag; valid until the next attempt.
    cause: Option<(io::ErrorKind, String)>,
    /// Earlier bags with their sizes, oldest first.
    older: Vec<(PathBuf, u64)>,
    /// Time of the next attempt while the folder cannot be written.
    next_try: Instant,
    next_flush: Instant,
}

impl BagWriter {
    /// Records events until a stop.
    fn run(&mut self) {
        loop {
            let QueuedEvents { events, lost, is_stopping } = self.take();
            let written = self.record(&events);
            lock(&self.queue.state).lost += lost;
            self.note(written);
            if is_stopping {
                let finished = self.bag.as_mut().map_or(Ok(()), Bag::finish);
                self.note(finished);
                return;
            }
            if Instant::now() >= self.next_flush {
                self.next_flush = Instant::now() + FLUSH_INTERVAL;
                let flushed = self.flush();
                if flushed.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
                    // The folder was removed; further events go to a new bag.
                    self.bag = None;
                }
                self.note(flushed);
            }
        }
    }

    /// Waits for [`TAKE_INTERVAL`] or a stop, then takes the queued events.
    fn take(&self) -> QueuedEvents {
        let waiting = lock(&self.queue.waiting);
        let waited =
            self.queue.stopping.wait_timeout_while(waiting, TAKE_INTERVAL, |waiting| !waiting.is_stopping);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut waiting)
    }

    /// Adds events to the bag. Returns the first error, but tries all events.
    fn record(&mut self, events: &[RecordedEvent]) -> io::Result<()> {
        let mut outcome = Ok(());
        for event in events {
            let messages: Vec<RecordedMessage> = match event {
                RecordedEvent::Received(input, at) => self.encoder.received(input, *at).into_iter().collect(),
                RecordedEvent::GivenOut(output, at) => self.encoder.given_out(output, *at),
                RecordedEvent::Sample { subscription, bytes, endian, at } => {
                    self.encoder.sample(*subscription, bytes.clone(), *endian, *at).into_iter().collect()
                }
                RecordedEvent::Call(call) => self.encoder.call(call).into_iter().collect(),
            };
            for message in messages {
                let added = self.add(&message);
                let mut state = lock(&self.queue.state);
                match added {
                    Ok(()) => state.messages += 1,
                    Err(error) => {
                        state.lost += 1;
                        outcome = outcome.and(Err(error));
                    }
                }
            }
        }
        outcome
    }

    fn add(&mut self, message: &RecordedMessage) -> io::Result<()> {
        if self.bag.is_none() {
            if Instant::now() < self.next_try {
                let not_found = (io::ErrorKind::NotFound, "the folder was removed".to_owned());
                let (kind, text) = self.cause.clone().unwrap_or(not_found);
                return Err(io::Error::new(kind, text));
            }
            self.next_try = Instant::now() + RETRY;
            let begun = self.begin(message.log_time);
            self.cause = begun.as_ref().err().map(|error| (error.kind(), error.to_string()));
            begun?;
        }
        let Some(bag) = &mut self.bag else { return Ok(()) };
        if bag.pending_bytes() > MAX_PENDING_BYTES {
            return Err(io::ErrorKind::StorageFull.into());
        }
        bag.add(message)
    }

    /// Begins a bag, and lists the earlier bags in the folder.
    fn begin(&mut self, at: WallStamp) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut older = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let counter =
                name.strip_prefix(PREFIX).and_then(|rest| rest.split('_').next()?.parse::<u64>().ok());
            if let Some(counter) = counter.filter(|_| path.is_dir()) {
                let size = size_of(&path);
                older.push((counter, path, size));
            }
        }
        older.sort();
        let counter = older.last().map_or(0, |(counter, ..)| *counter).saturating_add(1);
        self.older = older.into_iter().map(|(_, path, size)| (path, size)).collect();
        let folder = self.folder.join(format!("{PREFIX}{counter:06}_{}", at.utc_text()));
        self.bag = Some(Bag::create(&folder, self.limits.file, self.encoder.channels())?);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        let Some(bag) = &mut self.bag else { return Ok(()) };
        bag.flush()?;
        let mut total = bag.bytes() + self.older.iter().map(|(_, size)| size).sum::<u64>();
        while total > self.limits.total_bytes {
            if self.older.is_empty() {
                let Some(size) = bag.remove_oldest()? else { break };
                total -= size;
            } else {
                let (path, size) = self.older.remove(0);
                fs::remove_dir_all(path)?;
                total -= size;
            }
        }
        let mut state = lock(&self.queue.state);
        (state.bag, state.files, state.bytes) = (Some(bag.name.clone()), bag.file_count(), total);
        Ok(())
    }

    /// Counts each failure, and logs a repeated failure only once. A successful write ends it.
    fn note(&self, outcome: io::Result<()>) {
        let mut state = lock(&self.queue.state);
        let Err(error) = outcome else {
            // The failure lasts until the disk has accepted all pending data.
            state.is_failing &= self.bag.as_ref().is_none_or(|bag| bag.pending_bytes() > 0);
            return;
        };
        let text = error.to_string();
        if !state.is_failing || state.last_error.as_ref() != Some(&text) {
            tracing::warn!("recording not written in {}: {text}", self.folder.display());
        }
        state.failures += 1;
        state.is_failing = true;
        state.last_error = Some(text);
    }
}

/// Returns the size of the files in a folder, bytes; files that cannot be read count as 0.
fn size_of(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|metadata| metadata.len()).sum()
}
