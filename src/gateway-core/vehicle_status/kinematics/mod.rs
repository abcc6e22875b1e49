//! Checks signs, steering ratio and other dimensions of a car from a drive with turns, without ground truth:
//! yaw rate, steering and rear wheels all give the heading rate.
//!
//! `yaw rate = speed · tan(tire angle) / (wheel base · (1 + understeer · speed²)) = difference of the rear
//! wheels / tread`. Zero points and unequal tyres are part of each fit. The understeer is unknown, so the
//! interval of a ratio covers all usual values (docs/spec/vehicle-interface.md, "Kinematic self-check").

pub mod finding;
mod line;
pub mod survey;

use super::settings::{VehicleGeometry, WheelToTire};
use super::steering::{AngleOf, tire_angle};
use line::{Line, Row, mean};
use survey::{CELL, KinematicSurvey, Point};

/// Minimum number of turns from which a recording shows signs and dimensions.
pub const MIN_TURNS: usize = 3;
/// Ratio and wheel base assumed if neither is configured; only their product is then found.
const NOMINAL_RATIO: f64 = 16.0;
const NOMINAL_WHEEL_BASE_M: f64 = 2.7;
/// Distance between the rear wheels assumed for counting turns if none is configured.
const NOMINAL_TREAD_M: f64 = 1.55;
/// Largest understeer, s²/m²: a car with a characteristic speed of 80 km/h.
const MAX_UNDERSTEER: f64 = 0.002;
/// Speeds up to which turns are used, m/s; slow turns suffice if there are any, since understeer then matters
/// less.
const SPEED_LIMITS: [f64; 3] = [8.0, 15.0, FASTEST_MPS];
const FASTEST_MPS: f64 = 25.0;
/// Uncertainty of a tread due to unequal tyres, as a share.
const UNEQUAL_TYRES: f64 = 0.01;
/// Speed above which sources of the speed are compared, m/s.
const FAST_MPS: f64 = 3.0;
/// Number of iterations to solve for a ratio; each divides the error by the square of a small angle.
const STEPS: usize = 6;
/// Points per mean of the ratio of two speeds.
const MEAN_OF: usize = 10;
/// One in this many means lies beyond each end of the interval.
const TAIL: usize = 20;

/// Interval that contains a value, and the number of turns it is based on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Number of turns; 0 for an estimate that needs none.
    pub turns: usize,
}

impl Estimate {
    /// Returns the middle of the interval.
    pub fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    /// Returns the interval of the value multiplied by a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { low: self.low * factor, high: self.high * factor, ..self }
    }
}

/// A source of the heading rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum Rate {
    YawRate,
    /// From speed and steering.
    Steering,
    /// Difference between the rear wheels.
    Wheels,
}

/// Two heading rates that are compared.
pub type PairOfRates = (Rate, Rate);

/// How the signs of two heading rates relate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// Both turn to the same side.
    Equal,
    /// They turn to opposite sides.
    Opposite,
}

/// Results of evaluating a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Number of turns that the best comparison is based on.
    pub turns: usize,
    /// True if the recording has two heading rates that can be compared.
    pub has_rates: bool,
    /// Relation of each pair of heading rates; `None` while the recording does not show it.
    pub relations: [(PairOfRates, Option<Relation>); 3],
    /// Steering ratio, and the heading rate from which it was found.
    pub ratio: Option<(RatioEstimate, Rate)>,
    /// Distance between the rear wheels, m.
    pub tread_m: Option<Estimate>,
    /// Speed of the front wheels divided by the speed of the rear wheels.
    pub front_by_rear: Option<Estimate>,
    /// Second source of the speed divided by the first.
    pub second_by_first: Option<Estimate>,
}

/// Relation of the front wheels to the steering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RatioEstimate {
    /// Angle of the steering wheel divided by the angle of the front wheels.
    Ratio(Estimate),
    /// Ratio multiplied by the wheel base, m, which is not configured.
    RatioByWheelBase(Estimate),
    /// Factor for the angle of the front wheels from the signal, table or formula.
    TireScale(Estimate),
}

