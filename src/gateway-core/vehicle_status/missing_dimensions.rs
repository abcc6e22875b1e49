//! Dimensions of the car that a report needs but the configuration lacks.

use super::binding::StatusBinding;
use super::measure::StatusReport;
use super::settings::{GeometryKey, VehicleGeometry};
use super::steering::AngleOf;
use super::velocity::binding::HeadingRateSource;

/// Returns the sources that cannot be used because a dimension of the car is not configured, each with
/// report, source and dimension.
pub fn missing_dimensions(
    binding: &StatusBinding,
    geometry: &VehicleGeometry,
) -> Vec<(StatusReport, String, GeometryKey)> {
    let mut missing = Vec::new();
    if let Some(velocity) = &binding.velocity {
        for source in &velocity.speeds {
            let has_rotation = source.signals.all().iter().any(|signal| signal.is_rotation);
            if has_rotation && geometry.wheel_radius_m.is_none() {
                missing.push((StatusReport::Velocity, source.name.clone(), GeometryKey::WheelRadius));
            }
        }
        for source in &velocity.heading_rates {
            let key = match source {
                HeadingRateSource::YawRate { .. } => None,
                HeadingRateSource::Steering => {
                    geometry.wheel_base_m.is_none().then_some(GeometryKey::WheelBase)
                }
                HeadingRateSource::Wheels => {
                    geometry.wheel_tread_m.is_none().then_some(GeometryKey::WheelTread)
                }
            };
            let name = format!("the heading rate of the {}", source.name());
            missing.extend(key.map(|key| (StatusReport::Velocity, name, key)));
        }
    }
    for source in &binding.steering {
        if source.angle_of == AngleOf::SteeringWheel && geometry.wheel_to_tire.is_none() {
            let name = "the angle of the steering wheel".to_owned();
            missing.push((StatusReport::Steering, name, GeometryKey::SteeringRatio));
        }
    }
    missing
}
