//! Speed and heading rate at the middle of the rear axle, assembled from speed, direction and heading rate.
//! The lateral speed is 0 in the model of a car whose rear wheels do not steer.

pub mod binding;
pub mod direction;
pub mod heading_rate;
pub mod speed;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finding::{HeadingFinding, StatusFinding, VelocityPart};
use super::gear::Gear;
use super::measure::Measure;
use super::plausibility::Motion;
use super::plausibility::alarm::AlarmSet;
use super::state::{Chosen, Judged, StatusContext, StatusReason};
use super::steering::TireAngle;
use binding::{DirectionSource, VelocityBinding};
use direction::DirectionMemory;
use heading_rate::{HeadingInputs, YawZeros};
use speed::{SpeedReading, WheelSpeeds};

/// Speed from which a second source of the speed shows that the vehicle moves, m/s; some sources read
/// slightly more than 0 at standstill.
const OTHER_MOVES_MPS: f64 = 0.5;

/// Motion of the middle of the rear axle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "VelocitySnapshot")]
pub struct Velocity {
    /// Speed, m/s, forward positive.
    pub longitudinal_mps: f64,
    /// Heading rate, rad/s, counter-clockwise positive.
    pub heading_rate_radps: f64,
}

impl Velocity {
    /// Returns its measured values.
    pub fn measures(self) -> [(Measure, f64); 2] {
        [(Measure::Speed, self.longitudinal_mps), (Measure::HeadingRate, self.heading_rate_radps)]
    }
}

/// The velocity and its parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Assembled {
    /// The velocity, or the reason why it is unavailable.
    pub state: Judged<Velocity>,
    /// The missing part, if any, and the source of the heading rate.
    pub(super) finding: StatusFinding,
    /// Motion, as far as it is known, for the plausibility checks.
    pub motion: Motion,
}

/// Other reports on which a velocity depends.
#[derive(Debug, Clone, Copy)]
pub struct VelocityInputs {
    /// Gear, a possible source of the sign.
    pub gear: Judged<Gear>,
    /// Angle of the front wheels, a possible source of the heading rate.
    pub tire: Judged<TireAngle>,
}

/// State kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct VelocityMemory {
    direction: DirectionMemory,
    zeros: YawZeros,
}

impl VelocityMemory {
    /// Assembles the velocity from its parts. No part may be older than the speed by more than `max_skew` of
    /// the binding.
    pub(super) fn assemble(
        &mut self,
        binding: &VelocityBinding,
        speed: Chosen<SpeedReading>,
        VelocityInputs { gear, tire }: VelocityInputs,
        alarms: AlarmSet,
        context: StatusContext<'_>,
    ) -> Assembled {
        let wheels = WheelSpeeds::read(binding, context);
        let tire_rad = tire.ok().map(|(TireAngle(angle), _)| angle);
        let wheel_base_m = context.settings.geometry.wheel_base_m;
        let mut assembled = Assembled {
            state: Err(StatusReason::NoSource),
            finding: StatusFinding::default(),
            motion: Motion {
                wheels_mps: wheels
                    .speeds
                    .map(|speed| speed.map(|(speed, _)| if wheels.are_signed { speed } else { speed.abs() })),
                tire_rad,
                curvature_radpm: tire_rad.zip(wheel_base_m).map(|(angle, base)| angle.sin() / base),
                gear: gear.ok().map(|(gear, _)| gear),
                ..Motion::default()
            },
        };
        let (reading, received) = match speed.state {
            Ok(reading) => reading,
            Err(reason) => {
                self.direction.forget();
                return Assembled { state: Err(reason), ..assembled };
            }
        };
        assembled.motion.speed_mps = Some(reading.speed_mps);
        assembled.motion.other_speed_mps = speed::other_mps(binding, speed, tire, alarms, context);
        let moves = |other: f64| other >= OTHER_MOVES_MPS;
        let is_standing = reading.speed_mps == 0.0
            && !wheels.is_any_turning()
            && !assembled.motion.other_speed_mps.is_some_and(moves);
        let signed = match self.direction.sign(binding, reading, is_standing, gear, context) {
            Ok(sign) => sign * reading.speed_mps,
            Err(reason) => {
                assembled.finding.part = VelocityPart::Direction;
                return Assembled { state: Err(reason), ..assembled };
            }
        };
        assembled.motion.speed_mps = Some(signed);
        assembled.motion.is_direction_measured = reading.is_signed
            || binding.directions.first().is_some_and(|source| *source != DirectionSource::Gear);
        let inputs = HeadingInputs { speed_mps: signed, is_standing, received, tire, wheels, alarms };
        let rate = self.zeros.judge(binding, &inputs, context);
        let Chosen { state, source, fallback } = rate.chosen;
        assembled.finding.heading = HeadingFinding { source, fallback, replaced: None };
        assembled.motion.yaw_rate_radps = rate.sensor_radps;
        assembled.motion.steering_rate_radps = rate.steering_radps;
        assembled.motion.wheels_rate_radps = rate.wheels_radps;
        let heading_rate_radps = match state {
            Ok((rate, _)) => rate,
            Err(reason) if binding.is_unknown_heading_rate_zero => {
                assembled.finding.heading.replaced = Some(reason);
                0.0
            }
            Err(reason) => {
                assembled.finding.part = VelocityPart::HeadingRate;
                return Assembled { state: Err(reason), ..assembled };
            }
        };
        let velocity = Velocity { longitudinal_mps: signed, heading_rate_radps };
        Assembled { state: Ok((velocity, received)), ..assembled }
    }
}
