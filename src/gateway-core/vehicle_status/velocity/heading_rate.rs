//! The heading rate: from a sensor, from the steering, or from the rear wheels.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::binding::{HeadingRateSource, VelocityBinding};
use super::speed::WheelSpeeds;
use crate::vehicle_status::plausibility::alarm::{Alarm, AlarmSet};
use crate::vehicle_status::quantity::Quantity;
use crate::vehicle_status::settings::GeometryKey;
use crate::vehicle_status::state::{Chosen, Judged, StatusContext, StatusReason};
use crate::vehicle_status::steering::TireAngle;
use can_signal::can::ReceiveTime;
use gateway_base::time::MonoTime;

/// Possible heading rates of a vehicle, rad/s.
const RATES: RangeInclusive<f64> = -2.0..=2.0;
/// Possible zeros of a sensor, rad/s; a larger reading while the vehicle stands still is not a zero.
const ZEROS: RangeInclusive<f64> = -0.1..=0.1;
/// Duration of a standstill from which its mean reading is the zero of the sensor.
const STANDSTILL: Duration = Duration::from_millis(500);
/// Maximum number of readings averaged in a standstill, so that the zero follows a sensor that warms up.
const MAX_READINGS: f64 = 1000.0;

/// Inputs of the heading rate.
#[derive(Debug, Clone, Copy)]
pub struct HeadingInputs {
    /// Speed, m/s, forward positive.
    pub speed_mps: f64,
    /// True if nothing shows that the vehicle moves.
    pub is_standing: bool,
    /// Receive time of the frame with the speed.
    pub received: ReceiveTime,
    /// Angle of the front wheels.
    pub tire: Judged<TireAngle>,
    /// Speeds of the wheels.
    pub wheels: WheelSpeeds,
    /// Alarms after the previous evaluation.
    pub alarms: AlarmSet,
}

/// A heading rate, and the rates from all kinds of sources.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgedRate {
    /// Heading rate of the first usable source.
    pub chosen: Chosen<f64>,
    /// Heading rate of the first usable sensor, rad/s.
    pub sensor_radps: Option<f64>,
    /// Heading rate from speed and steering, rad/s.
    pub steering_radps: Option<f64>,
    /// Heading rate from the rear wheels, rad/s.
    pub wheels_radps: Option<f64>,
}

