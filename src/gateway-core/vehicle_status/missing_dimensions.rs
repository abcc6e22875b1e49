//! Dimensions of the car that a report needs but the configuration lacks.

use super::binding::StatusBinding;
use super::measure::StatusReport;
use super::settings::{GeometryKey, VehicleGeometry};
use super::steering::AngleOf;
use super::velocity::binding::{HeadingRateSource, SpeedSource};

/// Returns the sources that cannot be used because a dimension of the car is not configured, each with
/// report, source and dimension.
pub fn missing_dimensions(
    binding: &StatusBinding,
    geometry: &VehicleGeometry,
) -> Vec<(StatusReport, String, GeometryKey)> {
    let velocity = || binding.velocity.iter();
    let has_rotation = |source: &&SpeedSource| source.signals.all().iter().any(|signal| signal.is_rotation);
    let speeds = velocity().flat_map(|velocity| &velocity.speeds).filter(has_rotation);
    let speeds = speeds.filter(|_| geometry.wheel_radius_m.is_none());
    let speeds = speeds.map(|source| (StatusReport::Velocity, source.name.clone(), GeometryKey::WheelRadius));
    let rates = velocity().flat_map(|velocity| &velocity.heading_rates).filter_map(|source| {
        let (dimension, key) = match source {
            HeadingRateSource::YawRate { .. } => return None,
            HeadingRateSource::Steering => (geometry.wheel_base_m, GeometryKey::WheelBase),
            HeadingRateSource::Wheels => (geometry.wheel_tread_m, GeometryKey::WheelTread),
        };
        let name = format!("the heading rate of the {}", source.name());
        dimension.is_none().then_some((StatusReport::Velocity, name, key))
    });
    let steering = binding.steering.iter().filter(|source| source.angle_of == AngleOf::SteeringWheel);
    let steering = steering.filter(|_| geometry.wheel_to_tire.is_none()).map(|_| {
        let name = "the angle of the steering wheel".to_owned();
        (StatusReport::Steering, name, GeometryKey::SteeringRatio)
    });
    speeds.chain(rates).chain(steering).collect()
}
