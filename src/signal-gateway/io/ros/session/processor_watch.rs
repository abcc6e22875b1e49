//! Measures the processor time that a network side uses.

use std::time::Instant;

use super::threads::Threads;

/// Load that counts as a whole processor, percent.
const WHOLE_PERCENT: u32 = 90;
/// Number of consecutive measurements of a whole processor after which a warning is due.
const MAX_LOOKS: u32 = 3;

/// Consecutive measurements of a network side.
#[derive(Debug, Default)]
pub(super) struct ProcessorWatch {
    /// Threads and time of the last measurement.
    last: Option<(Threads, Instant)>,
    /// Number of consecutive measurements of a whole processor.
    busy: u32,
}

impl ProcessorWatch {
    /// Returns the processor load of these threads since the last measurement, percent; `None` if it is
    /// unknown.
    pub(super) fn look(&mut self, threads: Option<Threads>, now: Instant) -> Option<u32> {
        let last = std::mem::replace(&mut self.last, threads.map(|threads| (threads, now)));
        let percent = self.last.as_ref().zip(last).and_then(|((threads, _), (earlier, at))| {
            let ran_ms = threads.ran_since(&earlier)?.as_millis();
            let span_ms = now.saturating_duration_since(at).as_millis();
            u32::try_from((ran_ms * 100).checked_div(span_ms)?).ok()
        });
        let is_busy = percent.is_some_and(|percent| percent >= WHOLE_PERCENT);
        self.busy = if is_busy { self.busy.saturating_add(1) } else { 0 };
        percent
    }

    /// Returns true once the network side has used a whole processor for some time.
    pub(super) fn is_busy(&self) -> bool {
        self.busy >= MAX_LOOKS
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::threads::tests::threads;
    use super::*;

    #[test]
    fn one_that_takes_a_whole_processor_for_three_seconds_is_busy() {
        let (start, mut watch) = (Instant::now(), ProcessorWatch::default());
        let mut look = |second: u64, ran_ms: Option<u64>| {
            let reading = ran_ms.map(|ms| threads(&[("R", &format!("{} 0 1", ms * 1_000_000))]));
            let percent = watch.look(reading, start + Duration::from_secs(second));
            (percent, watch.is_busy())
        };
        assert_eq!(look(0, Some(5_000)), (None, false), "a first look shows nothing");
        assert_eq!(look(1, Some(5_250)), (Some(25), false));
        assert_eq!(look(2, Some(6_200)), (Some(95), false));
        assert_eq!(look(3, Some(7_150)), (Some(95), false));
        assert_eq!(look(4, Some(8_050)), (Some(90), true));
        assert_eq!(look(6, Some(9_830)), (Some(89), false));
        assert_eq!(look(7, None), (None, false));
        assert_eq!(look(8, Some(20)), (None, false), "another process");
        assert_eq!(look(8, Some(30)), (None, false), "no time has passed");
    }
}