/// Zeros of the sensors, by source position.
#[derive(Debug, Clone, Default)]
pub struct YawZeros {
    standstill: Option<MonoTime>,
    sensors: Vec<Zero>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Zero {
    /// Reading of the sensor at rest.
    offset_radps: f64,
    /// Mean reading during this standstill.
    mean_radps: f64,
    readings: f64,
    /// Receive time of the last reading that was used.
    last: Option<MonoTime>,
}

impl YawZeros {
    /// Returns the heading rate of the first usable source.
    pub fn judge(
        &mut self,
        binding: &VelocityBinding,
        inputs: &HeadingInputs,
        context: StatusContext<'_>,
    ) -> JudgedRate {
        if inputs.is_standing {
            self.standstill.get_or_insert(inputs.received.at);
        } else {
            self.standstill = None;
            self.sensors.iter_mut().for_each(Zero::end);
        }
        self.sensors.resize(binding.heading_rates.len(), Zero::default());
        let believed = |rate: Result<f64, StatusReason>, alarms: &[Alarm]| {
            let alarm = alarms.iter().find(|alarm| inputs.alarms.has(**alarm));
            alarm.map_or(rate, |alarm| rate.and(Err(StatusReason::Implausible(*alarm))))
        };
        let of_wheels = of_wheels(binding, inputs, context);
        let wheels = believed(of_wheels, &[Alarm::RearLeftWheel, Alarm::RearRightWheel]);
        let steering = of_steering(binding, inputs, context);
        let (mut first_reason, mut chosen, mut sensor_radps) = (None, None, None);
        for (source, bound) in binding.heading_rates.iter().enumerate() {
            let rate = match bound {
                HeadingRateSource::YawRate { rate, has_zero_at_standstill } => {
                    let rate = self.sensor(binding, source, (rate, *has_zero_at_standstill), inputs, context);
                    sensor_radps = sensor_radps.or(rate.ok());
                    believed(rate, &[Alarm::YawRateFrozen, Alarm::YawRateContradicts])
                }
                HeadingRateSource::Steering => believed(steering, &[Alarm::SteeringContradicts]),
                HeadingRateSource::Wheels => wheels,
            };
            let possible =
                |rate: f64| RATES.contains(&rate).then_some(rate).ok_or(StatusReason::HeadingRateOutOfRange);
            match rate.and_then(possible) {
                _ if chosen.is_some() => {}
                Ok(rate) => chosen = Some((rate, source)),
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        let chosen = match chosen {
            Some((rate, source)) => {
                Chosen { state: Ok((rate, inputs.received)), source, fallback: first_reason }
            }
            None => Chosen::none(first_reason.unwrap_or(StatusReason::NoSource)),
        };
        JudgedRate { chosen, sensor_radps, steering_radps: steering.ok(), wheels_radps: wheels.ok() }
    }

    fn sensor(
        &mut self,
        binding: &VelocityBinding,
        source: usize,
        (rate, has_zero): (&Quantity, bool),
        inputs: &HeadingInputs,
        context: StatusContext<'_>,
    ) -> Result<f64, StatusReason> {
        let read = rate.read(context)?;
        let value = binding.in_step(read, inputs.received)?;
        if !RATES.contains(&value) {
            return Err(StatusReason::OutOfRange(rate.role.signal));
        }
        let zero = &mut self.sensors[source];
        if let Some(since) = self.standstill.filter(|_| has_zero) {
            zero.take(value, read.1.at, since);
        }
        Ok(value - zero.offset_radps)
    }
}

impl Zero {
    /// Adds a reading of a standstill that began at `since`.
    fn take(&mut self, value_radps: f64, at: MonoTime, since: MonoTime) {
        if at < since || self.last == Some(at) {
            return;
        }
        self.last = Some(at);
        self.readings = (self.readings + 1.0).min(MAX_READINGS);
        self.mean_radps += (value_radps - self.mean_radps) / self.readings;
        if !at.is_within(STANDSTILL, since) && ZEROS.contains(&self.mean_radps) {
            self.offset_radps = self.mean_radps;
        }
    }

    /// Ends a standstill.
    fn end(&mut self) {
        (self.mean_radps, self.readings) = (0.0, 0.0);
    }
}

fn of_steering(
    binding: &VelocityBinding,
    inputs: &HeadingInputs,
    context: StatusContext<'_>,
) -> Result<f64, StatusReason> {
    let wheel_base_m = context.settings.geometry.wheel_base_m;
    let wheel_base_m = wheel_base_m.ok_or(StatusReason::NotConfigured(GeometryKey::WheelBase))?;
    let TireAngle(angle) = binding.in_step(inputs.tire?, inputs.received)?;
    Ok(inputs.speed_mps * angle.tan() / wheel_base_m)
}

fn of_wheels(
    binding: &VelocityBinding,
    inputs: &HeadingInputs,
    context: StatusContext<'_>,
) -> Result<f64, StatusReason> {
    let tread_m = context.settings.geometry.wheel_tread_m;
    let tread_m = tread_m.ok_or(StatusReason::NotConfigured(GeometryKey::WheelTread))?;
    let [_, _, left, right] = inputs.wheels.speeds;
    let (left, right) = left.zip(right).ok_or(inputs.wheels.awaited.unwrap_or(StatusReason::NoRearWheels))?;
    let (left, right) = (binding.in_step(left, inputs.received)?, binding.in_step(right, inputs.received)?);
    let sign = if inputs.speed_mps < 0.0 && !inputs.wheels.are_signed { -1.0 } else { 1.0 };
    Ok(sign * (right - left) / tread_m)
}
