//! The time for which the silences of a recording are filled with repeated reports and statuses: in
//! proportion to what was recorded, so that a few frames with stamps years apart do not become hours of
//! messages.

use std::time::Duration;

use super::MonoTime;

/// A step of the clock longer than this is a jump of the recorder's clock, not a silence; virtual
/// time then moves on by just this much. Everything is stale long before.
pub const MAX_SILENCE: Duration = Duration::from_secs(3600);
/// The same where the recorder's clock jumped: nobody knows for how long the bus was silent.
const FILLED_JUMP: Duration = Duration::from_secs(5);
/// The part of each gap that is always filled.
const FREE: Duration = Duration::from_millis(100);
/// The time that all gaps together are filled for, beyond the first 100 ms of each.
pub const FILLED_IN_ALL: Duration = Duration::from_secs(6 * 3600);
/// The further time for each input of the recording, ms.
const FOR_INPUT_MS: u64 = 50;

/// What is left of the time for the gaps of a recording.
#[derive(Debug, Clone, Copy)]
pub struct GapFilling {
    /// For how long a single gap is filled while there is time left.
    most: Duration,
    /// Number of inputs so far.
    inputs: u64,
    /// Time that gaps were filled for beyond [`FREE`].
    used: Duration,
    shortened: ShortenedGaps,
}

/// Gaps of a recording that are filled for a shorter time, since those before took all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ShortenedGaps {
    /// Number of gaps.
    pub count: u64,
    /// Virtual time at which the first one begins.
    pub first: MonoTime,
}

impl GapFilling {
    /// Creates the filling of a recording before its first gap; each is filled for `most` at most.
    pub const fn new(most: Duration) -> Self {
        let shortened = ShortenedGaps { count: 0, first: MonoTime::ZERO };
        Self { most, inputs: 0, used: Duration::ZERO, shortened }
    }

    /// Returns for how long the gap between two inputs is filled.
    pub fn of_gap(&self, gap: Duration) -> Duration {
        let earned =
            FILLED_IN_ALL.saturating_add(Duration::from_millis(self.inputs.saturating_mul(FOR_INPUT_MS)));
        self.usual(gap).min(FREE.saturating_add(earned.saturating_sub(self.used)))
    }

    /// Takes the gap that ends with an input, of which the part until `filled` was filled.
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

    /// Returns the gaps that were filled for a shorter time.
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

    /// Returns the time for which as many gaps are filled in all, and how many of them were shortened.
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
