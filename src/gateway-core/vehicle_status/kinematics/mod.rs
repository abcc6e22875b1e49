//! What a drive that turns shows of the signs, the steering ratio and the other dimensions of a car, without
//! any truth beside it: yaw rate, steering and rear wheels all give the heading rate.
//!
//! `yaw rate = speed · tan(tire angle) / (wheel base · (1 + understeer · speed²)) = difference of the rear
//! wheels / tread`. Zero points and unequal tyres are part of each fit. The understeer is unknown, so the
//! interval of a ratio holds all usual ones (docs/spec/vehicle-interface.md, "Kinematic self-check").

pub mod finding;
mod line;
pub mod survey;

use super::settings::{VehicleGeometry, WheelToTire};
use super::steering::{AngleOf, tire_angle};
use line::{Line, Row, mean};
use survey::{CELL, KinematicSurvey, Point};

/// Turns from which a recording shows signs and dimensions.
pub const MIN_TURNS: usize = 3;
/// Ratio and wheel base that are assumed while none is configured; only their product is found then.
const NOMINAL_RATIO: f64 = 16.0;
const NOMINAL_WHEEL_BASE_M: f64 = 2.7;
/// Distance of the rear wheels that is assumed to count turns while none is configured.
const NOMINAL_TREAD_M: f64 = 1.55;
/// Greatest understeer, s²/m²: that of a car whose characteristic speed is 80 km/h.
const MAX_UNDERSTEER: f64 = 0.002;
/// Speeds up to which turns are used, m/s; the slow ones are enough if there are some, since understeer
/// matters less.
const SPEED_LIMITS: [f64; 3] = [8.0, 15.0, FASTEST_MPS];
const FASTEST_MPS: f64 = 25.0;
/// Share by which unequal tyres make a tread uncertain.
const UNEQUAL_TYRES: f64 = 0.01;
/// Speed from which sources of the speed are compared, m/s.
const FAST_MPS: f64 = 3.0;
/// Steps to solve for a ratio; each divides the error by the square of a small angle.
const STEPS: usize = 6;
/// Points of a mean of the ratio of two speeds.
const MEAN_OF: usize = 10;
/// Part of these means beyond each end of the interval.
const TAIL: usize = 20;

/// An interval that holds a value, and the turns it rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Number of turns; 0 for what needs none.
    pub turns: usize,
}

impl Estimate {
    /// Middle of the interval.
    pub fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    /// The interval of the value times a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { low: self.low * factor, high: self.high * factor, ..self }
    }
}

/// Something that gives the heading rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rate {
    /// The yaw rate sensor.
    YawRate,
    /// Speed and steering.
    Steering,
    /// The difference of the rear wheels.
    Wheels,
}

/// Two that are compared.
pub type PairOfRates = (Rate, Rate);

/// How the signs of two heading rates relate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// Both turn to the same side.
    Equal,
    /// They turn to opposite sides.
    Opposite,
}

/// What a recording shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Turns that the best comparison rests on.
    pub turns: usize,
    /// True if the recording has two heading rates that can be compared.
    pub has_rates: bool,
    /// The pairs of heading rates; `None` while the recording does not show it.
    pub relations: [(PairOfRates, Option<Relation>); 3],
    /// Steering ratio, and the heading rate that it was found with.
    pub ratio: Option<(RatioEstimate, Rate)>,
    /// Distance of the rear wheels, m.
    pub tread_m: Option<Estimate>,
    /// Speed of the front wheels for that of the rear wheels.
    pub front_by_rear: Option<Estimate>,
    /// The second source of the speed for the first.
    pub second_by_first: Option<Estimate>,
}

/// How the front wheels follow the steering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RatioEstimate {
    /// Angle of the steering wheel for each angle of the front wheels.
    Ratio(Estimate),
    /// The same times the wheel base, m, which is not configured.
    RatioByWheelBase(Estimate),
    /// Factor for the angle of the front wheels that signal, table or formula gives.
    TireScale(Estimate),
}

impl Kinematics {
    /// Evaluates a recording. `angle_of` is what the steering signal measures.
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
            // The steering has the least noise, the wheels have the most.
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

/// Two heading rates, one against the other.
#[derive(Clone, Copy)]
struct Comparison {
    pair: PairOfRates,
    /// Of the slowest points that turn enough.
    line: Option<Line>,
    /// Turns of all points; 0 if the two are unrelated.
    turns: usize,
}

fn relation(line: Line) -> Option<Relation> {
    let relation = if line.slope < 0.0 { Relation::Opposite } else { Relation::Equal };
    line.has_sign().then_some(relation)
}

/// The right rear wheel's speed without the left one's, m/s.
fn wheels_difference(point: &Point) -> Option<f64> {
    let [_, _, left, right] = point.mean.wheels_mps;
    Some(right? - left?)
}

/// Two quantities of a point, the one with less noise first.
type Pair<'a> = &'a dyn Fn(&Point) -> Option<(f64, f64)>;

/// A recording with what is configured of its car.
#[derive(Clone, Copy)]
struct Car<'a> {
    points: &'a [Point],
    geometry: &'a VehicleGeometry,
    angle_of: Option<AngleOf>,
}

impl Car<'_> {
    /// The angle of the front wheels, with the nominal ratio if none is configured.
    fn tire_rad(&self, steering_rad: f64, speed_mps: f64) -> Option<f64> {
        match (self.angle_of?, &self.geometry.wheel_to_tire) {
            (AngleOf::Tire, _) => Some(steering_rad),
            (AngleOf::SteeringWheel, None) => Some(steering_rad / NOMINAL_RATIO),
            (AngleOf::SteeringWheel, Some(_)) => {
                tire_angle(self.geometry, steering_rad, Some(speed_mps.abs())).ok()
            }
        }
    }

    /// The heading rate by speed and steering, with a factor for the angle of the front wheels.
    fn steering_rate(&self, point: &Point, factor: f64, understeer: f64) -> Option<f64> {
        let speed_mps = point.mean.speed_mps;
        let tire = self.tire_rad(point.mean.steering_rad?, speed_mps)?;
        let wheel_base_m = self.geometry.wheel_base_m.unwrap_or(NOMINAL_WHEEL_BASE_M);
        let radius = wheel_base_m * (understeer * speed_mps).mul_add(speed_mps, 1.0);
        Some(speed_mps * (factor * tire).tan() / radius)
    }

    /// Fits the points up to a speed, which need enough turns.
    fn turning(&self, limit_mps: f64, per_y: f64, pair: Pair<'_>) -> Option<Line> {
        self.line(limit_mps, per_y, pair).filter(|line| line.turns >= MIN_TURNS && line.half.is_finite())
    }

    /// Fits the points up to a speed; `per_y` is the heading rate, rad/s, for each unit of the second
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

    /// The ratio at which the steering gives a heading rate.
    fn ratio(&self, heading_rate: &dyn Fn(&Point) -> Option<f64>) -> Option<RatioEstimate> {
        let factor = self.factor(heading_rate)?;
        // A greater ratio turns the front wheels less.
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

    /// The factor for the angle of the front wheels at which the steering gives a heading rate: from that
    /// without understeer to that with the greatest.
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

    /// The interval of the ratio of two speeds: of its means, without the tails.
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
