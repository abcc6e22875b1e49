//! A source that counts the bytes read from it, to locate the end of a broken recording and to charge its
//! budget.

use std::io::{self, BufRead, BufReader, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::file_budget::FileBudget;

/// Counts the bytes read from a source.
pub(super) struct CountedSource {
    source: BufReader<Box<dyn Read + Send>>,
    consumed: Arc<AtomicU64>,
    budget: FileBudget,
}

impl CountedSource {
    pub(super) fn new(source: BufReader<Box<dyn Read + Send>>, budget: FileBudget) -> Self {
        Self { source, consumed: Arc::default(), budget }
    }

    /// Returns the byte counter.
    pub(super) fn consumed(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.consumed)
    }

    fn count(&self, amount: usize) {
        self.consumed.fetch_add(amount as u64, Ordering::Relaxed);
        self.budget.count_read(amount);
    }
}

impl Read for CountedSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        self.count(read);
        Ok(read)
    }
}

impl BufRead for CountedSource {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.source.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.count(amount);
        self.source.consume(amount);
    }
}
