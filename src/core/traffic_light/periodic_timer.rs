//! Timers of frames and publications (docs/spec/traffic-lights.md, "Frames and rates").
//!
//! Times here are nanoseconds since the start of the scenario. Each is computed from its number, so
//! no error adds up.

use std::time::Duration;

use super::quirks::UpstreamQuirks;

/// The number of frames or ticks that are caught up after a gap; older ones are skipped.
const CATCH_UP: u64 = 256;
const MICRO_HZ_NANOS: u128 = 1_000_000_000_000_000;

/// The rate of a periodic timer, 0.001 to 1000 Hz, exact to a millionth of a hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Rate {
    micro_hz: u64,
}

impl Rate {
    /// 10 Hz, the default rate of V2I.
    pub const TEN_HZ: Self = Self { micro_hz: 10_000_000 };
    /// 30 Hz, the default rate of frames and of the ground truth.
    pub const THIRTY_HZ: Self = Self { micro_hz: 30_000_000 };

    /// The rate of a number of hertz; `None` when it is not from 0.001 to 1000.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the range was checked
    pub fn from_hz(hz: f64) -> Option<Self> {
        (0.001..=1_000.0).contains(&hz).then(|| Self { micro_hz: (hz * 1e6).round() as u64 })
    }

    /// The rate in hertz.
    #[allow(clippy::cast_precision_loss)] // at most 10^9
    pub fn as_hz(self) -> f64 {
        self.micro_hz as f64 / 1e6
    }

    /// The time of tick `number`, nanoseconds after tick 0, rounded to the nearest; saturates.
    pub fn nanos(self, number: u64) -> u64 {
        let rate = u128::from(self.micro_hz);
        u64::try_from((u128::from(number) * MICRO_HZ_NANOS + rate / 2) / rate).unwrap_or(u64::MAX)
    }

    /// The number of the last tick at or before a time.
    fn number_at(self, nanos: u64) -> u64 {
        let number = u128::from(nanos) * u128::from(self.micro_hz) / MICRO_HZ_NANOS;
        let number = u64::try_from(number).unwrap_or(u64::MAX);
        // Rounding may have put the next one at or before this time.
        if self.nanos(number.saturating_add(1)) <= nanos { number + 1 } else { number }
    }

    /// The tick to continue with at a time when `next` is due: `next`, or a later one after a gap.
    fn caught_up(self, next: u64, nanos: u64) -> u64 {
        next.max(self.number_at(nanos).saturating_add(1).saturating_sub(CATCH_UP))
    }
}

/// A publication timer. It does not run until it is started, and first ticks one period later.
#[derive(Debug, Clone)]
pub(super) struct PeriodicTimer {
    rate: Rate,
    run: Option<Run>,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    origin: u64,
    next: u64,
}

impl PeriodicTimer {
    pub(super) fn new(rate: Rate) -> Self {
        Self { rate, run: None }
    }

    pub(super) fn rate(&self) -> Rate {
        self.rate
    }

    /// Starts the timer unless it runs already.
    pub(super) fn start(&mut self, at: u64) {
        self.run.get_or_insert(Run { origin: at, next: 1 });
    }

    /// Starts the timer anew at another rate.
    pub(super) fn restart(&mut self, rate: Rate, at: u64) {
        *self = Self { rate, run: Some(Run { origin: at, next: 1 }) };
    }

    /// Time of the next tick; `None` when the timer does not run.
    pub(super) fn next(&self) -> Option<u64> {
        self.run.map(|run| run.origin.saturating_add(self.rate.nanos(run.next)))
    }

    /// Records that the tick was handled.
    pub(super) fn tick(&mut self) {
        if let Some(run) = &mut self.run {
            run.next = run.next.saturating_add(1);
        }
    }

    /// Skips ticks that were due too long ago. Returns their number.
    pub(super) fn skip(&mut self, now: u64) -> u64 {
        let Some(run) = &mut self.run else { return 0 };
        let next = self.rate.caught_up(run.next, now.saturating_sub(run.origin));
        let skipped = next - run.next;
        run.next = next;
        skipped
    }
}

/// A moment of the scenario, exact and as upstream counts it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Moment {
    /// Nanoseconds since the start of the scenario.
    pub(super) nanos: u64,
    /// Upstream's clock: the sum of frame periods in float64, seconds.
    pub(super) seconds: f64,
}

