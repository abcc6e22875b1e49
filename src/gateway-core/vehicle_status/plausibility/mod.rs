//! Checks whether the parts of the motion are consistent. A check must fail for some time before it raises an
//! alarm.
//!
//! The limits raise no alarm on public recordings of healthy cars (docs/spec/vehicle-interface.md,
//! "Plausibility").

pub mod alarm;
pub mod limits;
mod observer;
mod wheels;

use std::time::Duration;

use super::gear::Gear;
use alarm::{Alarm, AlarmSet};
use gateway_base::time::MonoTime;
use limits::{
    FROZEN, FROZEN_STEERING, MOVING_MPS, ONE_SECOND, ROLLING_MPS, THREE_SECONDS, TURNING_MPS, TURNING_RADPS,
    TWO_SECONDS,
};
use observer::{Change, Doubt, Frozen, Lasting};
use wheels::WheelChecks;

/// Motion at one instant, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Speed, m/s, forward positive; unsigned while the direction is unknown.
    pub speed_mps: Option<f64>,
    /// True if the direction comes from a signal rather than the gear.
    pub is_direction_measured: bool,
    /// Speed of the next source, m/s, unsigned.
    pub other_speed_mps: Option<f64>,
    /// Speeds of the wheels, m/s, unsigned unless all have a sign.
    pub wheels_mps: [Option<f64>; 4],
    /// Heading rate from the sensor, rad/s.
    pub yaw_rate_radps: Option<f64>,
    /// Heading rate from speed and steering, rad/s.
    pub steering_rate_radps: Option<f64>,
    /// Heading rate from the rear wheels, rad/s.
    pub wheels_rate_radps: Option<f64>,
    /// Angle of the front wheels, rad.
    pub tire_rad: Option<f64>,
    /// Heading rate per m/s of the front wheels, from their angle, rad/m.
    pub curvature_radpm: Option<f64>,
    /// The engaged gear.
    pub gear: Option<Gear>,
}

impl Motion {
    /// Returns the larger of the heading rates from yaw rate and steering, unsigned, rad/s, at the speed of
    /// the fastest wheel; `None` if neither is known. The vehicle's speed is not used, since it may be wrong.
    fn rate_radps(&self, fastest_mps: f64) -> Option<f64> {
        let by_steering = self.curvature_radpm.map(|curvature| curvature * fastest_mps);
        self.yaw_rate_radps.into_iter().chain(by_steering).map(f64::abs).reduce(f64::max)
    }
}

/// Plausibility checks with their state.
#[derive(Debug, Clone, Default)]
pub struct Plausibility {
    wheels: WheelChecks,
    speeds: [Doubt; 2],
    rates_apart: Lasting,
    /// Pairs: yaw rate and steering, yaw rate and wheels, steering and wheels.
    rates: [Doubt; 3],
    rates_undecided: Doubt,
    yaw_frozen: Frozen,
    steering_frozen: Frozen,
    direction: Lasting,
    park: Lasting,
    speed_change: Change,
    yaw_change: Change,
    tire_change: Change,
    /// Leaps of speed, heading rate and angle of the front wheels.
    leaps: [Doubt; 3],
    alarms: AlarmSet,
}

impl Plausibility {
    /// Returns the alarms after the last motion.
    pub fn alarms(&self) -> AlarmSet {
        self.alarms
    }

    /// Checks a motion and returns the alarms.
    pub fn update(&mut self, motion: Motion, now: MonoTime) -> AlarmSet {
        let mut alarms = AlarmSet::default();
        let rate_radps = |fastest_mps| motion.rate_radps(fastest_mps);
        let are_wheels_doubted = self.wheels.update(&motion.wheels_mps, rate_radps, now, &mut alarms);
        if alarms.of_wheels() != self.alarms.of_wheels() {
            // The speed now comes from different wheels, which is not a change of speed.
            self.speed_change = Change::default();
        }
        self.judge_speeds(motion, now, &mut alarms);
        self.judge_rates(motion, are_wheels_doubted, now, &mut alarms);
        self.judge_changes(motion, now, &mut alarms);
        self.judge_gear(motion, now, &mut alarms);
        self.alarms = alarms;
        alarms
    }

    fn judge_speeds(&mut self, motion: Motion, now: MonoTime, alarms: &mut AlarmSet) {
        let speeds = motion.speed_mps.zip(motion.other_speed_mps);
        let differ =
            |share, more| speeds.is_some_and(|(one, other)| differs(one.abs(), other.abs(), share, more));
        let [warn, withhold] = &mut self.speeds;
        alarms.set(Alarm::SpeedsDiffer, warn.update(Some(differ(0.05, 0.5)), TWO_SECONDS, now));
        alarms.set(Alarm::SpeedsContradict, withhold.update(Some(differ(0.3, 1.0)), TWO_SECONDS, now));
    }

