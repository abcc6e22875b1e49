//! Finds parts of the configuration that a recording contradicts.

use super::{Estimate, Kinematics, PairOfRates, Rate, RatioEstimate, Relation};
use crate::vehicle_status::settings::{GeometryKey, VehicleGeometry, WheelToTire};

/// Deviation, as a share, above which a value outside its interval is wrong. Understeer alone causes 0.15.
const TOLERANCE: f64 = 0.2;

/// A contradiction between a recording and the configuration.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub enum KinematicFinding {
    /// One of these heading rates has the wrong sign.
    WrongSign(Vec<Rate>),
    /// A dimension differs from the configuration.
    Dimension {
        key: GeometryKey,
        /// Value estimated from the recording.
        estimate: Estimate,
        configured: f64,
    },
    /// The angle of the front wheels needs this factor.
    TireScale(Estimate),
    /// The front wheels are faster or slower than the rear wheels by this factor.
    FrontByRear(Estimate),
    /// The second source of the speed differs from the first by this factor.
    SecondByFirst(Estimate),
}

/// Returns all contradictions between the recording and the geometry.
pub fn findings(kinematics: &Kinematics, geometry: &VehicleGeometry) -> Vec<KinematicFinding> {
    let suspects = suspects(&kinematics.relations);
    let sign = (!suspects.is_empty()).then_some(KinematicFinding::WrongSign(suspects));
    let wrong = |estimate: Option<Estimate>, configured: Option<f64>| {
        estimate.zip(configured).filter(|(estimate, configured)| is_wrong(*estimate, *configured))
    };
    let dimension = |key, estimate, configured| {
        let (estimate, configured) = wrong(estimate, configured)?;
        Some(KinematicFinding::Dimension { key, estimate, configured })
    };
    let scale = |estimate, finding: fn(Estimate) -> KinematicFinding| {
        wrong(estimate, Some(1.0)).map(|(estimate, _)| finding(estimate))
    };
    let ratio = match geometry.wheel_to_tire {
        Some(WheelToTire::Ratio(ratio)) => Some(ratio),
        Some(WheelToTire::Table(_) | WheelToTire::Variable { .. }) | None => None,
    };
    let (found_ratio, tire_scale) = match kinematics.ratio {
        Some((RatioEstimate::Ratio(found), _)) => (Some(found), None),
        Some((RatioEstimate::TireScale(scale), _)) => (None, Some(scale)),
        Some((RatioEstimate::RatioByWheelBase(_), _)) | None => (None, None),
    };
    let findings = [
        sign,
        dimension(GeometryKey::SteeringRatio, found_ratio, ratio),
        scale(tire_scale, KinematicFinding::TireScale),
        dimension(GeometryKey::WheelTread, kinematics.tread_m, geometry.wheel_tread_m),
        scale(kinematics.front_by_rear, KinematicFinding::FrontByRear),
        scale(kinematics.second_by_first, KinematicFinding::SecondByFirst),
    ];
    findings.into_iter().flatten().collect()
}

/// Returns true if a value lies outside the interval, and far from its middle.
fn is_wrong(estimate: Estimate, value: f64) -> bool {
    let is_outside = value < estimate.low || value > estimate.high;
    is_outside && (value / estimate.middle() - 1.0).abs() > TOLERANCE
}

/// Returns the heading rates that may have the wrong sign: rates that contradict most others and agree with
/// none.
fn suspects(relations: &[(PairOfRates, Option<Relation>); 3]) -> Vec<Rate> {
    let count = |rate: Rate, relation: Relation| {
        let of_rate = relations.iter().filter(|((one, other), _)| *one == rate || *other == rate);
        of_rate.filter(|(_, found)| *found == Some(relation)).count()
    };
    let rates = [Rate::YawRate, Rate::Steering, Rate::Wheels];
    let counts =
        rates.map(|rate| if count(rate, Relation::Equal) > 0 { 0 } else { count(rate, Relation::Opposite) });
    let most = counts.into_iter().max().unwrap_or_default();
    let suspects = rates.into_iter().zip(counts).filter(|(_, count)| *count > 0 && *count == most);
    suspects.map(|(rate, _)| rate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rates_that_agree_are_right_and_without_a_third_either_may_be_wrong() {
        use Rate::{Steering, Wheels, YawRate};
        use Relation::{Equal, Opposite};
        for (yaw_steering, yaw_wheels, steering_wheels, expected) in [
            (Some(Equal), Some(Equal), Some(Equal), &[][..]),
            (Some(Opposite), Some(Opposite), Some(Equal), &[YawRate]),
            (Some(Opposite), Some(Equal), Some(Opposite), &[Steering]),
            (Some(Equal), Some(Opposite), Some(Opposite), &[Wheels]),
            (Some(Opposite), Some(Equal), None, &[Steering]),
            (Some(Opposite), Some(Opposite), None, &[YawRate]),
            (Some(Opposite), None, None, &[YawRate, Steering]),
            (None, None, Some(Opposite), &[Steering, Wheels]),
            (None, None, None, &[]),
        ] {
            let relations = [
                ((YawRate, Steering), yaw_steering),
                ((YawRate, Wheels), yaw_wheels),
                ((Steering, Wheels), steering_wheels),
            ];
            assert_eq!(suspects(&relations), expected, "{relations:?}");
        }
    }

    #[test]
    fn a_value_is_wrong_outside_the_interval_and_beyond_20_percent() {
        let estimate = Estimate { low: 15.0, high: 17.0, turns: 3 };
        for (value, expected) in [(12.0, true), (13.5, false), (16.0, false), (18.5, false), (20.0, true)] {
            assert_eq!(is_wrong(estimate, value), expected, "{value}");
        }
        assert!(!is_wrong(Estimate { low: 10.0, high: 22.0, turns: 3 }, 21.0));
    }
}
