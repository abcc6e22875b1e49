//! Writes black-box files to disk in a thread, each completely or not at all, and retains a limited number.
//!
//! A recording is `fault-<counter>-<boot>-<time>.log` with a `.decisions` and an `.mcap` file. The counter
//! continues from the files in the folder and orders them whatever the clock says, since a vehicle computer
//! without a battery-backed clock starts each boot in the past. Boot and time are for the reader. A `.draft`
//! is a file being written.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::awaited_thread::AwaitedThread;
use super::lock::lock;
use super::mcap::encoder::Encoder;
use super::mcap::file::McapFile;
use super::new_files::write_whole;
use crate::process_status::recordings::RecorderState;
use gateway_base::time::MonoTime;
use gateway_core::gateway::black_box::Recording;

/// Maximum number of recordings that wait for a slow disk; each needs about 10 MB.
const MAX_WAITING: usize = 1;
/// Interval between attempts to write to a folder that could not be written.
const RETRY: Duration = Duration::from_secs(10);

const PREFIX: &str = "fault-";

/// Formats one decision with its time.
pub type DecisionLine = fn(MonoTime, &str) -> String;

/// Writes the black-box files of a folder in a thread.
#[derive(Debug)]
pub struct BlackBoxRecorder {
    /// `None` after it was stopped.
    recordings: Option<SyncSender<Recording>>,
    state: Arc<Mutex<RecorderState>>,
    keep: Arc<AtomicUsize>,
    boot: String,
    thread: AwaitedThread,
}

impl BlackBoxRecorder {
    /// Starts the thread, which keeps the newest `keep` recordings in `folder` and tests at once whether it
    /// can write there; `encoder` creates the messages of the MCAP files. A folder that cannot be written is
    /// reported in the log and in the state, and retried. Fails if the thread cannot be started.
    pub fn start(folder: &Path, keep: usize, line: DecisionLine, encoder: Encoder) -> io::Result<Self> {
        let state = RecorderState { folder: folder.display().to_string(), ..RecorderState::default() };
        let state = Arc::new(Mutex::new(state));
        let (sender, recordings) = sync_channel(MAX_WAITING);
        let (limit, boot) = (Arc::new(AtomicUsize::new(keep)), boot());
        let path = folder.to_owned();
        let mut writer = RecordingWriter {
            keep: Arc::clone(&limit),
            folder: Folder { path, keep, boot: boot.clone(), last_counter: 0 },
            line,
            encoder,
            state: Arc::clone(&state),
        };
        let thread = AwaitedThread::start("black-box", move || writer.run(&recordings))?;
        Ok(Self { recordings: Some(sender), state, keep: limit, boot, thread })
    }

    /// Queues a recording. Never blocks: if the queue is full, the recording is lost and counted.
    pub fn save(&self, recording: Recording) {
        let Some(recordings) = &self.recordings else { return };
        let error = match recordings.try_send(recording) {
            Ok(()) => return,
            Err(TrySendError::Full(_)) => "the disk is too slow",
            Err(TrySendError::Disconnected(_)) => "the thread has ended",
        };
        tracing::warn!("black box not written: {error}");
        fail(&self.state, error.to_owned());
    }

    /// Returns the end of a recording's file names, which [`log_of`] finds again.
    pub fn name(&self, recording: &Recording) -> String {
        format!("{}-{}", self.boot, recording.fault.wall.utc_text())
    }

    /// Changes the number of recordings to keep, from the next one on.
    pub fn set_keep(&self, keep: usize) {
        self.keep.store(keep, Ordering::Relaxed);
    }

    /// Returns the number of recordings, the failures and the newest file.
    pub fn state(&self) -> RecorderState {
        lock(&self.state).clone()
    }

    /// Waits until the queued recordings are written, at most for `patience`.
    pub fn stop(&mut self, patience: Duration) {
        self.recordings = None;
        if !self.thread.ends_within(patience) {
            tracing::warn!("black box not written: the disk is too slow");
        }
    }
}

/// Returns the log of a recording in a folder, by the end of its name; `None` if there is none, or no longer.
/// Fails if the folder cannot be read.
pub fn log_of(folder: &Path, recording: &str) -> io::Result<Option<PathBuf>> {
    let end = format!("-{recording}.log");
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        if name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(&end)) {
            found.push(folder.join(name));
        }
    }
    // The newest, if there are two within a second or the clock was set back.
    Ok(found.into_iter().max())
}

