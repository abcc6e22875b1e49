//! Motion of the vehicle: a bicycle model whose speed and steering change at limited rates.

use std::time::Duration;

use gateway_base::time::MonoTime;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::settings::{VehicleGeometry, WheelToTire};

/// Acceleration and comfortable deceleration, m/s².
pub const ACCELERATION_MPS2: f64 = 2.0;
/// Deceleration of emergency braking, m/s².
pub const EMERGENCY_MPS2: f64 = 8.0;
/// Rate at which the front wheels turn, rad/s.
pub const STEERING_RADPS: f64 = 0.4;
/// Amplitude and period of the sway of the front wheels while the vehicle moves, rad and s: no driver holds
/// them still, and checks for frozen sensors rely on it.
const SWAY: (f64, f64) = (0.002, 1.7);

/// Dimensions of the vehicle as configured, with defaults of a mid-size car.
#[derive(Debug, Clone, PartialEq)]
pub struct Dimensions {
    /// Distance between the axles, m.
    pub wheel_base_m: f64,
    /// Distance between the rear wheels, m.
    pub wheel_tread_m: f64,
    /// Rolling radius of the wheels, m.
    pub(super) wheel_radius_m: f64,
    /// Factor that the gateway applies to each speed.
    pub(super) speed_scale: f64,
    wheel_to_tire: WheelToTire,
    steering_offset_rad: f64,
    max_tire_rad: f64,
}

impl From<&VehicleGeometry> for Dimensions {
    fn from(geometry: &VehicleGeometry) -> Self {
        Self {
            wheel_base_m: geometry.wheel_base_m.unwrap_or(2.7),
            wheel_tread_m: geometry.wheel_tread_m.unwrap_or(1.6),
            wheel_radius_m: geometry.wheel_radius_m.unwrap_or(0.33),
            speed_scale: geometry.speed_scale,
            wheel_to_tire: geometry.wheel_to_tire.clone().unwrap_or(WheelToTire::Ratio(16.0)),
            steering_offset_rad: geometry.steering_offset_rad,
            max_tire_rad: geometry.max_tire_rad,
        }
    }
}

/// The motion at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionState {
    /// Speed of the middle of the rear axle, m/s, forward positive.
    pub speed_mps: f64,
    /// Angle of the middle front wheel, rad, left positive.
    pub tire_rad: f64,
    /// Heading rate, rad/s, counter-clockwise positive.
    pub heading_rate_radps: f64,
    /// The engaged gear: park, reverse, neutral or drive.
    pub gear: Gear,
}

/// Values measured by the vehicle's sensors at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Readings {
    pub(super) motion: MotionState,
    /// Front left, front right, rear left, rear right, m/s, forward positive.
    pub(super) wheels_mps: [f64; 4],
    /// Angle of the front wheels with the offset that the configuration subtracts, rad.
    pub(super) tire_rad: f64,
    /// Angle of the steering wheel, rad.
    pub(super) steering_wheel_rad: f64,
}

/// A value that changes to another at a constant rate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ramp {
    from: f64,
    to: f64,
    per_second: f64,
    since: MonoTime,
}

impl Ramp {
    const ZERO: Self = Self { from: 0.0, to: 0.0, per_second: 0.0, since: MonoTime::ZERO };

    fn at(self, now: MonoTime) -> f64 {
        let change = self.per_second * now.since(self.since).as_secs_f64();
        let whole = self.to - self.from;
        if whole.abs() <= change { self.to } else { self.from + change.copysign(whole) }
    }

    fn change(&mut self, to: f64, per_second: f64, now: MonoTime) {
        *self = Self { from: self.at(now), to, per_second, since: now };
    }

    fn reach(&mut self, to: f64, within: Duration, now: MonoTime) {
        if within.is_zero() {
            *self = Self { from: to, to, per_second: 0.0, since: now };
        } else {
            self.change(to, (to - self.at(now)).abs() / within.as_secs_f64(), now);
        }
    }
}

/// State of a moving vehicle.
#[derive(Debug, Clone)]
pub(super) struct VehicleMotion {
    dimensions: Dimensions,
    speed_mps: Ramp,
    tire_rad: Ramp,
    gear: Gear,
}

