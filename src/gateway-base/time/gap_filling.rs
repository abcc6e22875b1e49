//! Limits the time for which silences of a recording are filled with repeated reports and statuses, in
//! proportion to what was recorded. A few frames with stamps years apart thus do not become hours of
//! messages.

use std::time::Duration;

use super::MonoTime;

/// Largest step of the clock that counts as a silence. A longer step is a jump of the recorder's clock, and
/// virtual time then advances by only this much. Everything is stale long before.
pub const MAX_SILENCE: Duration = Duration::from_secs(3600);
/// Time filled at a jump of the recorder's clock, since the length of the silence is unknown.
const FILLED_JUMP: Duration = Duration::from_secs(5);
/// Part of each gap that is always filled.
const FREE: Duration = Duration::from_millis(100);
/// Total time for which gaps are filled, beyond the first 100 ms of each.
pub const FILLED_IN_ALL: Duration = Duration::from_secs(6 * 3600);
/// Additional time per input of the recording, ms.
const FOR_INPUT_MS: u64 = 50;

/// Remaining time for filling the gaps of a recording.
#[derive(Debug, Clone, Copy)]
pub struct GapFilling {
    /// Longest time for which a single gap is filled while time remains.
    most: Duration,
    /// Number of inputs so far.
    inputs: u64,
    /// Time for which gaps were filled beyond [`FREE`].
    used: Duration,
    shortened: ShortenedGaps,
}

/// Gaps of a recording that are shortened because earlier gaps used up the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ShortenedGaps {
    /// Number of shortened gaps.
    pub count: u64,
    /// Virtual time at which the first shortened gap begins.
    pub first: MonoTime,
}

impl GapFilling {
    /// Creates the state before the first gap; each gap is filled for at most `most`.
    pub const fn new(most: Duration) -> Self {
        let shortened = ShortenedGaps { count: 0, first: MonoTime::ZERO };
        Self { most, inputs: 0, used: Duration::ZERO, shortened }
    }

    /// Returns how long the gap between two inputs is filled.
    pub fn of_gap(&self, gap: Duration) -> Duration {
        let earned =
            FILLED_IN_ALL.saturating_add(Duration::from_millis(self.inputs.saturating_mul(FOR_INPUT_MS)));
        self.usual(gap).min(FREE.saturating_add(earned.saturating_sub(self.used)))
    }

    /// Records the gap that ends with an input; the part until `filled` was filled.
    #[inline]
    pub fn end_gap(&mut self, from: MonoTime, until: MonoTime, filled: MonoTime) {
        if !until.is_within(FREE, from) {
            self.end_long_gap(from, until.since(from), filled.since(from));
        }
        self.inputs += 1;
    }

    fn end_long_gap(&mut self, from: MonoTime, gap: Duration, filled: Duration) {
        if self.of_gap(gap) < self.usual(gap).min(gap) {
            let first = if self.shortened.count == 0 { from } else { self.shortened.first };
            self.shortened = ShortenedGaps { count: self.shortened.count + 1, first };
        }
        self.used = self.used.saturating_add(filled.saturating_sub(FREE));
    }

    /// Returns the gaps that were shortened.
    pub const fn shortened(&self) -> ShortenedGaps {
        self.shortened
    }

    fn usual(&self, gap: Duration) -> Duration {
        if gap >= MAX_SILENCE { self.most.min(FILLED_JUMP) } else { self.most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the total time filled for this many gaps, and how many of them were shortened.
    fn filled(gaps: u32, gap: Duration) -> (Duration, u64) {
        let mut filling = GapFilling::new(Duration::from_secs(60));
        let mut sum = Duration::ZERO;
        for _ in 0..gaps {
            let filled = filling.of_gap(gap).min(gap);
            filling.end_gap(MonoTime::ZERO, MonoTime::ZERO.after(gap), MonoTime::ZERO.after(filled));
            sum += filled;
        }
        (sum, filling.shortened().count)
    }

    #[test]
    fn gaps_are_filled_for_a_time_in_proportion_to_the_inputs() {
        let minute = Duration::from_secs(60);
        assert_eq!(filled(300, 20 * minute), (300 * minute, 0));
        let (sum, shortened) = filled(100_000, 20 * minute);
        assert!(sum < FILLED_IN_ALL + 100_000 * (FREE + Duration::from_millis(FOR_INPUT_MS)), "{sum:?}");
        assert!(shortened > 99_000, "{shortened}");
        assert_eq!(filled(100, 10 * MAX_SILENCE), (100 * FILLED_JUMP, 0));
    }

    #[test]
    fn a_bus_with_twenty_frames_a_second_is_never_cut_short() {
        let (gap, frames) = (Duration::from_millis(50), 10_000_000);
        assert_eq!(filled(frames, gap), (frames * gap, 0));
        let (gap, frames) = (Duration::from_millis(150), 1_000_000);
        assert_eq!(filled(frames, gap), (frames * gap, 0));
    }
}
