//! Configuration of the vehicle and its reports.

use std::time::Duration;

/// Settings of the status.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusSettings {
    /// Minimum average time between two reports on velocity or steering.
    pub min_period: Duration,
    /// Name of the only source of the gear to use; `None` = the most trusted source that has a value.
    pub gear_source: Option<String>,
    /// Dimensions of the car, as far as they are configured.
    pub geometry: VehicleGeometry,
}

impl Default for StatusSettings {
    fn default() -> Self {
        Self {
            min_period: Duration::from_millis(20),
            gear_source: None,
            geometry: VehicleGeometry::default(),
        }
    }
}

/// Dimensions of the car. No dimension is assumed: a report that needs a missing dimension is not published.
/// A dimension that a public list has for the named car is used and marked as listed.
#[derive(Debug, Clone, PartialEq)]
pub struct VehicleGeometry {
    /// True if the configuration has any dimensions. Otherwise missing dimensions are not reported.
    pub is_configured: bool,
    /// Distance between the axles, m.
    pub wheel_base_m: Option<f64>,
    /// Distance between the rear wheels, m.
    pub wheel_tread_m: Option<f64>,
    /// Effective rolling radius of the wheels, m.
    pub wheel_radius_m: Option<f64>,
    /// Factor for every speed.
    pub speed_scale: f64,
    /// Conversion from the steering wheel to the front wheels.
    pub wheel_to_tire: Option<WheelToTire>,
    /// Where the steering ratio comes from.
    pub ratio_origin: RatioOrigin,
    /// Angle of the front wheels reported when they point straight ahead, rad; it is subtracted.
    pub steering_offset_rad: f64,
    /// Largest angle of the front wheels, rad.
    pub max_tire_rad: f64,
}

impl Default for VehicleGeometry {
    /// Uses the largest angle of Autoware's sample vehicle.
    fn default() -> Self {
        Self {
            is_configured: false,
            wheel_base_m: None,
            wheel_tread_m: None,
            wheel_radius_m: None,
            speed_scale: 1.0,
            wheel_to_tire: None,
            ratio_origin: RatioOrigin::Configured,
            steering_offset_rad: 0.0,
            max_tire_rad: 0.70,
        }
    }
}

/// Where the steering ratio comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum RatioOrigin {
    /// It is written in the configuration, which does not say how it was found.
    #[default]
    Configured,
    /// It is written in the configuration, which says that it was measured on this car.
    Measured,
    /// It is the ratio that opendbc lists for a car, and not measured on this one.
    Listed {
        /// Make, model and years of the car.
        car: String,
    },
}

impl RatioOrigin {
    /// Returns its name in diagnostics.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Configured => "configured",
            Self::Measured => "measured",
            Self::Listed { .. } => "listed",
        }
    }
}

/// A dimension missing from the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // as the fields of `VehicleGeometry` describe them
pub enum GeometryKey {
    WheelBase,
    WheelTread,
    WheelRadius,
    SteeringRatio,
}

impl GeometryKey {
    /// Returns the key of `[vehicle_geometry]`.
    pub fn key(self) -> &'static str {
        match self {
            Self::WheelBase => "wheel_base_m",
            Self::WheelTread => "wheel_tread_m",
            Self::WheelRadius => "wheel_radius_m",
            Self::SteeringRatio => "steering_ratio",
        }
    }
}

impl WheelToTire {
    /// Returns the ratio if it is the same at every speed and angle.
    pub fn constant_ratio(&self) -> Option<f64> {
        match self {
            Self::Ratio(ratio) => Some(*ratio),
            Self::Table(_) | Self::Variable { .. } => None,
        }
    }
}

/// Conversion from the angle of the steering wheel to the angle of the front wheels.
#[derive(Debug, Clone, PartialEq)]
pub enum WheelToTire {
    /// Angle of the steering wheel divided by the angle of the front wheels.
    Ratio(f64),
    /// At least two pairs of angles, rad, steering wheel first and ascending; interpolated linearly.
    Table(Vec<(f64, f64)>),
    /// Autoware's form with three coefficients: `ratio = constant + per_speed_squared · v² − per_angle ·
    /// |wheel|`.
    Variable {
        /// Ratio at standstill and straight ahead.
        constant: f64,
        /// Increase with the square of the speed, s²/m².
        per_speed_squared: f64,
        /// Decrease with the angle of the steering wheel, 1/rad.
        per_angle: f64,
    },
}