impl Kinematics {
    /// Evaluates a recording. `angle_of` says which angle the steering signal measures.
    pub fn of(mut survey: KinematicSurvey, geometry: &VehicleGeometry, angle_of: Option<AngleOf>) -> Self {
        survey.finish();
        let car = Car { points: &survey.points, geometry, angle_of };
        let rate = |rate: Rate| {
            move |point: &Point| match rate {
                Rate::YawRate => point.mean.yaw_rate_radps,
                Rate::Steering => car.steering_rate(point, 1.0, 0.0),
                Rate::Wheels => wheels_difference(point),
            }
        };
        let pairs =
            [(Rate::YawRate, Rate::Steering), (Rate::YawRate, Rate::Wheels), (Rate::Steering, Rate::Wheels)];
        let comparisons = pairs.map(|pair| {
            // The steering has the least noise, the wheels the most.
            let (x, y) = if pair.1 == Rate::Steering { (pair.1, pair.0) } else { pair };
            let tread_m = geometry.wheel_tread_m.unwrap_or(NOMINAL_TREAD_M);
            let per_y = if y == Rate::Wheels { 1.0 / tread_m } else { 1.0 };
            let rates = |point: &Point| Some((rate(x)(point)?, rate(y)(point)?));
            let all = car.line(FASTEST_MPS, per_y, &rates);
            let line = SPEED_LIMITS.iter().find_map(|limit| car.turning(*limit, per_y, &rates));
            let turns = all.filter(Line::has_sign).map_or(0, |line| line.turns);
            Comparison { pair, line, turns }
        });
        let [_, of_yaw_rate_and_wheels, _] = &comparisons;
        let has = |of: Rate| survey.points.iter().any(|point| rate(of)(point).is_some());
        let rates = [Rate::YawRate, Rate::Steering, Rate::Wheels];
        let with_yaw_rate = car.ratio(&rate(Rate::YawRate)).map(|ratio| (ratio, Rate::YawRate));
        let with_wheels = || {
            let tread_m = geometry.wheel_tread_m?;
            let ratio = car.ratio(&|point| Some(wheels_difference(point)? / tread_m))?;
            Some((ratio, Rate::Wheels))
        };
        let tread_m = of_yaw_rate_and_wheels.line.filter(Line::has_sign).map(|line| Estimate {
            low: line.slope.abs() * (1.0 - UNEQUAL_TYRES) - line.half,
            high: line.slope.abs() * (1.0 + UNEQUAL_TYRES) + line.half,
            turns: line.turns,
        });
        Self {
            turns: comparisons.iter().map(|comparison| comparison.turns).max().unwrap_or_default(),
            has_rates: rates.into_iter().filter(|rate| has(*rate)).count() > 1,
            relations: comparisons.map(|Comparison { pair, line, .. }| (pair, line.and_then(relation))),
            ratio: with_yaw_rate.or_else(with_wheels),
            tread_m,
            front_by_rear: car.scale(|point| {
                let [front_left, front_right, rear_left, rear_right] = point.mean.wheels_mps;
                Some((front_left? + front_right?) / (rear_left? + rear_right?))
            }),
            second_by_first: car
                .scale(|point| Some(point.mean.other_speed_mps? / point.mean.speed_mps.abs())),
        }
    }
}

/// Comparison of two heading rates.
#[derive(Clone, Copy)]
struct Comparison {
    pair: PairOfRates,
    /// Fit of the slowest points with enough turns.
    line: Option<Line>,
    /// Number of turns of all points; 0 if the two rates are unrelated.
    turns: usize,
}

fn relation(line: Line) -> Option<Relation> {
    let relation = if line.slope < 0.0 { Relation::Opposite } else { Relation::Equal };
    line.has_sign().then_some(relation)
}

/// Returns the speed difference between right and left rear wheel, m/s.
fn wheels_difference(point: &Point) -> Option<f64> {
    let [_, _, left, right] = point.mean.wheels_mps;
    Some(right? - left?)
}

/// Returns two quantities of a point, the quantity with less noise first.
type Pair<'a> = &'a dyn Fn(&Point) -> Option<(f64, f64)>;

/// A recording with the configuration of its car.
#[derive(Clone, Copy)]
struct Car<'a> {
    points: &'a [Point],
    geometry: &'a VehicleGeometry,
    angle_of: Option<AngleOf>,
}

