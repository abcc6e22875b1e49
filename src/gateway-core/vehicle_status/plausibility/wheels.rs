//! Checks whether the wheels move together. A deviating wheel is left out while the others agree; otherwise
//! it is unknown which wheels are right (docs/spec/vehicle-interface.md,
//! "Wheels that contradict each other").

use super::alarm::{Alarm, AlarmSet};
use super::limits::{FROZEN, MOVING_MPS, ONE_SECOND, STANDING_MPS};
use super::observer::{AGREEMENT, Doubt, Frozen};
use gateway_base::time::MonoTime;

/// Share by which wheels may differ on a straight road, due to tyres and slip.
const SHARE: f64 = 0.1;
/// Additional speed by which wheels may differ, m/s.
const MORE_MPS: f64 = 0.5;
/// Speed up to which a sensor may read 0, m/s.
const SENSOR_START_MPS: f64 = 1.0;
/// Assumed track, m: wheels on the two sides of a turn differ by the heading rate times the track.
const TRACK_M: f64 = 1.6;
/// Share by which a wheel may be slower than the fastest wheel in the sharpest turn of any car, on a circle
/// of 2.4 m around the middle of the rear axle.
const SHARPEST_TURN: f64 = 0.5;
/// Change of the other wheels above which a constant wheel counts as frozen, m/s.
const FROZEN_CHANGE_MPS: f64 = 0.5;

/// Wheel checks with their state. Their result depends only on the wheels and the heading rate: leaving out a
/// wheel or withholding a velocity does not change the comparison.
#[derive(Debug, Clone, Default)]
pub(super) struct WheelChecks {
    /// Trusted wheels differ.
    apart: Doubt,
    suspects: [Suspect; 4],
    frozen: [Frozen; 4],
}

/// Suspicion against one wheel.
#[derive(Debug, Clone, Copy, Default)]
struct Suspect {
    is_suspect: bool,
    /// Time since which the wheel has agreed with the others.
    agrees_since: Option<MonoTime>,
}

impl WheelChecks {
    /// Sets the alarm of a wheel that does not move like the others, or the alarm of several wheels. Returns
    /// true while trusted wheels differ or no wheel is trusted: a speed calculated from them is then
    /// doubtful. `rate_radps` returns the unsigned heading rate, if known.
    pub(super) fn update(
        &mut self,
        speeds_mps: &[Option<f64>; 4],
        rate_radps: impl FnOnce(f64) -> Option<f64>,
        now: MonoTime,
        alarms: &mut AlarmSet,
    ) -> bool {
        let is_idle = !self.apart.is_open() && self.suspects.iter().all(|wheel| !wheel.is_suspect);
        if is_idle && speeds_mps.iter().all(Option::is_none) {
            return false;
        }
        let wheels = Wheels::new(speeds_mps);
        let fastest_mps = wheels.fastest_mps();
        let rate_radps = rate_radps(fastest_mps);
        let mut deviates = wheels.deviating(rate_radps, Zero::OfOthers);
        if is_several(deviates) || wheels.count == 2 {
            deviates = wheels.deviating(rate_radps, Zero::OfEither);
        }
        let is_doubted = (0..4).any(|wheel| deviates[wheel] && !self.suspects[wheel].is_suspect);
        let is_found = self.apart.update(Some(is_doubted), ONE_SECOND, now);
        if is_found {
            self.apart = Doubt::default();
        }
        let are_several = is_several(self.suspects.map(|wheel| wheel.is_suspect));
        for (wheel, suspect) in self.suspects.iter_mut().enumerate() {
            let speed_mps = speeds_mps[wheel];
            let middle_mps = wheels.middle_of_others(wheel);
            let reference = (middle_mps, FROZEN_CHANGE_MPS);
            let is_moving = fastest_mps > MOVING_MPS;
            let is_frozen = self.frozen[wheel].update(speed_mps, is_moving, reference, FROZEN, now);
            let is_turning = speed_mps.is_some_and(|speed| speed.abs() >= STANDING_MPS);
            // Next to a spinning wheel, a wheel with constant speed seems frozen; afterwards it agrees.
            let is_apart = |(speed, middle): (f64, f64)| (speed - middle).abs() > FROZEN_CHANGE_MPS;
            let is_frozen = is_frozen && speed_mps.zip(middle_mps).is_some_and(is_apart);
            // A dead wheel that agrees with standing wheels proves nothing. Several suspects can at least
            // agree on the standstill.
            let agrees = !deviates[wheel] && !is_frozen && (are_several || is_turning);
            suspect.update(agrees, is_frozen || is_found && deviates[wheel], now);
        }
        let is_suspect = self.suspects.map(|wheel| wheel.is_suspect);
        let contradict = is_several(is_suspect);
        alarms.set(Alarm::WheelsContradict, contradict);
        for (alarm, is_suspect) in Alarm::OF_WHEELS.into_iter().zip(is_suspect) {
            alarms.set(alarm, is_suspect && !contradict);
        }
        contradict || is_doubted && !is_found
    }
}

impl Suspect {
    /// Updates the suspicion: `agrees` if the wheel agrees with the others, `is_found` if it becomes suspect.
    /// The wheel is trusted again after it has agreed for [`AGREEMENT`] without a break.
    fn update(&mut self, agrees: bool, is_found: bool, now: MonoTime) {
        self.agrees_since = if agrees { self.agrees_since.or(Some(now)) } else { None };
        let is_over = self.agrees_since.is_some_and(|since| now.since(since) >= AGREEMENT);
        self.is_suspect = is_found || self.is_suspect && !is_over;
    }
}

