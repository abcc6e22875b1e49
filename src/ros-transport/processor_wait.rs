//! Measures how long a thread has waited for a processor, so that a busy computer is not mistaken for a
//! process that was stopped or hangs.

use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::time::Duration;

/// The kernel's sums for one thread. Opened before the confinement, which leaves nothing to open.
#[derive(Debug)]
pub(crate) struct ProcessorWait(Option<File>);

impl ProcessorWait {
    /// Opens the sums of the calling thread.
    pub(crate) fn of_this_thread() -> Self {
        Self(File::open("/proc/thread-self/schedstat").ok())
    }

    /// Returns how long the thread has been runnable without a processor since its start; zero if the kernel
    /// does not measure it.
    pub(crate) fn total(&self) -> Duration {
        let mut text = [0; 64];
        let read = self.0.as_ref().and_then(|file| file.read_at(&mut text, 0).ok());
        read.and_then(|length| waited(text.get(..length)?)).unwrap_or_default()
    }
}

/// Parses the second field of `schedstat`, in ns.
fn waited(schedstat: &[u8]) -> Option<Duration> {
    let nanos = str::from_utf8(schedstat).ok()?.split_ascii_whitespace().nth(1)?;
    nanos.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_is_the_second_field_and_anything_else_is_none() {
        assert_eq!(waited(b"1000 2500000000 3\n"), Some(Duration::from_millis(2500)));
        for garbled in ["", "1000", "1000 x 3", "1000 -1 3"] {
            assert_eq!(waited(garbled.as_bytes()), None, "{garbled:?}");
        }
        assert_eq!(waited(&[b'1', b' ', 0xFF]), None);
    }

    #[test]
    fn the_sums_of_this_thread_never_fall_and_an_absent_file_is_no_wait() {
        let own = ProcessorWait::of_this_thread();
        let before = own.total();
        std::thread::yield_now();
        assert!(own.total() >= before);
        assert_eq!(ProcessorWait(None).total(), Duration::ZERO);
    }
}
