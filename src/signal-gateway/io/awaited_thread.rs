//! Threads whose end can be awaited for a limited time.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// A thread that ends by itself when it is told to.
#[derive(Debug)]
pub struct AwaitedThread(Receiver<()>);

impl AwaitedThread {
    /// Starts a thread with this name. Fails if the system refuses it.
    pub fn start(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<Self> {
        let (end, ended) = channel();
        thread::Builder::new().name(name.to_owned()).spawn(move || {
            // Dropped last, even on a panic, which wakes `ends_within`.
            let _end: Sender<()> = end;
            work();
        })?;
        Ok(Self(ended))
    }

    /// Waits for the end, at most for `patience`. Returns false if the thread still runs.
    pub fn ends_within(&self, patience: Duration) -> bool {
        self.0.recv_timeout(patience) != Err(RecvTimeoutError::Timeout)
    }
}