/// Of two compared wheels, the wheel whose zero may stand for a slightly higher speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Zero {
    /// Zero of the middle of the other wheels.
    OfOthers,
    /// Zero of either wheel.
    OfEither,
}

/// Returns true if more than one wheel is marked.
fn is_several(wheels: [bool; 4]) -> bool {
    wheels.into_iter().filter(|is_meant| *is_meant).count() > 1
}

/// Wheels with a known speed, in the order of their speeds.
struct Wheels {
    /// Speed, m/s, and position.
    sorted: [(f64, usize); 4],
    count: usize,
}

impl Wheels {
    fn new(speeds_mps: &[Option<f64>; 4]) -> Self {
        let (mut sorted, mut count) = ([(0.0, 0); 4], 0);
        for (wheel, speed) in speeds_mps.iter().enumerate() {
            if let Some(speed) = speed {
                sorted[count] = (*speed, wheel);
                count += 1;
            }
        }
        sorted[..count].sort_unstable_by(|(one, _), (other, _)| one.total_cmp(other));
        Self { sorted, count }
    }

    /// Returns the unsigned speed of the fastest wheel, m/s; 0 without wheels.
    fn fastest_mps(&self) -> f64 {
        self.sorted[..self.count].iter().fold(0.0, |fastest, (speed, _)| speed.abs().max(fastest))
    }

    /// Returns the two middle speeds of the other wheels, m/s, which are equal if their number is odd; `None`
    /// if there is no other wheel.
    fn middles_of_others(&self, place: usize) -> Option<[f64; 2]> {
        let last = self.count.checked_sub(2)?;
        let other = |index: usize| self.sorted[if index < place { index } else { index + 1 }].0;
        Some([other(last / 2), other(last.div_ceil(2))])
    }

    /// Returns the lower middle speed of the other wheels, m/s; `None` if this wheel, or every other wheel,
    /// has no speed.
    fn middle_of_others(&self, wheel: usize) -> Option<f64> {
        let place = self.sorted[..self.count].iter().position(|(_, other)| *other == wheel)?;
        self.middles_of_others(place).map(|[middle, _]| middle)
    }

    /// Returns the wheels that differ from the middle speeds of the others by more than a turn with this
    /// heading rate explains.
    fn deviating(&self, rate_radps: Option<f64>, zero: Zero) -> [bool; 4] {
        let mut deviating = [false; 4];
        for (place, (speed, wheel)) in self.sorted[..self.count].iter().enumerate() {
            let differs = |other: f64| {
                let fastest = speed.abs().max(other.abs());
                let sharpest = SHARPEST_TURN * fastest;
                let turn = rate_radps.map_or(sharpest, |rate| sharpest.min(rate * TRACK_M));
                let least = if zero == Zero::OfEither { speed.abs().min(other.abs()) } else { other.abs() };
                let more = if least < STANDING_MPS { SENSOR_START_MPS } else { MORE_MPS };
                (speed - other).abs() > SHARE * fastest + turn + more
            };
            deviating[*wheel] =
                self.middles_of_others(place).is_some_and(|middles| middles.into_iter().all(differs));
        }
        deviating
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviating(speeds: &[f64], rate_radps: Option<f64>) -> Vec<usize> {
        let speeds = std::array::from_fn(|wheel| speeds.get(wheel).copied());
        let deviating = Wheels::new(&speeds).deviating(rate_radps, Zero::OfEither);
        (0..4).filter(|wheel| deviating[*wheel]).collect()
    }

    #[test]
    fn one_wheel_deviates_or_several_do() {
        let straight = Some(0.0);
        for (speeds, expected) in [
            (&[10.0, 10.0, 10.0, 10.0][..], &[][..]),
            (&[10.0, 10.0, 0.0, 10.0], &[2]),
            (&[10.0, 30.0, 10.0, 10.0], &[1]),
            (&[10.0, 10.0, 0.0, 0.0], &[0, 1, 2, 3]),
            (&[0.0, 10.0, 0.0, 10.0], &[0, 1, 2, 3]),
            // A differential lets one rear wheel spin while the other stands.
            (&[10.0, 10.0, 0.0, 20.0], &[2, 3]),
            (&[10.0, 0.0, 10.0], &[1]),
            (&[0.0, 10.0, 20.0], &[0, 1, 2]),
            (&[0.0, 10.0], &[0, 1]),
            // A wheel with the wrong sign.
            (&[-5.0, 5.0], &[0, 1]),
            (&[0.0, 1.1], &[]),
            (&[0.0, 1.2], &[0, 1]),
            (&[7.0], &[]),
            (&[], &[]),
        ] {
            assert_eq!(deviating(speeds, straight), expected, "{speeds:?}");
        }
    }

    #[test]
    fn a_turn_explains_a_difference() {
        // The rear wheels of a car with a wheel base of 2.7 m and a tread of 1.6 m, front wheels at 0.77 rad,
        // 3 m/s.
        let (rate, rear) = (3.0 * 0.77_f64.tan() / 2.7, 0.8 * 3.0 * 0.77_f64.tan() / 2.7);
        let (inner, outer) = (3.0 - rear, 3.0 + rear);
        let front = |rear: f64| rear.hypot(2.7 * rate);
        for rate in [Some(rate), None] {
            assert!(deviating(&[inner, outer], rate).is_empty());
            assert!(deviating(&[front(inner), front(outer), inner, outer], rate).is_empty());
            assert_eq!(deviating(&[0.0, outer], rate), [0, 1]);
        }
        assert_eq!(deviating(&[inner, outer], Some(0.0)), [0, 1]);
    }
}
