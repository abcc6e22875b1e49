//! Conditions that must last before they raise an alarm: a violation, a constant value, a change over half a
//! second.

use std::time::Duration;

use gateway_base::time::MonoTime;

/// Start of a violation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lasting(Option<MonoTime>);

impl Lasting {
    /// Returns true if `is_violated` has been true for longer than `limit`.
    pub(super) fn update(&mut self, is_violated: bool, limit: Duration, now: MonoTime) -> bool {
        self.0 = if is_violated { Some(self.0.unwrap_or(now)) } else { None };
        self.0.is_some_and(|since| !now.is_within(limit, since))
    }
}

/// Time of agreement after which a violation is over.
pub(super) const AGREEMENT: Duration = Duration::from_secs(1);
/// Time without evidence after which a violation that has not yet lasted long enough is forgotten.
const FORGOTTEN: Duration = Duration::from_secs(1);

/// A violation that must last before it is found, and an agreement that must last before it is over. Evidence
/// is not always available: a contradiction of two heading rates shows only while the vehicle turns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Doubt {
    /// Before the violation is found, the time of violation minus the time of agreement; afterwards the time
    /// of agreement since the last violation.
    lasting: Duration,
    is_found: bool,
    /// Evidence that applies from the last update to the next.
    evidence: Option<bool>,
    updated: MonoTime,
    /// Last time with evidence.
    shown: MonoTime,
}

impl Doubt {
    /// Returns true from when the violation has lasted for `limit` until agreement has lasted for
    /// [`AGREEMENT`]. A moment without evidence (`None`) ends neither; a violation not yet found continues
    /// through a second without evidence.
    pub(super) fn update(&mut self, is_violated: Option<bool>, limit: Duration, now: MonoTime) -> bool {
        let elapsed = now.since(self.updated);
        self.updated = now;
        self.lasting = match (self.is_found, self.evidence) {
            (false, Some(true)) => (self.lasting + elapsed).min(limit),
            (false, Some(false)) => self.lasting.saturating_sub(elapsed),
            (false, None) | (true, Some(true)) => Duration::ZERO,
            (true, Some(false)) => self.lasting + elapsed,
            (true, None) => self.lasting,
        };
        if is_violated.is_some() {
            self.shown = now;
        }
        let continues = !self.is_found && now.is_within(FORGOTTEN, self.shown);
        self.evidence = is_violated.or(self.evidence.filter(|_| continues));
        let is_turned = match self.evidence {
            Some(true) => !self.is_found && self.lasting >= limit,
            Some(false) => self.is_found && self.lasting >= AGREEMENT,
            None => false,
        };
        if is_turned {
            (self.is_found, self.lasting) = (!self.is_found, Duration::ZERO);
        }
        self.is_found
    }

    /// Returns true if the violation is found or has lasted for `limit`, at the last update.
    pub(super) fn lasts(self, limit: Duration) -> bool {
        self.is_found || self.lasting >= limit
    }

    /// Returns true if a violation has begun and is not yet over.
    pub(super) fn is_open(&self) -> bool {
        self.is_found || self.evidence == Some(true) || !self.lasting.is_zero()
    }
}

/// A value that stays constant, since a time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frozen {
    value: Option<f64>,
    since: MonoTime,
    /// Reference value at that time.
    reference: Option<f64>,
    /// True if the reference has changed enough since then.
    is_suspect: bool,
    is_found: bool,
}

impl Frozen {
    /// Returns true once the value has stayed constant for longer than `limit` although the reference changed
    /// by more than `change`, and until the value changes. Only the time with `is_moving` counts. A `value`
    /// of `None` is unknown.
    pub(super) fn update(
        &mut self,
        value: Option<f64>,
        is_moving: bool,
        (reference, change): (Option<f64>, f64),
        limit: Duration,
        now: MonoTime,
    ) -> bool {
        if self.is_found && (value.is_none() || value == self.value) {
            return true;
        }
        if !is_moving || value.is_none() || value != self.value {
            *self = Self { value, since: now, reference, ..Self::default() };
            return false;
        }
        let has_changed = |(one, other): (f64, f64)| (one - other).abs() > change;
        self.is_suspect |= reference.zip(self.reference).is_some_and(has_changed);
        self.reference = self.reference.or(reference);
        self.is_found = self.is_suspect && !now.is_within(limit, self.since);
        self.is_found
    }
}

