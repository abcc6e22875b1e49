//! A source that counts the bytes taken from it, for the place where a recording breaks off.

use std::io::{self, BufRead, BufReader, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts the bytes that are taken from a source.
pub(super) struct CountedSource {
    pub(super) source: BufReader<Box<dyn Read + Send>>,
    pub(super) consumed: Arc<AtomicU64>,
}

impl Read for CountedSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        self.consumed.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

impl BufRead for CountedSource {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.source.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.consumed.fetch_add(amount as u64, Ordering::Relaxed);
        self.source.consume(amount);
    }
}
