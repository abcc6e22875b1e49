//! The bags of a folder, and the thread that writes them.
//!
//! Each start begins a bag `gateway_<counter>_<time>`. The counter continues from the folders that are there,
//! so that it orders them whatever the clock says. The oldest bags, then the oldest files of this one, make
//! room for new ones.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::bag::{Bag, FileLimits};
use super::encoder::{Encoder, RecordedMessage};
use crate::process_status::recordings::McapState;
use can_signal::can::CanInput;
use gateway_base::time::{Now, WallStamp};
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::Output;
use ros_messages::cdr::{CdrBytes, Endian};

/// Most events that wait for the thread; each needs some hundred bytes.
const MAX_WAITING: usize = 50_000;
/// Interval at which the thread takes what waits.
const TAKE_INTERVAL: Duration = Duration::from_millis(100);
/// Interval at which chunks are closed and written: what a killed process loses.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);
/// Most bytes that wait for a disk that does not take them; what comes later is lost and counted.
const MAX_PENDING_BYTES: usize = 16 << 20;
/// Interval at which a folder that could not be written is tried again.
const RETRY: Duration = Duration::from_secs(10);

const PREFIX: &str = "gateway_";

/// How much is recorded, and where.
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
    ended: Receiver<()>,
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
    /// Number of events that found no room since the thread last looked.
    lost: u64,
    is_stopping: bool,
}

impl McapRecorder {
    /// Starts the thread, which makes the folder if it is missing and keeps trying where it cannot be
    /// written.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn start(folder: &Path, limits: RecorderLimits, encoder: Encoder) -> io::Result<Self> {
        let queue = Arc::new(RecorderQueue::default());
        lock(&queue.state).folder = folder.display().to_string();
        let (end, ended) = channel();
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
        thread::Builder::new().name("mcap".to_owned()).spawn(move || {
            // Dropped at the end, which ends the wait of `stop`.
            let _end: std::sync::mpsc::Sender<()> = end;
            writer.run();
        })?;
        Ok(Self { queue, ended, calls: AtomicU64::new(0) })
    }

    /// Records what was received on a bus. Never blocks: what finds the queue full is lost and counted.
    pub fn received(&self, input: CanInput, at: WallStamp) {
        self.push(RecordedEvent::Received(input, at));
    }

    /// Records an output that was given out at `at`; never blocks.
    pub fn given_out(&self, output: Output, at: WallStamp) {
        self.push(RecordedEvent::GivenOut(output, at));
    }

    /// Records a sample of ROS 2 that was received, by the position of its subscription; never blocks.
    pub fn sample(&self, subscription: usize, bytes: CdrBytes, endian: Endian, at: WallStamp) {
        self.push(RecordedEvent::Sample { subscription, bytes, endian, at });
    }

    /// Records a call of the gateway; never blocks. One that is lost leaves a gap in the numbers.
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

    /// Returns the present state.
    pub fn state(&self) -> McapState {
        lock(&self.queue.state).clone()
    }

    /// Ends the bag with all that waits, at most for `patience`.
    pub fn stop(&self, patience: Duration) {
        lock(&self.queue.waiting).is_stopping = true;
        self.queue.stopping.notify_all();
        if self
            .ended
            .recv_timeout(patience)
            .is_err_and(|error| error == std::sync::mpsc::RecvTimeoutError::Timeout)
        {
            tracing::warn!("the recording is not complete: the disk is too slow");
        }
    }
}

/// The part of the writing thread.
struct BagWriter {
    queue: Arc<RecorderQueue>,
    folder: PathBuf,
    limits: RecorderLimits,
    encoder: Encoder,
    /// `None` while the folder cannot be written.
    bag: Option<Bag>,
    /// Why the last bag could not begin, which holds until it is tried again.
    cause: Option<(io::ErrorKind, String)>,
    /// Earlier bags with their sizes, oldest first.
    older: Vec<(PathBuf, u64)>,
    /// When a folder that cannot be written is tried again.
    next_try: Instant,
    next_flush: Instant,
}

impl BagWriter {
    /// Records what comes until a stop.
    fn run(&mut self) {
        loop {
            let (events, lost, is_stopping) = self.take();
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
                    // The folder was removed; what comes now goes to a new one.
                    self.bag = None;
                }
                self.note(flushed);
            }
        }
    }

    /// What waits, after [`TAKE_INTERVAL`] or a stop.
    fn take(&self) -> (Vec<RecordedEvent>, u64, bool) {
        let waiting = lock(&self.queue.waiting);
        let waited =
            self.queue.stopping.wait_timeout_while(waiting, TAKE_INTERVAL, |waiting| !waiting.is_stopping);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let lost = std::mem::take(&mut waiting.lost);
        (std::mem::take(&mut waiting.events), lost, waiting.is_stopping)
    }

    /// Adds events to the bag; an error is the first, after which the others are tried as well.
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

    /// Begins a bag, and learns which earlier ones there are.
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
        (state.bag, state.files, state.bytes) = (
            bag.folder().file_name().map(|name| name.to_string_lossy().into_owned()),
            bag.file_count(),
            total,
        );
        Ok(())
    }

    /// Each failure is counted; one that repeats is logged once. A success of the disk ends it.
    fn note(&self, outcome: io::Result<()>) {
        let mut state = lock(&self.queue.state);
        let Err(error) = outcome else {
            // Until the disk has taken all that waited, nothing has succeeded.
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

/// Size of the files in a folder, bytes; what cannot be read counts nothing.
fn size_of(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|metadata| metadata.len()).sum()
}

/// Nothing behind these locks can be left half done by a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