    fn judge_rates(
        &mut self,
        motion: Motion,
        are_wheels_doubted: bool,
        now: MonoTime,
        alarms: &mut AlarmSet,
    ) {
        let is_faster = |limit| motion.speed_mps.is_some_and(|speed| speed.abs() > limit);
        // A heading rate calculated from a wrong speed is wrong, regardless of the steering.
        let is_speed_doubted = motion.speed_mps.zip(motion.other_speed_mps);
        let is_speed_doubted =
            is_speed_doubted.is_some_and(|(one, other)| differs(one.abs(), other.abs(), 0.3, 1.0));
        let is_turning = is_faster(TURNING_MPS) && !is_speed_doubted && !are_wheels_doubted;
        let known = |rate: Option<f64>| rate.filter(|_| is_turning);
        let (yaw, steering) = (known(motion.yaw_rate_radps), known(motion.steering_rate_radps));
        let wheels = known(motion.wheels_rate_radps);
        let is_apart = yaw.zip(steering).is_some_and(|(yaw, steering)| differs(yaw, steering, 0.3, 0.05));
        alarms.set(Alarm::YawRateDiffers, self.rates_apart.update(is_apart, ONE_SECOND, now));
        let pairs = [(yaw, steering), (yaw, wheels), (steering, wheels)];
        let evidence =
            pairs.map(|(one, other)| one.zip(other).and_then(|(one, other)| contradiction(one, other)));
        let contradict: [_; 3] =
            std::array::from_fn(|pair| self.rates[pair].update(evidence[pair], TWO_SECONDS, now));
        let is_apart_for_long = self.rates_undecided.update(evidence[0], THREE_SECONDS, now);
        // The rear wheels decide which of the two is wrong if they show it within a second; evidence that has
        // lasted for a second then counts.
        let mut blamed = [Alarm::YawRateContradicts, Alarm::SteeringContradicts].into_iter();
        let blamed = blamed.find(|alarm| self.alarms.has(*alarm));
        let begun = self.rates.map(|doubt| is_apart_for_long && doubt.lasts(ONE_SECOND));
        let alarm = match [contradict[0], contradict[1] | begun[1], contradict[2] | begun[2]] {
            [true, true, false] => Some(Alarm::YawRateContradicts),
            [true, false, true] => Some(Alarm::SteeringContradicts),
            // Their earlier decision stands until the two agree.
            [true, false, false] if blamed.is_some() => blamed,
            [true, ..] if is_apart_for_long || motion.wheels_rate_radps.is_none() => {
                Some(Alarm::RatesContradict)
            }
            [..] => None,
        };
        if let Some(alarm) = alarm {
            alarms.set(alarm, true);
        }
        let is_moving = is_faster(MOVING_MPS);
        let (yaw, tire) = (motion.yaw_rate_radps, motion.tire_rad);
        let reference = (motion.steering_rate_radps, TURNING_RADPS);
        let is_frozen = self.yaw_frozen.update(yaw, is_moving, reference, FROZEN, now);
        alarms.set(Alarm::YawRateFrozen, is_frozen);
        let is_frozen =
            self.steering_frozen.update(tire, is_moving, (yaw, TURNING_RADPS), FROZEN_STEERING, now);
        alarms.set(Alarm::SteeringFrozen, is_frozen);
    }

    fn judge_changes(&mut self, motion: Motion, now: MonoTime, alarms: &mut AlarmSet) {
        // A contradicted speed changes when the contradiction ends.
        let speed_mps = motion.speed_mps.filter(|_| !alarms.has(Alarm::WheelsContradict));
        let mut judge = |change: &mut Change, leap: &mut Doubt, value, limit, [jumps, leaps]: [Alarm; 2]| {
            let change = change.per_second(value, now).map_or(0.0, f64::abs);
            alarms.set(jumps, change > limit);
            alarms.set(leaps, leap.update(Some(change > 2.0 * limit), Duration::ZERO, now));
        };
        let [speed, yaw, tire] = &mut self.leaps;
        judge(&mut self.speed_change, speed, speed_mps, 15.0, [Alarm::SpeedJumps, Alarm::SpeedLeaps]);
        let of_yaw = [Alarm::YawRateJumps, Alarm::YawRateLeaps];
        judge(&mut self.yaw_change, yaw, motion.yaw_rate_radps, 10.0, of_yaw);
        let of_steering = [Alarm::SteeringJumps, Alarm::SteeringLeaps];
        judge(&mut self.tire_change, tire, motion.tire_rad, 2.0, of_steering);
    }

    fn judge_gear(&mut self, motion: Motion, now: MonoTime, alarms: &mut AlarmSet) {
        let speed = motion.speed_mps.unwrap_or_default();
        let direction = motion.gear.and_then(Gear::direction).filter(|_| motion.is_direction_measured);
        let is_against = direction.is_some_and(|direction| speed * direction < -ROLLING_MPS);
        alarms.set(Alarm::DirectionAgainstGear, self.direction.update(is_against, ONE_SECOND, now));
        let is_parked = motion.gear == Some(Gear::Park) && speed.abs() > ROLLING_MPS;
        alarms.set(Alarm::MovesInPark, self.park.update(is_parked, ONE_SECOND, now));
    }
}

/// Returns true if a value differs from a reference by more than `share` of it plus `more`.
fn differs(value: f64, reference: f64, share: f64, more: f64) -> bool {
    (value - reference).abs() > share * value.abs().max(reference.abs()) + more
}

/// Returns whether two heading rates contradict each other; `None` while they are too small to decide.
fn contradiction(one: f64, other: f64) -> Option<bool> {
    let are_turning = one.abs().min(other.abs()) > TURNING_RADPS;
    let contradicts = are_turning && one * other < 0.0 || differs(one, other, 0.6, 0.1);
    (contradicts || are_turning).then_some(contradicts)
}
