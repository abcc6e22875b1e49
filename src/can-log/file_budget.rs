//! Limits of time and memory for reading one file. A damaged or hostile file can announce, repeat and pack
//! far more than it holds, so every reader of a file charges time and memory to the file's one budget, which
//! nested containers share.
//!
//! *Work* is counted in nominal nanoseconds: `WORK_PER_BYTE` for each byte read from the file itself, and
//! at least the work for a file of 10 MB. An uncompressed file cannot reach this limit, unless it refers to
//! the same content again and again. *Memory* is the data of a file that readers keep at one time:
//! `MIN_KEPT`, and for larger files `KEPT_PER_BYTE`. A format that must be held as a whole may use more,
//! see [`FileBudget::allow_whole`].

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// Work allowed for each byte of a file, nominal ns.
const WORK_PER_BYTE: u64 = 1000;
/// Work allowed for any file, nominal ns: that of a 10 MB file.
const MIN_WORK: u64 = 10_000_000 * WORK_PER_BYTE;
/// Bytes that the readers of any file may keep.
const MIN_KEPT: u64 = 192 << 20;
/// Bytes that may be kept for each byte of a large file.
const KEPT_PER_BYTE: u64 = 16;
/// Bytes that may be kept for each byte of a file that is held as a whole, up to [`MAX_WHOLE`].
const WHOLE_PER_BYTE: u64 = 50;
/// Maximum number of unpacked bytes that may be kept of a file held as a whole.
pub const MAX_WHOLE: u64 = 1 << 30;

/// Nominal cost of an entry of a recording, from the reader to the result of a command, ns.
pub const ENTRY_WORK: u64 = 400;

/// The budget of one file. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct FileBudget(Arc<Counters>);

#[derive(Debug, Default)]
struct Counters {
    /// Bytes read of the file itself.
    read: AtomicU64,
    /// Nominal ns.
    work: AtomicU64,
    /// Bytes.
    kept: AtomicU64,
    is_whole: AtomicBool,
}

/// A limit that reading a file has reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum LimitReached {
    #[error(
        "its packed or repeated content costs more time than {} MB of plain content, the limit for the {read} bytes read; \
         unpack the file first, or read it in parts", .limit / WORK_PER_BYTE / 1_000_000
    )]
    Work {
        /// Nominal ns.
        limit: u64,
        read: u64,
    },
    #[error(
        "reading on needs more than {} MiB of memory, the limit for the {read} bytes read; unpack the file first, or read \
         it in parts", .limit >> 20
    )]
    Memory {
        /// Bytes.
        limit: u64,
        read: u64,
    },
}

impl From<LimitReached> for io::Error {
    fn from(limit: LimitReached) -> Self {
        Self::new(io::ErrorKind::FileTooLarge, limit)
    }
}

/// Returns true for the error of a [limit](LimitReached), after which no more of the file is read.
pub fn is_limit(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::FileTooLarge
}

/// Adds without a locked instruction: each file has one reader, and progress displays only read.
fn add(counter: &AtomicU64, amount: u64) -> u64 {
    let sum = counter.load(Relaxed).saturating_add(amount);
    counter.store(sum, Relaxed);
    sum
}

impl FileBudget {
    /// Counts bytes read from the file itself, which raise the limits of work and memory.
    pub fn count_read(&self, bytes: usize) {
        add(&self.0.read, bytes as u64);
    }

    /// Returns the number of bytes read from the file itself.
    pub fn bytes_read(&self) -> u64 {
        self.0.read.load(Relaxed)
    }

    /// Allows the readers to keep the whole unpacked file: up to 1 GiB, and up to fifty times the bytes read.
    pub fn allow_whole(&self) {
        self.0.is_whole.store(true, Relaxed);
    }

    /// Spends nominal nanoseconds on unpacking, on an entry, or on following a reference.
    ///
    /// # Errors
    /// [`LimitReached::Work`].
    #[inline]
    pub fn spend(&self, work: u64) -> io::Result<()> {
        if add(&self.0.work, work) > MIN_WORK { self.check_work() } else { Ok(()) }
    }

    #[cold]
    fn check_work(&self) -> io::Result<()> {
        let read = self.bytes_read();
        let limit = read.saturating_mul(WORK_PER_BYTE).max(MIN_WORK);
        let is_within = self.0.work.load(Relaxed) <= limit;
        if is_within { Ok(()) } else { Err(LimitReached::Work { limit, read }.into()) }
    }

