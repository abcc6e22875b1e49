//! Text for a terminal, a pipe or the journal, written by a thread of its own.
//!
//! Writers are never blocked by a reader that does not read, and an error at the reader's end is not an error
//! of the process: text that does not fit or is not accepted is counted.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, ErrorKind, Write as _};
use std::os::fd::AsFd;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::lock::lock;

/// Maximum number of queued bytes, in addition to the text that is being written.
const MAX_WAITING: usize = 256 * 1024;
/// Pause before writing again to a reader that is not ready.
const RETRY: Duration = Duration::from_millis(10);
/// Maximum time that one step of a wait counts.
const STEP: Duration = Duration::from_millis(10);

/// Queue of text for one reader. Clones share it.
#[derive(Debug, Clone)]
pub struct OutputQueue(Arc<SharedQueue>);

#[derive(Debug, Default)]
struct SharedQueue {
    state: Mutex<QueueState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct QueueState {
    waiting: VecDeque<Vec<u8>>,
    waiting_bytes: usize,
    /// True if each text counts as one line.
    counts_texts: bool,
    is_writing: bool,
    losses: Losses,
    /// Replacement for the file of the start, from the next text on.
    next_file: Option<File>,
}

/// Text that did not reach its reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Number of lines lost since the start.
    pub lines: u64,
    /// Reason for the last loss; `None` before the first.
    pub last: Option<Loss>,
    /// True if a line was lost after the reader last accepted text.
    pub is_losing: bool,
}

/// Reason why text did not reach its reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// The reader does not read, and the queue is full.
    Full,
    /// The system's error, e.g. a closed pipe or a full disk.
    Error(ErrorKind),
}

impl OutputQueue {
    /// Starts a thread with this name that writes to a duplicate of `to`; the locks of [`io::stdout`] and
    /// [`io::stderr`] stay free while it waits for the reader. Fails if the file cannot be duplicated or the
    /// thread cannot be started.
    pub fn start(name: &str, to: &impl AsFd) -> io::Result<Self> {
        let mut file = File::from(to.as_fd().try_clone_to_owned()?);
        let queue = Self(Arc::default());
        let shared = Arc::clone(&queue.0);
        thread::Builder::new().name(name.to_owned()).spawn(move || shared.write_to(&mut file))?;
        Ok(queue)
    }

    /// Like [`Self::start`], but each text is sent to a socket as one datagram and counts as one line.
    pub fn start_datagrams(name: &str, to: &impl AsFd) -> io::Result<Self> {
        let queue = Self::start(name, to)?;
        lock(&queue.0.state).counts_texts = true;
        Ok(queue)
    }

    /// Queues a text of one or more lines, completely or not at all. Never blocks.
    pub fn push(&self, text: &[u8]) {
        let mut state = lock(&self.0.state);
        if state.waiting_bytes + text.len() <= MAX_WAITING {
            state.waiting_bytes += text.len();
            state.waiting.push_back(text.to_vec());
            self.0.changed.notify_all();
        } else {
            state.lost(text, Loss::Full);
        }
    }

    /// Writes to a duplicate of another file from the next text on. Fails if it cannot be duplicated.
    pub fn redirect(&self, to: &impl AsFd) -> io::Result<()> {
        lock(&self.0.state).next_file = Some(File::from(to.as_fd().try_clone_to_owned()?));
        Ok(())
    }

    /// Waits until everything is written, at most for `patience`; returns true if it is. If the machine stops
    /// the process meanwhile, only 10 ms of that time count, so that the last lines are not lost.
    pub fn flush(&self, patience: Duration) -> bool {
        let mut left = patience;
        let mut state = lock(&self.0.state);
        while state.is_writing || !state.waiting.is_empty() {
            if left.is_zero() {
                return false;
            }
            let begun = Instant::now();
            let waited = self.0.changed.wait_timeout(state, left.min(STEP));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
            left = left.saturating_sub(begun.elapsed().min(STEP));
        }
        true
    }

    /// Returns the losses since the start.
    pub fn losses(&self) -> Losses {
        lock(&self.0.state).losses
    }
}

