//! Timers of frames and publications (docs/spec/traffic-lights.md, "Frames and rates").
//!
//! Times here are nanoseconds since the start of the scenario. Each is computed from its number, so no error
//! accumulates.

use std::time::Duration;

use super::quirks::LightQuirks;

/// Maximum number of frames or ticks that are caught up after a gap; older ones are skipped.
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

    /// Returns the rate for a number of hertz; `None` if it is not from 0.001 to 1000.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the range was checked
    pub fn from_hz(hz: f64) -> Option<Self> {
        (0.001..=1_000.0).contains(&hz).then(|| Self { micro_hz: (hz * 1e6).round() as u64 })
    }

    /// Returns the rate in hertz.
    #[allow(clippy::cast_precision_loss)] // at most 10^9
    pub fn as_hz(self) -> f64 {
        self.micro_hz as f64 / 1e6
    }

    /// Returns the time of tick `number`, nanoseconds after tick 0, rounded to the nearest nanosecond;
    /// saturates.
    pub fn nanos(self, number: u64) -> u64 {
        let rate = u128::from(self.micro_hz);
        u64::try_from((u128::from(number) * MICRO_HZ_NANOS + rate / 2) / rate).unwrap_or(u64::MAX)
    }

    fn number_at(self, nanos: u64) -> u64 {
        let number = u128::from(nanos) * u128::from(self.micro_hz) / MICRO_HZ_NANOS;
        let number = u64::try_from(number).unwrap_or(u64::MAX);
        // Rounding may have moved the next tick to or before this time.
        if self.nanos(number.saturating_add(1)) <= nanos { number + 1 } else { number }
    }

    /// Returns the tick to continue with at time `nanos`, if tick `next` is due: `next`, or a later tick
    /// after a gap.
    fn caught_up(self, next: u64, nanos: u64) -> u64 {
        next.max(self.number_at(nanos).saturating_add(1).saturating_sub(CATCH_UP))
    }
}

/// A timer of publications. It must be started, and first ticks one period later.
#[derive(Debug, Clone)]
pub(super) struct PeriodicTimer {
    pub(super) rate: Rate,
    /// The time of tick 0; `None` before the start.
    origin: Option<u64>,
    /// The number of the next tick.
    next: u64,
}

impl PeriodicTimer {
    pub(super) fn new(rate: Rate) -> Self {
        Self { rate, origin: None, next: 1 }
    }

    /// Starts the timer unless it is already running.
    pub(super) fn start(&mut self, at: u64) {
        self.origin.get_or_insert(at);
    }

    pub(super) fn restart(&mut self, rate: Rate, at: u64) {
        *self = Self { rate, origin: Some(at), next: 1 };
    }

    /// Returns the time of the next tick; `None` if the timer is not running.
    pub(super) fn next(&self) -> Option<u64> {
        self.origin.map(|origin| origin.saturating_add(self.rate.nanos(self.next)))
    }

    pub(super) fn tick(&mut self) {
        self.next = self.next.saturating_add(1);
    }

    /// Skips ticks that are overdue by too much. Returns their number.
    pub(super) fn skip(&mut self, now: u64) -> u64 {
        let Some(origin) = self.origin else { return 0 };
        let next = self.rate.caught_up(self.next, now.saturating_sub(origin));
        next - std::mem::replace(&mut self.next, next)
    }
}

/// A moment of the scenario, exact and on upstream's clock.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ScenarioMoment {
    /// Nanoseconds since the start of the scenario.
    pub(super) nanos: u64,
    /// Upstream's clock: the sum of frame periods in float64, seconds.
    pub(super) seconds: f64,
}

impl ScenarioMoment {
    /// Returns whether `span` has passed since this moment.
    pub(super) fn has_lasted(self, span: Duration, now: Self, quirks: LightQuirks) -> bool {
        if quirks.slips_by_frames {
            span.as_secs_f64() <= now.seconds - self.seconds
        } else {
            self.after(span).nanos <= now.nanos
        }
    }

    /// Returns whether this moment is strictly before `now`.
    pub(super) fn is_past(self, now: Self, quirks: LightQuirks) -> bool {
        if quirks.slips_by_frames { self.seconds < now.seconds } else { self.nanos < now.nanos }
    }

    pub(super) fn after(self, span: Duration) -> Self {
        let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
        Self { nanos: self.nanos.saturating_add(nanos), seconds: self.seconds + span.as_secs_f64() }
    }
}

#[derive(Debug, Clone)]
pub(super) struct FrameClock {
    timer: PeriodicTimer,
    next_seconds: f64,
}

impl FrameClock {
    /// Creates the timer. `first` is the number of the first frame; frame 0 is at the start of the scenario.
    pub(super) fn new(rate: Rate, first: u8) -> Self {
        let next_seconds = (0..first).fold(0.0, |seconds, _| seconds + 1.0 / rate.as_hz());
        Self { timer: PeriodicTimer { rate, origin: Some(0), next: first.into() }, next_seconds }
    }

    pub(super) fn next(&self) -> u64 {
        self.timer.rate.nanos(self.timer.next)
    }

    /// Records that the next frame was handled. Returns its moment.
    pub(super) fn tick(&mut self) -> ScenarioMoment {
        let moment = ScenarioMoment { nanos: self.next(), seconds: self.next_seconds };
        self.timer.tick();
        self.next_seconds += 1.0 / self.timer.rate.as_hz();
        moment
    }

    /// Skips frames that are overdue by too much. Returns their number. Upstream's clock does not count them.
    pub(super) fn skip(&mut self, now: u64) -> u64 {
        self.timer.skip(now)
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
        assert_eq!((timer.next(), timer.rate.as_hz()), (Some(250_000_000), 20.0));
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