    /// Returns the number of bytes that may still be kept.
    pub fn left(&self) -> u64 {
        self.kept_limit().saturating_sub(self.0.kept.load(Relaxed))
    }

    fn kept_limit(&self) -> u64 {
        let read = self.bytes_read();
        let limit = if self.0.is_whole.load(Relaxed) {
            read.saturating_mul(WHOLE_PER_BYTE).min(MAX_WHOLE)
        } else {
            read.saturating_mul(KEPT_PER_BYTE)
        };
        limit.max(MIN_KEPT)
    }

    /// Returns a reservation for keeping data of the file in memory.
    pub fn keep(&self) -> Kept {
        Kept { budget: self.clone(), bytes: 0 }
    }
}

/// Memory used by a reader; dropping it frees the memory for others.
#[derive(Debug)]
pub struct Kept {
    budget: FileBudget,
    bytes: u64,
}

impl Kept {
    /// Changes the number of bytes that are kept. Call it before a collection grows.
    ///
    /// # Errors
    /// [`LimitReached::Memory`]; the number is then unchanged.
    pub fn resize(&mut self, bytes: u64) -> io::Result<()> {
        let counters = &self.budget.0;
        let others = counters.kept.load(Relaxed).saturating_sub(self.bytes);
        let limit = self.budget.kept_limit();
        if bytes > self.bytes && others.saturating_add(bytes) > limit {
            return Err(LimitReached::Memory { limit, read: self.budget.bytes_read() }.into());
        }
        counters.kept.store(others + bytes, Relaxed);
        self.bytes = bytes;
        Ok(())
    }

    /// Keeps more bytes.
    ///
    /// # Errors
    /// [`LimitReached::Memory`]; the number is then unchanged.
    pub fn grow(&mut self, bytes: u64) -> io::Result<()> {
        self.resize(self.bytes.saturating_add(bytes))
    }

    /// Keeps at least this number of bytes.
    ///
    /// # Errors
    /// [`LimitReached::Memory`]; the number is then unchanged.
    #[inline]
    pub fn resize_up(&mut self, bytes: u64) -> io::Result<()> {
        if bytes > self.bytes { self.resize(bytes) } else { Ok(()) }
    }

    /// Returns the budget to which this belongs.
    pub fn budget(&self) -> &FileBudget {
        &self.budget
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        let kept = &self.budget.0.kept;
        kept.store(kept.load(Relaxed).saturating_sub(self.bytes), Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_limited_by_the_bytes_that_were_read() {
        let budget = FileBudget::default();
        assert!(budget.spend(MIN_WORK).is_ok(), "any file may cost that much");
        let error = budget.spend(1).unwrap_err();
        assert!(is_limit(&error));
        assert_eq!(
            error.to_string(),
            "its packed or repeated content costs more time than 10 MB of plain content, the limit for the 0 bytes read; \
             unpack the file first, or read it in parts"
        );
        budget.count_read(20_000_000);
        assert!(budget.spend(MIN_WORK - 1).is_ok(), "twice as much for twice 10 MB");
        assert!(budget.clone().spend(1).is_err(), "clones share it");
    }

    #[test]
    fn memory_is_shared_and_given_back() {
        let budget = FileBudget::default();
        let (mut first, mut second) = (budget.keep(), budget.keep());
        first.resize(MIN_KEPT - 10).unwrap();
        second.grow(10).unwrap();
        assert_eq!(budget.left(), 0);
        let error = second.grow(1).unwrap_err();
        assert!(is_limit(&error) && error.to_string().contains("more than 192 MiB of memory"), "{error}");
        second.resize(5).unwrap();
        drop(first);
        assert_eq!(budget.left(), MIN_KEPT - 5);
    }

    #[test]
    fn a_file_that_is_held_as_a_whole_may_need_fifty_times_its_size_up_to_a_gibibyte() {
        let budget = FileBudget::default();
        budget.count_read(5_000_000);
        assert_eq!(budget.left(), MIN_KEPT);
        budget.allow_whole();
        assert_eq!(budget.left(), 250_000_000);
        budget.count_read(1 << 30);
        assert_eq!(budget.left(), MAX_WHOLE);
    }
}
