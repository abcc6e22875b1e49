//! What has to last before it is an alarm: a violation, a value that stays the same, a change over half a second.

use std::time::Duration;

use crate::core::time::MonoTime;

/// Since when something is violated.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lasting(Option<MonoTime>);

impl Lasting {
    /// True if `is_violated` has been true for longer than `limit`.
    pub(super) fn update(&mut self, is_violated: bool, limit: Duration, now: MonoTime) -> bool {
        self.0 = if is_violated { Some(self.0.unwrap_or(now)) } else { None };
        self.lasts(limit, now)
    }

    fn lasts(self, limit: Duration, now: MonoTime) -> bool {
        self.0.is_some_and(|since| !now.is_within(limit, since))
    }
}

/// A violation that only some moments tell of, as a contradiction of two heading rates does while the vehicle turns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Doubt {
    violation: Lasting,
    /// The last moment that told of it.
    told: MonoTime,
    is_found: bool,
}

impl Doubt {
    /// True if `is_violated` has been true for longer than `limit`, until a moment tells otherwise. `None` = this one does not tell;
    /// a violation that has not lasted yet is forgotten after a second without.
    pub(super) fn update(&mut self, is_violated: Option<bool>, limit: Duration, now: MonoTime) -> bool {
        if is_violated.is_some() {
            self.told = now;
        }
        let is_open = self.violation.0.is_some() && (self.is_found || now.is_within(FORGOTTEN, self.told));
        self.is_found = self.violation.update(is_violated.unwrap_or(is_open), limit, now);
        self.is_found
    }

    /// True if the violation has lasted for longer than `limit` at the last update.
    pub(super) fn lasts(self, limit: Duration, now: MonoTime) -> bool {
        self.violation.lasts(limit, now)
    }
}

const FORGOTTEN: Duration = Duration::from_secs(1);

/// Since when a value stays the same.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frozen {
    value: Option<f64>,
    since: MonoTime,
    /// What it is compared with, at that time.
    reference: Option<f64>,
    /// True if the reference has changed enough since.
    is_suspect: bool,
}

impl Frozen {
    /// True if the value has stayed the same for longer than `limit`, although the reference changed by more than `change`. `None` =
    /// not to be judged.
    pub(super) fn update(
        &mut self,
        value: Option<f64>,
        (reference, change): (Option<f64>, f64),
        limit: Duration,
        now: MonoTime,
    ) -> bool {
        if value.is_none() || value != self.value {
            *self = Self { value, since: now, reference, is_suspect: false };
            return false;
        }
        let has_changed = |(one, other): (f64, f64)| (one - other).abs() > change;
        self.is_suspect |= reference.zip(self.reference).is_some_and(has_changed);
        self.reference = self.reference.or(reference);
        self.is_suspect && !now.is_within(limit, self.since)
    }
}

/// Samples of a value over the last half second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    samples: [Option<(MonoTime, f64)>; SAMPLES],
    next: usize,
}

const SAMPLES: usize = 12;
/// Time between samples, so that they cover more than [`SPAN`].
const SPACING: Duration = Duration::from_millis(50);
/// The time over which a change is judged; single frames jump by more on a healthy car.
const SPAN: Duration = Duration::from_millis(500);

impl Default for Change {
    fn default() -> Self {
        Self { samples: [None; SAMPLES], next: 0 }
    }
}

impl Change {
    /// The change over half a second, per second; `None` while the value is not known for so long.
    pub(super) fn per_second(&mut self, value: Option<f64>, now: MonoTime) -> Option<f64> {
        let Some(value) = value else {
            *self = Self::default();
            return None;
        };
        let newest = self.samples[(self.next + SAMPLES - 1) % SAMPLES];
        if newest.is_none_or(|(at, _)| now.since(at) >= SPACING) {
            self.samples[self.next] = Some((now, value));
            self.next = (self.next + 1) % SAMPLES;
        }
        let old_enough = |(at, _): &(MonoTime, f64)| now.since(*at) >= SPAN;
        let before = self.samples.iter().flatten().copied().filter(old_enough).max_by_key(|(at, _)| *at)?;
        let (at, past) = before;
        let span = now.since(at);
        // After a gap the change is not known.
        (span < 2 * SPAN).then(|| (value - past) / span.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    #[test]
    fn a_violation_has_to_last() {
        let mut lasting = Lasting::default();
        let limit = Duration::from_secs(1);
        assert!(!lasting.update(true, limit, at(0)) && !lasting.update(true, limit, at(1000)));
        assert!(lasting.update(true, limit, at(1001)));
        assert!(!lasting.update(false, limit, at(1100)) && !lasting.update(true, limit, at(2500)));
    }

    #[test]
    fn a_value_is_frozen_only_while_its_reference_changes() {
        let mut frozen = Frozen::default();
        let limit = Duration::from_secs(3);
        let with = |reference| (Some(reference), 0.5);
        for millis in (0..5000).step_by(20) {
            assert!(!frozen.update(Some(1.0), with(7.0), limit, at(millis)), "nothing else changes");
        }
        assert!(!frozen.update(Some(1.0), with(7.4), limit, at(5000)), "too little");
        assert!(frozen.update(Some(1.0), with(7.6), limit, at(5020)));
        assert!(frozen.update(Some(1.0), with(7.0), limit, at(5040)), "it goes on");
        assert!(!frozen.update(Some(1.1), with(9.0), limit, at(5060)), "it changes");
        assert!(!frozen.update(None, with(1.0), limit, at(9000)));
    }

    #[test]
    fn a_change_is_judged_over_half_a_second() {
        let mut change = Change::default();
        let mut last = None;
        for millis in (0..2000_u64).step_by(10) {
            // 4 per second, with a jump of one in a single frame.
            let jump = if millis == 1000 { 1.0 } else { 0.0 };
            #[allow(clippy::cast_precision_loss)]
            let value = millis as f64 / 1000.0 * 4.0 + jump;
            last = change.per_second(Some(value), at(millis));
            if millis >= 500 {
                let slope = last.unwrap();
                assert!((slope - 4.0).abs() < 2.1, "{slope} at {millis}");
            }
        }
        assert!((last.unwrap() - 4.0).abs() < 0.01);
        assert_eq!(change.per_second(None, at(2000)), None);
        assert_eq!(change.per_second(Some(0.0), at(2010)), None);
    }
}
