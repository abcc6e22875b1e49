//! What the gateway's configuration says of the vehicle and its reports.

use std::time::Duration;

/// Settings of the status.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusSettings {
    /// Shortest time between two reports on speed or steering.
    pub min_period: Duration,
    /// Name of the only source of the gear that is used; `None` = the most trusted one that has a value.
    pub gear_source: Option<String>,
    /// How the front wheels follow the steering wheel.
    pub steering: SteeringGeometry,
}

impl Default for StatusSettings {
    fn default() -> Self {
        Self {
            min_period: Duration::from_millis(20),
            gear_source: None,
            steering: SteeringGeometry::default(),
        }
    }
}

/// How the front wheels follow the steering wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct SteeringGeometry {
    /// From the steering wheel to the front wheels; `None` = not configured.
    pub wheel_to_tire: Option<WheelToTire>,
    /// Angle of the front wheels that is reported when they point straight ahead, rad; it is subtracted.
    pub offset_rad: f64,
    /// Greatest angle of the front wheels, rad.
    pub max_tire_rad: f64,
}

impl Default for SteeringGeometry {
    /// The greatest angle is that of Autoware's sample vehicle.
    fn default() -> Self {
        Self { wheel_to_tire: None, offset_rad: 0.0, max_tire_rad: 0.70 }
    }
}

/// From the angle of the steering wheel to the angle of the front wheels.
#[derive(Debug, Clone, PartialEq)]
pub enum WheelToTire {
    /// Angle of the steering wheel for each angle of the front wheels.
    Ratio(f64),
    /// At least two pairs of angles, rad, steering wheel first and ascending; straight lines between.
    Table(Vec<(f64, f64)>),
    /// Autoware's form with three coefficients: `ratio = constant + per_speed_squared · v² − per_angle · |wheel|`.
    Variable {
        /// Ratio at standstill and straight ahead.
        constant: f64,
        /// Growth with the square of the speed, s²/m².
        per_speed_squared: f64,
        /// Decline with the angle of the steering wheel, 1/rad.
        per_angle: f64,
    },
}