impl Car<'_> {
    /// Returns the angle of the front wheels, with the nominal ratio if none is configured.
    fn tire_rad(&self, steering_rad: f64, speed_mps: f64) -> Option<f64> {
        match (self.angle_of?, &self.geometry.wheel_to_tire) {
            (AngleOf::Tire, _) => Some(steering_rad),
            (AngleOf::SteeringWheel, None) => Some(steering_rad / NOMINAL_RATIO),
            (AngleOf::SteeringWheel, Some(_)) => {
                tire_angle(self.geometry, steering_rad, Some(speed_mps.abs())).ok()?
            }
        }
    }

    /// Returns the heading rate from speed and steering, with a factor for the angle of the front wheels.
    fn steering_rate(&self, point: &Point, factor: f64, understeer: f64) -> Option<f64> {
        let speed_mps = point.mean.speed_mps;
        let tire = self.tire_rad(point.mean.steering_rad?, speed_mps)?;
        let wheel_base_m = self.geometry.wheel_base_m.unwrap_or(NOMINAL_WHEEL_BASE_M);
        let radius = wheel_base_m * (understeer * speed_mps).mul_add(speed_mps, 1.0);
        Some(speed_mps * (factor * tire).tan() / radius)
    }

    /// Fits the points up to a speed limit; returns `None` without enough turns.
    fn turning(&self, limit_mps: f64, per_y: f64, pair: Pair<'_>) -> Option<Line> {
        self.line(limit_mps, per_y, pair).filter(|line| line.turns >= MIN_TURNS && line.half.is_finite())
    }

    /// Fits the points up to a speed limit; `per_y` is the heading rate, rad/s, per unit of the second
    /// quantity.
    fn line(&self, limit_mps: f64, per_y: f64, pair: Pair<'_>) -> Option<Line> {
        let slow = self.points.iter().filter(|point| point.mean.speed_mps.abs() <= limit_mps);
        let row = |point: &Point| {
            let (x, y) = pair(point)?;
            Some(Row { cell: point.cell, speed: point.mean.speed_mps, x, y })
        };
        let rows: Vec<_> = slow.filter_map(row).collect();
        Line::fit(&rows, per_y, CELL.as_secs_f64())
    }

    /// Returns the ratio at which the steering gives this heading rate.
    fn ratio(&self, heading_rate: &dyn Fn(&Point) -> Option<f64>) -> Option<RatioEstimate> {
        let factor = self.factor(heading_rate)?;
        // A larger ratio turns the front wheels less.
        let inverse =
            |of: f64| Estimate { low: of / factor.high, high: of / factor.low, turns: factor.turns };
        let ratio = match (self.angle_of?, &self.geometry.wheel_to_tire) {
            (AngleOf::SteeringWheel, None) => inverse(NOMINAL_RATIO),
            (AngleOf::SteeringWheel, Some(WheelToTire::Ratio(ratio))) => inverse(*ratio),
            (AngleOf::SteeringWheel, Some(WheelToTire::Table(_) | WheelToTire::Variable { .. }))
            | (AngleOf::Tire, _) => {
                return self.geometry.wheel_base_m.map(|_| RatioEstimate::TireScale(factor));
            }
        };
        Some(match self.geometry.wheel_base_m {
            Some(_) => RatioEstimate::Ratio(ratio),
            None => RatioEstimate::RatioByWheelBase(ratio.scaled(NOMINAL_WHEEL_BASE_M)),
        })
    }

    /// Returns the factor for the angle of the front wheels at which the steering gives this heading rate, as
    /// the interval from no understeer to the largest understeer.
    fn factor(&self, heading_rate: &dyn Fn(&Point) -> Option<f64>) -> Option<Estimate> {
        let line = |limit_mps: f64, factor: f64, understeer: f64| {
            let rates =
                |point: &Point| Some((self.steering_rate(point, factor, understeer)?, heading_rate(point)?));
            self.turning(limit_mps, 1.0, &rates)
        };
        let limit = SPEED_LIMITS.into_iter().find(|limit| line(*limit, 1.0, 0.0).is_some())?;
        let solve = |understeer: f64| {
            let (mut factor, mut share, mut turns) = (1.0, 0.0, 0);
            for _ in 0..STEPS {
                let line = line(limit, factor, understeer)?;
                factor *= line.slope.abs();
                (share, turns) = (line.half / line.slope.abs(), line.turns);
            }
            (share < 1.0).then_some((factor, share, turns))
        };
        let ((low, low_share, turns), (high, high_share, _)) = (solve(0.0)?, solve(MAX_UNDERSTEER)?);
        Some(Estimate { low: low * (1.0 - low_share), high: high * (1.0 + high_share), turns })
    }

    /// Returns the interval of the ratio of two speeds: the interval of its means, without the tails.
    fn scale(&self, ratio: impl Fn(&Point) -> Option<f64>) -> Option<Estimate> {
        let fast = self.points.iter().filter(|point| point.mean.speed_mps.abs() > FAST_MPS);
        let ratios: Vec<_> = fast.filter_map(ratio).filter(|ratio| ratio.is_finite()).collect();
        let mut means: Vec<_> =
            ratios.chunks_exact(MEAN_OF).filter_map(|chunk| mean(chunk.iter().copied())).collect();
        means.sort_by(f64::total_cmp);
        let tail = means.len() / TAIL;
        let (low, high) = (*means.get(tail)?, *means.get(means.len().checked_sub(1 + tail)?)?);
        Some(Estimate { low, high, turns: 0 })
    }
}
