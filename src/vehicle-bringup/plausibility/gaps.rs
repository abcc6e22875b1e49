//! The times between the frames of one message.

use std::collections::BTreeMap;
use std::time::Duration;

use gateway_base::time::MonoTime;

/// Number of classes for each doubling of a gap.
const CLASSES_PER_OCTAVE: f64 = 16.0;

/// The distribution of the gaps between frames, in classes of 4 %; constant memory for any number of frames.
#[derive(Debug, Clone, Default)]
pub struct GapDistribution {
    last: Option<MonoTime>,
    /// The longest gap between two frames.
    pub longest: Duration,
    count: u64,
    /// Number and sum of the gaps of each class.
    classes: BTreeMap<i16, (u64, Duration)>,
}

impl GapDistribution {
    /// Adds the next frame. Times must not run backwards.
    pub fn frame(&mut self, now: MonoTime) {
        let Some(last) = self.last.replace(now) else { return };
        let gap = now.since(last);
        self.longest = self.longest.max(gap);
        self.count += 1;
        // From below 0 (less than 1 µs) to 512 (an hour and more).
        #[allow(clippy::cast_possible_truncation)]
        let class = (gap.as_secs_f64() * 1e6).max(0.5).log2().mul_add(CLASSES_PER_OCTAVE, 0.0).floor() as i16;
        let (count, sum) = self.classes.entry(class).or_default();
        *count += 1;
        *sum += gap;
    }

    /// Returns the median gap; `None` without a gap, or if all frames have the same stamp.
    pub fn median(&self) -> Option<Duration> {
        let mut before = 0;
        for (count, sum) in self.classes.values() {
            before += count;
            if before * 2 >= self.count {
                let mean = sum.div_f64(f64::from(u32::try_from(*count).unwrap_or(u32::MAX)));
                return Some(mean).filter(|mean| !mean.is_zero());
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(millis: impl IntoIterator<Item = u64>) -> GapDistribution {
        let mut gaps = GapDistribution::default();
        millis.into_iter().for_each(|at| gaps.frame(MonoTime::from_millis(at)));
        gaps
    }

    #[test]
    fn the_median_ignores_bursts_and_silences() {
        let mut times: Vec<_> = (0..100).map(|frame| frame * 100).collect();
        times.extend([9_905, 9_910, 9_915, 20_000]);
        let gaps = gaps(times);
        assert_eq!(gaps.median(), Some(Duration::from_millis(100)));
        assert_eq!(gaps.longest, Duration::from_millis(20_000 - 9_915));
    }

    #[test]
    fn one_frame_and_frames_without_times_have_no_median() {
        assert_eq!(gaps([7]).median(), None);
        assert_eq!(gaps([7, 7, 7, 7]).median(), None);
    }
}