impl VehicleMotion {
    /// Creates a vehicle that is parked with its wheels straight ahead.
    pub(super) fn new(dimensions: Dimensions) -> Self {
        Self { dimensions, speed_mps: Ramp::ZERO, tire_rad: Ramp::ZERO, gear: Gear::Park }
    }

    /// Engages a gear.
    pub(super) fn engage(&mut self, gear: Gear, now: MonoTime) -> Result<(), &'static str> {
        let speed_mps = self.speed_mps.at(now);
        let fits = match gear.direction() {
            Some(direction) => speed_mps * direction >= 0.0,
            None => speed_mps == 0.0 || gear == Gear::Neutral,
        };
        if !fits {
            return Err("the vehicle moves, and keeps its gear");
        }
        self.gear = gear;
        // In neutral it rolls on without propulsion.
        self.speed_mps.change(speed_mps, 0.0, now);
        Ok(())
    }

    /// Accelerates or slows down to a speed in the direction of the gear.
    pub(super) fn drive(&mut self, speed_mps: f64, now: MonoTime) -> Result<(), &'static str> {
        let direction = match self.gear.direction() {
            Some(direction) => direction,
            None if speed_mps == 0.0 => 1.0,
            None => return Err("no gear moves the vehicle in park and neutral"),
        };
        self.speed_mps.change(direction * speed_mps, ACCELERATION_MPS2, now);
        Ok(())
    }

    /// Brakes to a standstill as hard as it can.
    pub(super) fn brake(&mut self, now: MonoTime) {
        self.speed_mps.change(0.0, EMERGENCY_MPS2, now);
    }

    /// Turns the front wheels to an angle, left positive, within their limit.
    pub(super) fn steer(&mut self, tire_rad: f64, now: MonoTime) {
        let limit = self.dimensions.max_tire_rad;
        self.tire_rad.change(tire_rad.clamp(-limit, limit), STEERING_RADPS, now);
    }

    /// Moves at the given speed and heading rate, reached within a time: with the gear for the speed and the
    /// steering angle for the heading rate.
    pub(super) fn follow(
        &mut self,
        speed_mps: f64,
        heading_rate_radps: f64,
        within: Duration,
        now: MonoTime,
    ) {
        if speed_mps != 0.0 {
            self.gear = if speed_mps < 0.0 { Gear::Reverse } else { Gear::Drive };
            let tire_rad = (heading_rate_radps * self.dimensions.wheel_base_m / speed_mps).atan();
            let limit = self.dimensions.max_tire_rad;
            self.tire_rad.reach(tire_rad.clamp(-limit, limit), within, now);
        }
        self.speed_mps.reach(speed_mps, within, now);
    }

    /// Returns the motion at `now`.
    pub(super) fn state(&self, now: MonoTime) -> MotionState {
        let speed_mps = self.speed_mps.at(now);
        let (sway_rad, period_s) = SWAY;
        let phase = now.since(MonoTime::ZERO).as_secs_f64() / period_s * std::f64::consts::TAU;
        // The sway is smaller in slow motion.
        let sway_rad = sway_rad * speed_mps.abs().min(1.0) * phase.sin();
        let tire_rad = self.tire_rad.at(now) + sway_rad;
        let heading_rate_radps = speed_mps * tire_rad.tan() / self.dimensions.wheel_base_m;
        MotionState { speed_mps, tire_rad, heading_rate_radps, gear: self.gear }
    }

    /// Returns the values measured by the sensors at `now`.
    pub(super) fn readings(&self, now: MonoTime) -> Readings {
        let motion = self.state(now);
        let side_mps = motion.heading_rate_radps * self.dimensions.wheel_tread_m / 2.0;
        let rear = [motion.speed_mps - side_mps, motion.speed_mps + side_mps];
        let [front_left, front_right] = rear.map(|speed| speed / motion.tire_rad.cos());
        let tire_rad = motion.tire_rad + self.dimensions.steering_offset_rad;
        Readings {
            motion,
            wheels_mps: [front_left, front_right, rear[0], rear[1]],
            tire_rad,
            steering_wheel_rad: steering_wheel_rad(
                &self.dimensions.wheel_to_tire,
                tire_rad,
                motion.speed_mps,
            ),
        }
    }
}

