//! Limits the output that a command writes for a recording in proportion to the recording, so that a small
//! file cannot fill a disk.

use std::io;
use std::time::Duration;

use gateway_base::time::MonoTime;

/// Number of bytes that may be written for any recording.
const BASE: u64 = 64 << 20;
/// Additional bytes per entry of the recording. A frame with all its reports takes less than 1 KiB.
const FOR_ENTRY: u64 = 8 << 10;

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct OutputBudget {
    entries: u64,
    written: u64,
    ended: Option<MonoTime>,
}

impl OutputBudget {
    pub(crate) fn entry(&mut self) {
        self.entries += 1;
    }

    /// Counts bytes at virtual time `at`; returns false if they and everything after them are to be omitted.
    pub(crate) fn take(&mut self, bytes: usize, at: MonoTime) -> bool {
        let written = self.written.saturating_add(bytes as u64);
        if written > BASE.saturating_add(self.entries.saturating_mul(FOR_ENTRY)) {
            self.ended.get_or_insert(at);
        } else if self.ended.is_none() {
            self.written = written;
        }
        self.ended.is_none()
    }

    /// Returns an error with the limit, the position and the remedy if output was omitted.
    pub(crate) fn outcome(&self) -> io::Result<()> {
        let Some(at) = self.ended else { return Ok(()) };
        let Self { entries, written, .. } = self;
        Err(io::Error::other(format!(
            "it ends at {:.3} s of the recording, after {written} bytes: a recording of {entries} entries may become {} MiB \
             and {} kB for each entry; replay its parts one by one",
            Duration::from_nanos(at.as_nanos()).as_secs_f64(),
            BASE >> 20,
            FOR_ENTRY >> 10
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_ends_where_it_is_out_of_proportion_to_the_recording() {
        let mut budget = OutputBudget::default();
        let piece = 1 << 20;
        for second in 0..64 {
            assert!(budget.take(piece, MonoTime::from_millis(1_000 * second)));
        }
        assert!(budget.outcome().is_ok());
        for _ in 0..128 {
            budget.entry();
        }
        assert!(budget.take(piece, MonoTime::from_millis(64_000)));
        assert!(!budget.take(1, MonoTime::from_millis(65_500)));
        budget.entry();
        assert!(!budget.take(1, MonoTime::from_millis(66_000)), "what follows has a hole");
        assert_eq!(
            budget.outcome().unwrap_err().to_string(),
            "it ends at 65.500 s of the recording, after 68157440 bytes: a recording of 129 entries may become 64 MiB and 8 \
             kB for each entry; replay its parts one by one"
        );
    }
}