struct RecordingWriter {
    folder: Folder,
    keep: Arc<AtomicUsize>,
    line: DecisionLine,
    encoder: Encoder,
    state: Arc<Mutex<RecorderState>>,
}

impl RecordingWriter {
    /// Writes recordings until the sender is dropped.
    fn run(&mut self, recordings: &Receiver<Recording>) {
        self.prepare();
        loop {
            match recordings.recv_timeout(RETRY) {
                Ok(recording) => {
                    self.folder.keep = self.keep.load(Ordering::Relaxed);
                    self.save(&recording);
                }
                Err(RecvTimeoutError::Timeout) if lock(&self.state).is_failing => self.prepare(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Tests whether the folder can be written, and removes incomplete files.
    fn prepare(&mut self) {
        match self.folder.prepare().and_then(|()| self.folder.prune()) {
            Ok(kept) => {
                let mut state = lock(&self.state);
                (state.newest, state.recordings, state.is_failing) = (kept.newest, kept.recordings, false);
            }
            Err(error) => self.note_failure(&error),
        }
    }

    fn save(&mut self, recording: &Recording) {
        let time = recording.fault.wall.utc_text();
        let decisions = recording.decisions(self.line);
        let mcap = |path: &Path| write_mcap(path, recording, &mut self.encoder);
        let saved = self.folder.save(&time, &recording.log(), &decisions, mcap);
        let pruned = saved.and_then(|saved| Ok((saved, self.folder.prune()?)));
        match pruned {
            Ok((Saved { path, mcap }, kept)) => {
                tracing::info!("black box written: {}", path.display());
                let mut state = lock(&self.state);
                state.written += 1;
                (state.newest, state.recordings) = (kept.newest, kept.recordings);
                state.is_failing &= mcap.is_err();
                drop(state);
                if let Err(error) = mcap {
                    self.note_failure(&error);
                }
            }
            Err(error) => self.note_failure(&error),
        }
    }

    /// Counts each failure; logs a repeated one only once.
    fn note_failure(&self, error: &io::Error) {
        let text = error.to_string();
        let is_known = |state: &RecorderState| state.is_failing && state.last_error.as_ref() == Some(&text);
        if !is_known(&lock(&self.state)) {
            let folder = self.folder.path.display();
            tracing::warn!("black box not written in {folder}: {text}; change [black_box] folder");
        }
        fail(&self.state, text);
    }
}

fn fail(state: &Mutex<RecorderState>, error: String) {
    let mut state = lock(state);
    state.failures += 1;
    state.is_failing = true;
    state.last_error = Some(error);
}

/// Returns the first eight digits of the boot's identity, from `BOOT_ID` (which also exists if a unit hides
/// `/proc` from its service) or from the kernel.
fn boot() -> String {
    let kernel = || fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
    let id = std::env::var("BOOT_ID").ok().or_else(kernel).unwrap_or_default();
    let digits: String = id.chars().filter(char::is_ascii_hexdigit).take(8).collect();
    if digits.len() == 8 { digits } else { "00000000".to_owned() }
}

#[derive(Debug)]
struct Folder {
    path: PathBuf,
    /// Number of recordings to keep, at least 1.
    keep: usize,
    boot: String,
    /// The highest counter so far, even if its file has been deleted.
    last_counter: u64,
}

#[derive(Debug, PartialEq, Eq)]
struct Kept {
    newest: Option<String>,
    recordings: usize,
}

#[derive(Debug)]
struct Saved {
    path: PathBuf,
    /// Result of writing the MCAP file.
    mcap: io::Result<()>,
}

#[derive(Debug, Default)]
struct RecordingFiles {
    paths: Vec<PathBuf>,
    /// False for remnants of a failure or a power cut.
    is_whole: bool,
}

impl Folder {
    /// Creates the folder if it is missing, and writes and removes a small file.
    fn prepare(&self) -> io::Result<()> {
        fs::create_dir_all(&self.path)?;
        let draft = self.path.join(format!("{PREFIX}test.draft"));
        write_text(&draft, &draft, "test")?;
        fs::remove_file(&draft)
    }

    /// Writes a recording as the newest one; creates the folder if it is missing. After an error no files
    /// remain, with one exception: if the disk has no space for the MCAP file, by far the largest, the other
    /// files are kept, since they can be replayed without it.
    fn save(
        &mut self,
        time: &str,
        log: &str,
        decisions: &str,
        write_mcap: impl FnOnce(&Path) -> io::Result<()>,
    ) -> io::Result<Saved> {
        fs::create_dir_all(&self.path)?;
        let counters = self.recordings()?.into_keys().filter_map(|(counter, _)| counter);
        let counter = counters.chain([self.last_counter]).max().unwrap_or(0).saturating_add(1);
        self.last_counter = counter;
        let path = self.path.join(format!("{PREFIX}{counter:06}-{}-{time}.log", self.boot));
        let [draft, beside, mcap] = ["draft", "decisions", "mcap"].map(|end| path.with_extension(end));
        // The log comes last, so that its existence implies the others.
        let mcap_written = write_mcap(&draft).and_then(|()| fs::rename(&draft, &mcap));
        if mcap_written.is_err() {
            // Frees its disk space for the other files.
            let _ = fs::remove_file(&draft);
        }
        let written = write_text(&draft, &beside, decisions).and_then(|()| write_text(&draft, &path, log));
        if written.is_err() {
            // Files that cannot be removed now are removed before the next recording is written.
            for left in [&draft, &mcap, &beside, &path] {
                let _ = fs::remove_file(left);
            }
        }
        let mcap = mcap_written
            .map_err(|error| io::Error::new(error.kind(), format!("without its MCAP file: {error}")));
        written.map(|()| Saved { path, mcap })
    }

    /// Removes recordings beyond the number to keep, oldest first, and files without their log.
    fn prune(&self) -> io::Result<Kept> {
        let (whole, left): (Vec<_>, Vec<_>) =
            self.recordings()?.into_iter().partition(|(_, files)| files.is_whole);
        let beyond = whole.len().saturating_sub(self.keep.max(1));
        for (_, files) in left.iter().chain(whole.iter().take(beyond)) {
            files.paths.iter().try_for_each(fs::remove_file)?;
        }
        let newest = whole.last().map(|((_, stem), _)| format!("{stem}.log"));
        Ok(Kept { newest, recordings: whole.len() - beyond })
    }

    /// Returns the files of each recording by counter and name; those without a counter come first.
    fn recordings(&self) -> io::Result<BTreeMap<(Option<u64>, String), RecordingFiles>> {
        let mut recordings = BTreeMap::<_, RecordingFiles>::new();
        for entry in fs::read_dir(&self.path)? {
            let path = entry?.path();
            let part =
                |part: Option<&std::ffi::OsStr>| part.and_then(|part| part.to_str()).map(str::to_owned);
            let (Some(stem), Some(extension)) = (part(path.file_stem()), part(path.extension())) else {
                continue;
            };
            let Some(name) = stem.strip_prefix(PREFIX) else { continue };
            if !["log", "decisions", "mcap", "draft"].contains(&extension.as_str()) {
                continue;
            }
            let counter = name.split('-').next().and_then(|digits| digits.parse().ok());
            let files = recordings.entry((counter, stem)).or_default();
            files.is_whole |= extension == "log";
            files.paths.push(path);
        }
        Ok(recordings)
    }
}

fn write_text(draft: &Path, path: &Path, text: &str) -> io::Result<()> {
    write_whole(draft, path, |file| file.write_all(text.as_bytes()))
}

/// Writes inputs and outputs in chronological order.
fn write_mcap(path: &Path, recording: &Recording, encoder: &mut Encoder) -> io::Result<()> {
    let mut messages: Vec<_> =
        recording.inputs().filter_map(|(input, at)| encoder.received(input, at)).collect();
    messages.extend(recording.outputs().flat_map(|(output, at)| encoder.given_out(output, at)));
    messages.sort_by_key(|message| message.log_time.as_nanos());
    let mut file = McapFile::create(path, true)?;
    messages.iter().try_for_each(|message| file.add(message, encoder.channels()))?;
    file.finish()?;
    file.sync()
}

#[cfg(test)]
mod tests;