impl Moment {
    /// Returns whether `span` has passed since this moment.
    pub(super) fn has_lasted(self, span: Duration, now: Self, quirks: UpstreamQuirks) -> bool {
        if quirks.slips_by_frames {
            span.as_secs_f64() <= now.seconds - self.seconds
        } else {
            self.after(span).nanos <= now.nanos
        }
    }

    /// Returns whether this moment is strictly before `now`.
    pub(super) fn is_past(self, now: Self, quirks: UpstreamQuirks) -> bool {
        if quirks.slips_by_frames { self.seconds < now.seconds } else { self.nanos < now.nanos }
    }

    /// The moment `span` later.
    pub(super) fn after(self, span: Duration) -> Self {
        let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
        Self { nanos: self.nanos.saturating_add(nanos), seconds: self.seconds + span.as_secs_f64() }
    }
}

/// The timer of the frames of a scenario.
#[derive(Debug, Clone)]
pub(super) struct FrameClock {
    rate: Rate,
    next: u64,
    next_seconds: f64,
}

impl FrameClock {
    /// Creates the timer. `first` is the number of the first frame; frame 0 is at the start of the scenario.
    pub(super) fn new(rate: Rate, first: u8) -> Self {
        let next_seconds = (0..first).fold(0.0, |seconds, _| seconds + 1.0 / rate.as_hz());
        Self { rate, next: u64::from(first), next_seconds }
    }

    /// Time of the next frame.
    pub(super) fn next(&self) -> u64 {
        self.rate.nanos(self.next)
    }

    /// Records that the next frame is handled. Returns its moment.
    pub(super) fn tick(&mut self) -> Moment {
        let moment = Moment { nanos: self.next(), seconds: self.next_seconds };
        self.next = self.next.saturating_add(1);
        self.next_seconds += 1.0 / self.rate.as_hz();
        moment
    }

    /// Skips frames that were due too long ago. Returns their number. Upstream's clock does not count them.
    pub(super) fn skip(&mut self, now: u64) -> u64 {
        let next = self.rate.caught_up(self.next, now);
        let skipped = next - self.next;
        self.next = next;
        skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_exact_after_a_year() {
        let rate = Rate::THIRTY_HZ;
        assert_eq!([0, 1, 2, 3].map(|k| rate.nanos(k)), [0, 33_333_333, 66_666_667, 100_000_000]);
        assert_eq!(rate.nanos(30 * 31_536_000 + 1), 31_536_000_000_000_000 + 33_333_333);
        let ntsc = Rate::from_hz(29.97).unwrap();
        assert_eq!(ntsc.nanos(2_997), 100_000_000_000);
    }

    #[test]
    fn rates_out_of_range_are_refused() {
        for hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1_000.1, 0.000_9] {
            assert_eq!(Rate::from_hz(hz), None, "{hz}");
        }
    }

    #[test]
    fn a_running_timer_is_not_started_again_but_restarted() {
        let mut timer = PeriodicTimer::new(Rate::TEN_HZ);
        assert_eq!(timer.next(), None);
        timer.start(5);
        timer.start(1_000);
        assert_eq!(timer.next(), Some(100_000_005));
        timer.tick();
        assert_eq!(timer.next(), Some(200_000_005));
        timer.restart(Rate::from_hz(20.0).unwrap(), 200_000_000);
        timer.start(0);
        assert_eq!((timer.next(), timer.rate().as_hz()), (Some(250_000_000), 20.0));
    }

    #[test]
    fn a_gap_is_caught_up_within_bounds() {
        let mut timer = PeriodicTimer::new(Rate::TEN_HZ);
        timer.start(0);
        assert_eq!(timer.skip(25_600_000_000), 0, "256 ticks are due");
        assert_eq!(timer.skip(25_700_000_000), 1);
        assert_eq!(timer.next(), Some(200_000_000));
        assert!(timer.skip(u64::MAX) > 1_000_000);
        let mut clock = FrameClock::new(Rate::THIRTY_HZ, 0);
        assert_eq!((clock.skip(1_000_000_000_000), clock.next() > 990_000_000_000), (30_001 - 256, true));
    }

    #[test]
    fn upstreams_clock_sums_up_its_error() {
        let mut clock = FrameClock::new(Rate::THIRTY_HZ, 1);
        let ninety: Vec<_> = (0..90).map(|_| clock.tick()).collect();
        assert_eq!(ninety[89].nanos, 3_000_000_000);
        assert!(ninety[89].seconds < 3.0 && (ninety[89].seconds - 3.0).abs() < 1e-9);
        assert!((FrameClock::new(Rate::THIRTY_HZ, 0).tick().seconds).abs() < f64::EPSILON);
    }
}