impl SharedQueue {
    fn write_to(&self, file: &mut File) {
        let mut state = lock(&self.state);
        loop {
            let Some(text) = state.waiting.pop_front() else {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.waiting_bytes -= text.len();
            state.is_writing = true;
            if let Some(next) = state.next_file.take() {
                *file = next;
            }
            drop(state);
            let written = write_all(file, &text);
            state = lock(&self.state);
            state.is_writing = false;
            match written {
                Ok(()) => state.losses.is_losing = false,
                Err((unwritten, kind)) => state.lost(unwritten, Loss::Error(kind)),
            }
            self.changed.notify_all();
        }
    }
}

impl QueueState {
    fn lost(&mut self, text: &[u8], loss: Loss) {
        let lines = text.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).count();
        let lines = if self.counts_texts { 1 } else { lines };
        self.losses.lines += u64::try_from(lines).unwrap_or(u64::MAX);
        self.losses.last = Some(loss);
        self.losses.is_losing = true;
    }
}

/// Writes everything, and waits for a reader that is not ready. Returns the unwritten rest with the error.
fn write_all<'a>(file: &mut File, mut text: &'a [u8]) -> Result<(), (&'a [u8], ErrorKind)> {
    while !text.is_empty() {
        match file.write(text) {
            Ok(0) => return Err((text, ErrorKind::WriteZero)),
            Ok(written) => text = text.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => thread::sleep(RETRY),
            Err(error) => return Err((text, error.kind())),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;
    use crate::waiting::DEADLINE;

    #[test]
    fn text_arrives_in_order_and_whole() {
        let (mut reader, writer) = io::pipe().unwrap();
        let queue = OutputQueue::start("test", &writer).unwrap();
        for line in ["one\n", "two\n"] {
            queue.push(line.as_bytes());
        }
        assert!(queue.flush(DEADLINE));
        let mut read = [0; 8];
        reader.read_exact(&mut read).unwrap();
        assert_eq!((&read, queue.losses()), (b"one\ntwo\n", Losses::default()));
    }

    #[test]
    fn reader_that_does_not_read_delays_nothing_and_its_losses_are_counted() {
        let (mut reader, mut writer) = io::pipe().unwrap();
        // The pipe is full, so the first line waits whenever its thread runs.
        rustix::io::ioctl_fionbio(&writer, true).unwrap();
        let filled: usize = std::iter::from_fn(|| writer.write(&[0]).ok()).sum();
        rustix::io::ioctl_fionbio(&writer, false).unwrap();
        let queue = OutputQueue::start("test", &writer).unwrap();
        let line = [&[b'x'; 1023][..], b"\n"].concat();
        // Far more than the text being written and the queue can hold.
        for _ in 0..4096 {
            queue.push(&line);
        }
        assert!(!queue.flush(Duration::from_millis(1)));
        let losses = queue.losses();
        assert!(losses.is_losing && losses.lines > 3000, "{losses:?}");
        assert_eq!(losses.last, Some(Loss::Full));
        let unlost = usize::try_from(4096 - losses.lines).unwrap();
        reader.read_exact(&mut vec![0; filled]).unwrap();
        let mut read = vec![0; unlost * line.len()];
        reader.read_exact(&mut read).unwrap();
        assert!(read.chunks(line.len()).all(|read| read == line), "lines are whole");
        assert!(queue.flush(DEADLINE));
        assert_eq!((queue.losses().is_losing, queue.losses().lines), (false, losses.lines));
    }

    #[test]
    fn text_goes_to_another_file_once_it_is_redirected() {
        let ((mut first, writer), (mut second, other)) = (io::pipe().unwrap(), io::pipe().unwrap());
        let queue = OutputQueue::start("test", &writer).unwrap();
        queue.push(b"one\n");
        assert!(queue.flush(DEADLINE));
        queue.redirect(&other).unwrap();
        queue.push(b"two\n");
        let (mut before, mut after) = ([0; 4], [0; 4]);
        first.read_exact(&mut before).unwrap();
        second.read_exact(&mut after).unwrap();
        assert_eq!((&before, &after), (b"one\n", b"two\n"));
    }

    #[test]
    fn reader_that_is_gone_is_an_error_that_is_counted() {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let queue = OutputQueue::start("test", &writer).unwrap();
        queue.push(b"one\ntwo\n");
        assert!(queue.flush(DEADLINE));
        let losses = Losses { lines: 2, last: Some(Loss::Error(ErrorKind::BrokenPipe)), is_losing: true };
        assert_eq!(queue.losses(), losses);
    }
}
