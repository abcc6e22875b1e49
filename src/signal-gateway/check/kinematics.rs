//! Reports the signs and dimensions found in a recording, and contradictions to the configuration.

use super::kind::CheckKind;
use super::report::CheckReport;
use crate::config::Settings;
use crate::report::text::counted;
use gateway_core::vehicle_status::kinematics::finding::{KinematicFinding, findings};
use gateway_core::vehicle_status::kinematics::survey::KinematicSurvey;
use gateway_core::vehicle_status::kinematics::{
    Estimate, Kinematics, MIN_TURNS, Rate, RatioEstimate, Relation,
};
use gateway_core::vehicle_status::settings::{GeometryKey, RatioOrigin, VehicleGeometry};
use vehicle_bringup::plausibility::finding::Severity;

/// Heading of the facts.
const MOTION: &str = "motion";
/// Wheel bases of a small and a large car, metres; examples for the steering ratio while no wheel base is
/// configured.
const EXAMPLES_M: [f64; 2] = [2.6, 2.9];

/// Lists signs, steering ratio, tread and scales of the speeds, and reports values that differ from the
/// configuration. Returns the steering ratio that the recording shows.
pub(super) fn motion(
    survey: KinematicSurvey,
    settings: &Settings,
    report: &mut CheckReport,
) -> Option<RatioEstimate> {
    let (status, geometry) = (&settings.gateway.status, &settings.gateway.status_settings.geometry);
    let angle_of = status.steering.first().map(|source| source.angle_of);
    let kinematics = Kinematics::of(survey, geometry, angle_of);
    if kinematics.has_rates && kinematics.turns < MIN_TURNS {
        let turns = counted(kinematics.turns as u64, "turn");
        let text = format!(
            "the recording does not turn enough to check signs, steering ratio and tread: {turns}, at least {MIN_TURNS} are \
             needed"
        );
        report.line(MOTION, text);
    }
    for ((one, other), relation) in kinematics.relations {
        let how = match relation {
            Some(Relation::Equal) => "turn to the same side",
            Some(Relation::Opposite) => "turn to opposite sides",
            None => continue,
        };
        report.line(MOTION, format!("{} and {} {how}", name(one), name(other)));
    }
    if let Some((ratio, rate)) = kinematics.ratio {
        report.line(MOTION, ratio_text(ratio, rate));
    }
    if let Some(tread) = kinematics.tread_m {
        let turns = counted(tread.turns as u64, "turn");
        let text =
            format!("wheel_tread_m {} m by the rear wheels and the yaw rate in {turns}", interval(tread, 2));
        report.line(MOTION, text);
    }
    let scales = [
        ("the front wheels read", "times the rear wheels", kinematics.front_by_rear),
        ("the second source of the speed reads", "times the first", kinematics.second_by_first),
    ];
    for (subject, of, scale) in scales {
        if let Some(scale) = scale {
            report.line(MOTION, format!("{subject} {} {of}", interval(scale, 3)));
        }
    }
    for finding in findings(&kinematics, geometry) {
        report.find(Severity::Warning, CheckKind::MotionContradiction, finding_text(&finding, geometry));
    }
    let suggestion = suggestion(&kinematics, geometry);
    if !suggestion.is_empty() {
        let text = format!("[vehicle_geometry]: the recording shows {}", suggestion.join("; and "));
        report.find(Severity::Note, CheckKind::DimensionShown, text);
    }
    kinematics.ratio.map(|(ratio, _)| ratio)
}

/// Describes the dimensions that the recording shows and the configuration lacks, a steering ratio as the
/// lines to write.
fn suggestion(kinematics: &Kinematics, geometry: &VehicleGeometry) -> Vec<String> {
    let ratio = match kinematics.ratio {
        Some((RatioEstimate::Ratio(ratio), _)) if is_ratio_wanted(geometry) => Some(format!(
            "{key} = {:.1} and measured = \"{}, {}\"",
            ratio.middle(),
            counted(ratio.turns as u64, "turn"),
            interval(ratio, 1),
            key = GeometryKey::SteeringRatio.key(),
        )),
        Some((RatioEstimate::RatioByWheelBase(product), _)) => {
            let [low, high] = EXAMPLES_M.map(|wheel_base_m| {
                let ratio = interval(product.scaled(1.0 / wheel_base_m), 1);
                format!("{ratio} for a wheel base of {wheel_base_m} m")
            });
            Some(format!("{} {low}, {high}", GeometryKey::SteeringRatio.key()))
        }
        Some(_) | None => None,
    };
    let tread = kinematics.tread_m.filter(|_| geometry.wheel_tread_m.is_none());
    let tread = tread.map(|tread| format!("{} {}", GeometryKey::WheelTread.key(), interval(tread, 2)));
    ratio.into_iter().chain(tread).collect()
}