/// Returns the angle of the steering wheel for this angle of the front wheels.
fn steering_wheel_rad(wheel_to_tire: &WheelToTire, tire_rad: f64, speed_mps: f64) -> f64 {
    match wheel_to_tire {
        WheelToTire::Ratio(ratio) => tire_rad * ratio,
        WheelToTire::Table(points) => {
            let between = points.windows(2).find(|pair| tire_rad <= pair[1].1).or(points.windows(2).last());
            let Some(&[(wheel_0, tire_0), (wheel_1, tire_1)]) = between else { return 0.0 };
            let wheel = wheel_0 + (wheel_1 - wheel_0) * (tire_rad - tire_0) / (tire_1 - tire_0);
            wheel.clamp(points[0].0, points[points.len() - 1].0)
        }
        WheelToTire::Variable { constant, per_speed_squared, per_angle } => {
            let straight = per_speed_squared.mul_add(speed_mps * speed_mps, *constant);
            tire_rad * straight / (1.0 + per_angle * tire_rad.abs())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    fn parked() -> VehicleMotion {
        VehicleMotion::new(Dimensions::from(&VehicleGeometry::default()))
    }

    fn speed_mps(motion: &VehicleMotion, millis: u64) -> f64 {
        motion.state(at(millis)).speed_mps
    }

    #[test]
    fn speed_follows_the_gear_within_its_limits() {
        let mut motion = parked();
        assert!(motion.drive(3.0, at(0)).is_err(), "in park");
        motion.engage(Gear::Reverse, at(0)).unwrap();
        motion.drive(3.0, at(0)).unwrap();
        assert!((speed_mps(&motion, 1000) + ACCELERATION_MPS2).abs() < 1e-9);
        assert!((speed_mps(&motion, 9000) + 3.0).abs() < 1e-9);
        motion.brake(at(9000));
        assert!((speed_mps(&motion, 9250) + 3.0 - EMERGENCY_MPS2 / 4.0).abs() < 1e-9);
        assert!(speed_mps(&motion, 9400).abs() < 1e-9);
    }

    #[test]
    fn a_moving_vehicle_refuses_park_and_the_other_direction_and_rolls_on_in_neutral() {
        let mut motion = parked();
        motion.engage(Gear::Drive, at(0)).unwrap();
        motion.drive(8.0, at(0)).unwrap();
        assert!(
            motion.engage(Gear::Reverse, at(1000)).is_err() && motion.engage(Gear::Park, at(1000)).is_err()
        );
        motion.engage(Gear::Neutral, at(1000)).unwrap();
        assert!((speed_mps(&motion, 5000) - 2.0).abs() < 1e-9, "no gear accelerates it any more");
        assert!(motion.drive(3.0, at(5000)).is_err());
        motion.drive(0.0, at(5000)).unwrap();
        motion.engage(Gear::Park, at(6000)).unwrap();
        assert_eq!(motion.state(at(6000)).gear, Gear::Park);
    }

    #[test]
    fn a_followed_motion_is_reached_in_its_time() {
        let mut motion = parked();
        motion.follow(-2.0, 0.3, Duration::ZERO, at(0));
        let state = motion.state(at(0));
        assert_eq!(state.gear, Gear::Reverse);
        assert!((state.speed_mps + 2.0).abs() < 1e-9 && (state.heading_rate_radps - 0.3).abs() < 1e-9);
        motion.follow(-1.0, 0.0, Duration::from_millis(100), at(0));
        assert!((speed_mps(&motion, 50) + 1.5).abs() < 1e-9 && (speed_mps(&motion, 100) + 1.0).abs() < 1e-9);
        motion.steer(9.0, at(200));
        let most = VehicleGeometry::default().max_tire_rad;
        assert!((motion.state(at(9000)).tire_rad - most).abs() < 0.01, "as far as they turn");
    }
}
