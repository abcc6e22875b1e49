//! The angle of the front wheels: calculated from the steering wheel angle and the geometry of the car, or as
//! sent by the vehicle.

use super::measure::Measure;
use super::quantity::Quantity;
use super::settings::{GeometryKey, VehicleGeometry, WheelToTire};
use super::state::{Judged, StatusContext, StatusReason};

/// Factor of the largest angle of the front wheels up to which a reading is accepted.
const BEYOND_MAX: f64 = 1.1;

/// Angle of a virtual front wheel in the middle, rad, left positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TireAngle(pub f64);

impl TireAngle {
    /// Returns its measured value.
    pub fn measures(self) -> [(Measure, f64); 1] {
        [(Measure::TireAngle, self.0)]
    }
}

/// A signal of the steering.
#[derive(Debug, Clone, PartialEq)]
pub struct SteeringSource {
    /// Name in diagnostics; empty for the only source.
    pub name: String,
    /// Wheels that the angle is measured on.
    pub angle_of: AngleOf,
    /// Steering angle, rad, left positive.
    pub angle: Quantity,
}

impl SteeringSource {
    /// Returns true if the speed changes the angle of the front wheels.
    pub fn depends_on_speed(&self, geometry: &VehicleGeometry) -> bool {
        let is_variable = matches!(geometry.wheel_to_tire,
            Some(WheelToTire::Variable { per_speed_squared, .. }) if per_speed_squared != 0.0);
        is_variable && self.angle_of == AngleOf::SteeringWheel
    }
}

/// Wheels that a steering angle is measured on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum AngleOf {
    SteeringWheel,
    /// The front wheels.
    Tire,
}

/// Evaluates a source. `speed_mps` is the speed, if known.
pub fn judge(
    source: &SteeringSource,
    speed_mps: Option<f64>,
    context: StatusContext<'_>,
) -> Judged<TireAngle> {
    let geometry = &context.settings.geometry;
    let (angle, received) = source.angle.read(context)?;
    let tire = match source.angle_of {
        AngleOf::Tire => angle,
        AngleOf::SteeringWheel => tire_angle(geometry, angle, speed_mps)?
            .ok_or(StatusReason::OutOfRange(source.angle.role.signal))?,
    };
    let tire = tire - geometry.steering_offset_rad;
    if tire.abs() > geometry.max_tire_rad * BEYOND_MAX {
        return Err(StatusReason::OutOfRange(source.angle.role.signal));
    }
    Ok((TireAngle(tire), received))
}

/// Returns the angle of the front wheels, rad, for an angle of the steering wheel, without the offset;
/// `None` outside the table of the configuration.
pub fn tire_angle(
    geometry: &VehicleGeometry,
    wheel_rad: f64,
    speed_mps: Option<f64>,
) -> Result<Option<f64>, StatusReason> {
    let missing = StatusReason::NotConfigured(GeometryKey::SteeringRatio);
    Ok(match geometry.wheel_to_tire.as_ref().ok_or(missing)? {
        WheelToTire::Ratio(ratio) => Some(wheel_rad / ratio),
        WheelToTire::Table(points) => {
            let above = points.partition_point(|(wheel, _)| *wheel < wheel_rad);
            match (above.checked_sub(1).and_then(|below| points.get(below)), points.get(above)) {
                (Some((x0, y0)), Some((x1, y1))) => Some(y0 + (y1 - y0) * (wheel_rad - x0) / (x1 - x0)),
                (None, Some((x, y))) if *x <= wheel_rad => Some(*y),
                _ => None,
            }
        }
        WheelToTire::Variable { constant, per_speed_squared, per_angle } => {
            let speed = match speed_mps {
                Some(speed) => speed,
                None if *per_speed_squared == 0.0 => 0.0,
                None => return Err(StatusReason::NoSpeedForSteering),
            };
            let ratio = per_speed_squared.mul_add(speed * speed, *constant) - per_angle * wheel_rad.abs();
            // The same limit as in Autoware's raw_vehicle_cmd_converter.
            Some(wheel_rad / ratio.max(1e-5))
        }
    })
}
