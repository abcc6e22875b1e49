//! The unsigned speed: of the vehicle, or of its wheels.

use super::binding::{SpeedSignal, SpeedSignals, SpeedSource, VelocityBinding, WheelsUsed};
use crate::vehicle_status::plausibility::alarm::{Alarm, AlarmSet};
use crate::vehicle_status::plausibility::limits::STANDING_MPS;
use crate::vehicle_status::settings::GeometryKey;
use crate::vehicle_status::state::{Chosen, Judged, StatusContext, StatusReason};
use crate::vehicle_status::steering::TireAngle;
use can_signal::can::ReceiveTime;

/// Possible speeds of a vehicle, m/s, backward negative.
const SPEEDS: std::ops::RangeInclusive<f64> = -20.0..=90.0;

/// Speed read from a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedReading {
    /// Speed, m/s; backward negative if the source has a sign, otherwise never negative.
    pub speed_mps: f64,
    /// True if the source has a sign.
    pub is_signed: bool,
}

/// Speeds of single wheels, m/s: front left, front right, rear left, rear right. `None` without a usable
/// value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelSpeeds {
    /// Speeds with the receive times of their frames.
    pub speeds: [Option<(f64, ReceiveTime)>; 4],
    /// True if the speeds are signed.
    pub are_signed: bool,
    /// Why a wheel has no value, if that is its first value since the start.
    pub awaited: Option<StatusReason>,
}

impl WheelSpeeds {
    /// Reads each wheel from the first source that has a value for it.
    pub fn read(binding: &VelocityBinding, context: StatusContext<'_>) -> Self {
        let mut read = Self { are_signed: true, ..Self::default() };
        for source in &binding.speeds {
            let SpeedSignals::Wheels { wheels, .. } = &source.signals else { continue };
            for (speed, wheel) in read.speeds.iter_mut().zip(wheels.iter()) {
                let Some(wheel) = wheel.as_ref().filter(|_| speed.is_none()) else { continue };
                read.are_signed &= wheel.is_signed;
                let value = wheel.read(context);
                let awaited = value.err().filter(|reason| reason.is_awaited(false));
                (*speed, read.awaited) = (value.ok(), read.awaited.or(awaited));
            }
        }
        read
    }

    /// Returns true if a wheel turns.
    pub fn is_any_turning(&self) -> bool {
        self.speeds.iter().flatten().any(|(speed, _)| speed.abs() >= STANDING_MPS)
    }
}

impl SpeedSignal {
    /// Returns the speed, m/s.
    fn read(&self, context: StatusContext<'_>) -> Judged<f64> {
        let (value, received) = self.quantity.read(context)?;
        let geometry = &context.settings.geometry;
        let radius = if self.is_rotation {
            geometry.wheel_radius_m.ok_or(StatusReason::NotConfigured(GeometryKey::WheelRadius))?
        } else {
            1.0
        };
        let speed = value * radius * geometry.speed_scale;
        let speed = if self.is_signed { speed } else { speed.abs() };
        let is_possible = SPEEDS.contains(&speed);
        is_possible.then_some((speed, received)).ok_or(StatusReason::OutOfRange(self.quantity.role.signal))
    }
}

/// Reads the first usable source. `tire` is the angle of the front wheels, for sources that need it; wheels
/// with an alarm are left out.
pub fn judge(
    binding: &VelocityBinding,
    tire: Judged<TireAngle>,
    alarms: AlarmSet,
    context: StatusContext<'_>,
) -> Chosen<SpeedReading> {
    Chosen::first(&binding.speeds, |_, source| read(binding, source, tire, alarms, context))
}

/// Returns the speed of the next usable source after the chosen one, m/s, unsigned; `None` if there is none.
pub fn other_mps(
    binding: &VelocityBinding,
    chosen: Chosen<SpeedReading>,
    tire: Judged<TireAngle>,
    alarms: AlarmSet,
    context: StatusContext<'_>,
) -> Option<f64> {
    let (_, received) = chosen.state.ok()?;
    binding.speeds.iter().skip(chosen.source + 1).find_map(|source| {
        let read = read(binding, source, tire, alarms, context).ok()?;
        binding.in_step(read, received).ok().map(|other| other.speed_mps.abs())
    })
}

fn read(
    binding: &VelocityBinding,
    source: &SpeedSource,
    tire: Judged<TireAngle>,
    alarms: AlarmSet,
    context: StatusContext<'_>,
) -> Judged<SpeedReading> {
    let (speed_mps, is_signed, received) = match &source.signals {
        SpeedSignals::Vehicle(signal) => {
            let (speed, received) = signal.read(context)?;
            (speed, signal.is_signed, received)
        }
        SpeedSignals::Wheels { wheels, used } => {
            let used_wheels = match used {
                WheelsUsed::Rear => 2..4,
                WheelsUsed::All => 0..4,
                WheelsUsed::FrontProjected => 0..2,
            };
            let is_used =
                |index: &usize| used_wheels.contains(index) && !alarms.has(Alarm::OF_WHEELS[*index]);
            let used_wheels: [_; 4] =
                std::array::from_fn(|index| wheels[index].as_ref().filter(|_| is_used(&index)));
            let (mean, received) = mean(binding, used_wheels, context)?;
            let is_signed = used_wheels.iter().flatten().all(|wheel| wheel.is_signed);
            let projected = match used {
                WheelsUsed::Rear | WheelsUsed::All => mean,
                WheelsUsed::FrontProjected => mean * binding.in_step(tire?, received)?.0.cos(),
            };
            (projected, is_signed, received)
        }
    };
    if source.below_mps.is_some_and(|below| speed_mps.abs() >= below) {
        return Err(StatusReason::NotChosen);
    }
    Ok((SpeedReading { speed_mps, is_signed }, received))
}

/// Returns the mean of the wheels, with the receive time of the first wheel's frame.
fn mean(
    binding: &VelocityBinding,
    wheels: [Option<&SpeedSignal>; 4],
    context: StatusContext<'_>,
) -> Judged<f64> {
    let mut sum = 0.0;
    let mut count = 0.0;
    let mut leading: Option<ReceiveTime> = None;
    for wheel in wheels.into_iter().flatten() {
        let read = wheel.read(context)?;
        let received = *leading.get_or_insert(read.1);
        sum += binding.in_step(read, received)?;
        count += 1.0;
    }
    leading.map(|received| (sum / count, received)).ok_or(StatusReason::NoSource)
}
