//! Collects the motion in a recording as means of the bound signals over short times.

use std::time::Duration;

use super::line::mean;
use crate::vehicle_status::VehicleStatus;
use crate::vehicle_status::gear::{Gear, GearCode};
use crate::vehicle_status::plausibility::alarm::AlarmSet;
use crate::vehicle_status::state::{StatusContext, StatusReason};
use crate::vehicle_status::steering::{self, TireAngle};
use crate::vehicle_status::velocity::direction::DirectionMemory;
use crate::vehicle_status::velocity::speed::{self, WheelSpeeds};
use can_signal::can::{Bus, ReceiveTime};
use gateway_base::time::{MonoTime, Now};

/// Time over which each mean is taken.
pub(super) const CELL: Duration = Duration::from_millis(200);
/// Interval between readings.
const STEP: Duration = Duration::from_millis(20);
/// Maximum number of means kept, enough for two hours.
const MAX_POINTS: usize = 36_000;
/// Minimum speed at which wheel speeds are trusted, m/s; below, sensors read zero.
const SLOWEST_MPS: f64 = 0.5;

/// Motion according to the signals at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionSample {
    /// Speed, m/s, forward positive.
    pub speed_mps: f64,
    /// Speed of the next source, m/s, unsigned.
    pub other_speed_mps: Option<f64>,
    /// Speeds of the wheels, m/s, forward positive: front left, front right, rear left, rear right.
    pub wheels_mps: [Option<f64>; 4],
    /// Yaw rate of the sensor including its zero offset, rad/s, counter-clockwise positive.
    pub yaw_rate_radps: Option<f64>,
    /// Angle of the steering signal, rad, left positive.
    pub steering_rad: Option<f64>,
}

/// Means of one cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) cell: u64,
    pub(super) mean: MotionSample,
}

/// Motion in a recording.
#[derive(Debug, Clone, Default)]
pub struct KinematicSurvey {
    direction: DirectionMemory,
    /// Time at which the next reading is due.
    due: MonoTime,
    cell: u64,
    samples: Vec<MotionSample>,
    pub(super) points: Vec<Point>,
}

impl KinematicSurvey {
    /// Reads the motion from the values received until `now`.
    pub fn observe(&mut self, status: &VehicleStatus, buses: &[Bus], now: Now) {
        if now.mono < self.due {
            return;
        }
        self.due = now.mono.after(STEP);
        if let Some(sample) = self.read(status, status.context(buses, now)) {
            self.add(sample, now.mono);
        }
    }

    /// Adds a sample. Samples must be in order of time.
    pub fn add(&mut self, sample: MotionSample, at: MonoTime) {
        let cell = u64::try_from(at.since(MonoTime::ZERO).as_nanos() / CELL.as_nanos()).unwrap_or(u64::MAX);
        if cell != self.cell {
            self.finish();
            self.cell = cell;
        }
        self.samples.push(sample);
    }

    /// Calculates the mean of the last cell.
    pub(super) fn finish(&mut self) {
        let samples = std::mem::take(&mut self.samples);
        let is_forward = samples.first().is_some_and(|sample| sample.speed_mps > 0.0);
        let is_moving = |sample: &MotionSample| {
            sample.speed_mps.abs() > SLOWEST_MPS && (sample.speed_mps > 0.0) == is_forward
        };
        if !samples.iter().all(is_moving) || self.points.len() >= MAX_POINTS {
            return;
        }
        let Some(speed_mps) = mean(samples.iter().map(|sample| sample.speed_mps)) else { return };
        // A quantity counts if at least half of the samples have it.
        let of = |quantity: &dyn Fn(&MotionSample) -> Option<f64>| {
            let values: Vec<_> = samples.iter().filter_map(quantity).collect();
            mean(values.iter().copied()).filter(|_| 2 * values.len() >= samples.len())
        };
        self.points.push(Point {
            cell: self.cell,
            mean: MotionSample {
                speed_mps,
                other_speed_mps: of(&|sample| sample.other_speed_mps),
                wheels_mps: std::array::from_fn(|wheel| of(&|sample| sample.wheels_mps[wheel])),
                yaw_rate_radps: of(&|sample| sample.yaw_rate_radps),
                steering_rad: of(&|sample| sample.steering_rad),
            },
        });
    }

    fn read(&mut self, status: &VehicleStatus, context: StatusContext<'_>) -> Option<MotionSample> {
        let binding = status.binding.velocity.as_ref()?;
        let mut steering = status.binding.steering.iter();
        let steering = steering.find_map(|source| Some((source, source.angle.read(context).ok()?.0)));
        let received = ReceiveTime { at: context.now.mono, stamp: context.now.wall };
        let tire = steering.and_then(|(source, _)| steering::judge(source, None, context).ok());
        // Only wheels projected to the rear axle need it.
        let tire = Ok(tire.unwrap_or((TireAngle(0.0), received)));
        let chosen = speed::judge(binding, tire, AlarmSet::default(), context);
        let Ok((reading, _)) = chosen.state else {
            self.direction.forget();
            return None;
        };
        let gears = status.binding.gear.iter().flat_map(|gear| &gear.sources);
        let mut gears = gears.filter_map(|source| match context.defined(&source.role) {
            Ok((GearCode::Engaged(gear), received)) => Some((gear, received)),
            Ok((GearCode::NotReverse, received)) => Some((Gear::Drive, received)),
            Ok((GearCode::Between, _)) | Err(_) => None,
        });
        let gear = gears.next().ok_or(StatusReason::NoSource);
        // Steering and wheels turn to the same side in either direction; a yaw rate needs the direction.
        let sign = self.direction.sign(binding, reading, reading.speed_mps == 0.0, gear, context).ok();
        let speed_mps = reading.speed_mps * sign.unwrap_or(1.0);
        let wheels = WheelSpeeds::read(binding, context);
        let yaw_rate = sign.and_then(|_| binding.yaw_rates().find_map(|rate| rate.read(context).ok()));
        let sign = if wheels.are_signed { 1.0 } else { speed_mps.signum() };
        Some(MotionSample {
            speed_mps,
            other_speed_mps: speed::other_mps(binding, chosen, tire, AlarmSet::default(), context),
            wheels_mps: wheels.speeds.map(|speed| speed.map(|(speed, _)| sign * speed)),
            yaw_rate_radps: yaw_rate.map(|(rate, _)| rate),
            steering_rad: steering.map(|(_, angle)| angle),
        })
    }
}