/// Returns true if the configuration has no steering ratio of this car.
fn is_ratio_wanted(geometry: &VehicleGeometry) -> bool {
    match geometry.ratio_origin {
        RatioOrigin::Listed { .. } => true,
        RatioOrigin::Configured | RatioOrigin::Measured => geometry.wheel_to_tire.is_none(),
    }
}

fn ratio_text(ratio: RatioEstimate, rate: Rate) -> String {
    let (what, estimate) = match ratio {
        RatioEstimate::Ratio(ratio) => (format!("steering_ratio {}", interval(ratio, 1)), ratio),
        RatioEstimate::RatioByWheelBase(product) => {
            (format!("steering_ratio times wheel_base_m {} m", interval(product, 1)), product)
        }
        RatioEstimate::TireScale(scale) => {
            (format!("the front wheels turn {} times as far as configured", interval(scale, 2)), scale)
        }
    };
    format!("{what} by the {} in {}", name(rate), counted(estimate.turns as u64, "turn"))
}

fn finding_text(finding: &KinematicFinding, geometry: &VehicleGeometry) -> String {
    match finding {
        KinematicFinding::WrongSign(suspects) => match suspects.as_slice() {
            [Rate::YawRate] => "the yaw rate has the wrong sign: check `positive` of yaw_rate".to_owned(),
            [Rate::Steering] => "the steering has the wrong sign: check `positive` of [steering]".to_owned(),
            [Rate::Wheels] => "the left and the right rear wheel are exchanged".to_owned(),
            suspects => {
                let names: Vec<_> = suspects.iter().map(|suspect| name(*suspect)).collect();
                format!(
                    "{} turn to opposite sides: one of them has the wrong sign, or left and right are exchanged",
                    names.join(" and ")
                )
            }
        },
        KinematicFinding::Dimension { key, estimate, configured } => {
            let says = match (&geometry.ratio_origin, key) {
                (RatioOrigin::Listed { car }, GeometryKey::SteeringRatio) => {
                    format!("opendbc's list says {configured} for {car}")
                }
                _ => format!("the file says {configured}"),
            };
            let range = interval(*estimate, decimals(*key));
            format!("{} of [vehicle_geometry] looks like {range}, {says}", key.key())
        }
        KinematicFinding::TireScale(scale) => format!(
            "the front wheels turn {} times as far as signal and [vehicle_geometry] say: check the unit of the signal, \
             steering_table or the vgr_coef keys, and wheel_base_m",
            interval(*scale, 2)
        ),
        KinematicFinding::FrontByRear(scale) => format!(
            "the front wheels read {} times the rear wheels: check the units, and that front and rear are not mixed up",
            interval(*scale, 2)
        ),
        KinematicFinding::SecondByFirst(scale) => format!(
            "the second source of the speed reads {} times the first: check unit and scale of both",
            interval(*scale, 2)
        ),
    }
}

fn decimals(key: GeometryKey) -> usize {
    match key {
        GeometryKey::SteeringRatio => 1,
        GeometryKey::WheelBase | GeometryKey::WheelTread | GeometryKey::WheelRadius => 2,
    }
}

fn name(rate: Rate) -> &'static str {
    match rate {
        Rate::YawRate => "yaw rate",
        Rate::Steering => "steering",
        Rate::Wheels => "rear wheels",
    }
}

/// Returns an interval such as `15.2 to 17.1`.
fn interval(estimate: Estimate, decimals: usize) -> String {
    format!("{:.decimals$} to {:.decimals$}", estimate.low, estimate.high)
}
