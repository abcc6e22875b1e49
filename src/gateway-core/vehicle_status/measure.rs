//! Reports and their measured values for display: names, units and texts.

use serde::Serialize;

use gateway_base::names::named_by_variant;

/// A report on the vehicle's status, named like its diagnostic task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum StatusReport {
    /// Speed and heading rate.
    Velocity,
    /// Angle of the front wheels.
    Steering,
    Gear,
    ControlMode,
    Doors,
}

named_by_variant!(StatusReport);

/// A measured value of a report, in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// Speed at the middle of the rear axle, m/s, forward positive.
    Speed,
    /// Heading rate, rad/s, counter-clockwise positive.
    HeadingRate,
    /// Angle of the front wheels, rad, left positive.
    TireAngle,
}

/// Presentation of a measured value.
#[derive(Debug, Clone, Copy)]
pub struct MeasureRow {
    /// Name for display.
    pub name: &'static str,
    /// Unit for display, including a leading space if it has one.
    pub unit: &'static str,
    /// Factor from the SI unit to the display unit.
    pub factor: f64,
    /// Number of decimals for display.
    pub decimals: usize,
    /// Name of the metric, without its unit.
    pub metric: &'static str,
    /// SI unit in the name of the metric.
    pub metric_unit: &'static str,
    /// Description of the metric.
    pub metric_help: &'static str,
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Rows in the order of [`Measure`].
const ROWS: [MeasureRow; 3] = [
    MeasureRow {
        name: "speed",
        unit: " m/s",
        factor: 1.0,
        decimals: 2,
        metric: "velocity_longitudinal",
        metric_unit: "meters_per_second",
        metric_help: "Published speed, forward positive",
    },
    MeasureRow {
        name: "heading rate",
        unit: "°/s",
        factor: DEGREES,
        decimals: 2,
        metric: "velocity_heading_rate",
        metric_unit: "radians_per_second",
        metric_help: "Published heading rate, counter-clockwise positive",
    },
    MeasureRow {
        name: "front wheels",
        unit: "°",
        factor: DEGREES,
        decimals: 2,
        metric: "steering_tire_angle",
        metric_unit: "radians",
        metric_help: "Published angle of the front wheels, left positive",
    },
];

impl Measure {
    /// Returns the presentation of the measure.
    pub const fn row(self) -> &'static MeasureRow {
        let [speed, heading_rate, tire_angle] = &ROWS;
        match self {
            Self::Speed => speed,
            Self::HeadingRate => heading_rate,
            Self::TireAngle => tire_angle,
        }
    }

    /// Returns the report that contains the measure.
    pub const fn report(self) -> StatusReport {
        match self {
            Self::Speed | Self::HeadingRate => StatusReport::Velocity,
            Self::TireAngle => StatusReport::Steering,
        }
    }

    /// Returns the value in the display unit.
    pub fn shown(self, value: f64) -> f64 {
        value * self.row().factor
    }

    /// Returns the value with its unit, such as `12.50 m/s`.
    pub fn text(self, value: f64) -> String {
        let MeasureRow { unit, decimals, .. } = self.row();
        let text = format!("{:.decimals$}", self.shown(value));
        // A small negative value rounds to zero, which has no sign.
        let is_zero = text.chars().all(|digit| matches!(digit, '-' | '0' | '.'));
        format!("{}{unit}", if is_zero { text.trim_start_matches('-') } else { &text })
    }

    /// Returns the texts of several values, one after another.
    pub fn texts(values: &[(Self, f64)]) -> String {
        values.iter().map(|(measure, value)| measure.text(*value)).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_their_unit_and_zero_has_no_sign() {
        assert_eq!(Measure::Speed.text(-2.0), "-2.00 m/s");
        assert_eq!(Measure::Speed.text(-0.001), "0.00 m/s");
        assert_eq!(Measure::TireAngle.text(std::f64::consts::FRAC_PI_6), "30.00°");
        assert_eq!(
            Measure::texts(&[(Measure::Speed, 1.0), (Measure::HeadingRate, 0.1)]),
            "1.00 m/s, 5.73°/s"
        );
    }
}