/// Samples of a value over the last half second.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Change {
    samples: [Option<(MonoTime, f64)>; SAMPLES],
    next: usize,
}

const SAMPLES: usize = 12;
/// Minimum time between samples, so that they cover more than [`SPAN`].
const SPACING: Duration = Duration::from_millis(50);
/// Time over which a change is judged; single frames jump by more on a healthy car.
const SPAN: Duration = Duration::from_millis(500);

impl Change {
    /// Returns the change over half a second, per second; `None` if the value has not been known for that
    /// long.
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
        // After a gap, the change is not known.
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
    fn a_violation_is_found_when_it_prevails_and_is_over_when_agreement_lasts() {
        let limit = Duration::from_secs(1);
        let mut doubt = Doubt::default();
        let mut found = |ms: std::ops::Range<u64>, evidence: &dyn Fn(u64) -> Option<bool>| {
            ms.step_by(10).filter(|ms| doubt.update(evidence(*ms), limit, at(*ms))).collect::<Vec<_>>()
        };
        assert_eq!(found(0..1_010, &|_| Some(true)), [1_000]);
        assert_eq!(found(1_010..2_000, &|_| Some(false)).len(), 99, "agreement has to last for a second");
        assert_eq!(found(2_000..2_010, &|_| Some(true)), [2_000], "without a break");
        assert_eq!(found(2_010..9_000, &|_| None).len(), 699, "nothing tells otherwise");
        assert_eq!(found(9_000..12_000, &|_| Some(false)).last(), Some(&9_990));
        // A violation in nine tenths of the time.
        assert_eq!(found(20_000..22_000, &|ms| Some(ms % 100 < 90)).first(), Some(&21_240));
        assert_eq!(found(22_000..25_000, &|_| Some(false)).last(), Some(&22_980));
        assert_eq!(found(30_000..60_000, &|ms| Some(ms % 100 < 50)), [] as [u64; 0], "half of the time");
        // The violation continues for a second without evidence.
        assert_eq!(found(61_000..62_500, &|ms| (ms < 61_500).then_some(true)).first(), Some(&62_000));
        let mut doubt = Doubt::default();
        assert!(!doubt.is_open() && !doubt.update(Some(true), limit, at(0)) && doubt.is_open());
        assert!(!doubt.update(None, limit, at(900)) && doubt.lasts(Duration::from_millis(900)));
        assert!(
            !doubt.update(None, limit, at(1_100)) && !doubt.update(Some(true), limit, at(1_110)),
            "forgotten"
        );
        assert!(!doubt.lasts(Duration::from_millis(1)));
    }

    #[test]
    fn a_value_is_frozen_only_while_its_reference_changes() {
        let mut frozen = Frozen::default();
        let limit = Duration::from_secs(3);
        let with = |reference| (Some(reference), 0.5);
        for millis in (0..5000).step_by(20) {
            assert!(!frozen.update(Some(1.0), true, with(7.0), limit, at(millis)), "nothing else changes");
        }
        assert!(!frozen.update(Some(1.0), true, with(7.4), limit, at(5000)), "too little");
        assert!(frozen.update(Some(1.0), true, with(7.6), limit, at(5020)));
        assert!(frozen.update(Some(1.0), false, with(7.0), limit, at(5040)), "until it changes");
        assert!(frozen.update(None, true, with(7.0), limit, at(5060)));
        assert!(!frozen.update(Some(1.1), true, with(9.0), limit, at(5080)), "it changes");
        assert!(!frozen.update(None, true, with(1.0), limit, at(9000)));
        for millis in (9_000..20_000).step_by(20) {
            let reference = with(f64::from(u8::from(millis % 40 == 0)));
            assert!(!frozen.update(Some(1.0), false, reference, limit, at(millis)), "the vehicle stands");
        }
    }

    #[test]
    fn a_change_is_judged_over_half_a_second() {
        let mut change = Change::default();
        let mut last = None;
        for millis in (0..2000_u64).step_by(10) {
            // A slope of 4 per second, with a jump of 1 in a single frame.
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
