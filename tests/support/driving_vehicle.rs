//! A simulated vehicle that drives, as the measure of the reports on its status.
//!
//! A report must be a value that the vehicle had since the oldest of the frames behind it was sent: within
//! half a cycle of the middle of that time, give or take the resolution of the signals.

use std::collections::BTreeMap;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::BusIndex;
use can_signal::validation::table::SignalIndex;
use gateway_base::time::MonoTime;
use gateway_core::vehicle_status::quantity::Quantity;
use gateway_core::vehicle_status::settings::{VehicleGeometry, WheelToTire};
use gateway_core::vehicle_status::steering::{AngleOf, SteeringSource};
use gateway_core::vehicle_status::velocity::binding::{HeadingRateSource, SpeedSignal, VelocityBinding};
use signal_gateway::config::Settings;
use vehicle_bringup::simulated_vehicle::motion::MotionState;
use vehicle_bringup::simulated_vehicle::{
    SimulatedVehicle, SimulationSettings, VehicleEvent, VehicleOutput, request,
};

/// Starts, turns left and right, brakes hard, reverses, turns again, parks; then doors and modes.
const DRIVE: &str = "
    3 gear drive\n3.1 speed 8\n8 steer 12\n11 steer -12\n14 steer 0\n15.5 brake
    18 gear reverse\n18.1 speed 3\n20 steer 20\n21.7 steer -5\n22.9 steer 0\n23.3 speed 0\n25 gear neutral\n25.5 gear park
    26 mode manual\n26.5 door open\n27 mode disengaged\n28 door closed\n28.5 mode autonomous";
pub(crate) const END: MonoTime = MonoTime::from_millis(30_000);

pub(crate) const RATIO: f64 = 16.0;
/// The least ratio of the forms in the tests, less what age and resolution of the speed add to a form that
/// depends on it.
const MIN_RATIO: f64 = 13.0;

pub(crate) fn geometry() -> VehicleGeometry {
    VehicleGeometry {
        is_configured: true,
        wheel_base_m: Some(2.7),
        wheel_tread_m: Some(1.6),
        wheel_radius_m: Some(0.33),
        wheel_to_tire: Some(WheelToTire::Ratio(RATIO)),
        ..VehicleGeometry::default()
    }
}

/// A vehicle that drives, and what became of it.
pub(crate) struct DrivingVehicle {
    pub(crate) settings: Settings,
    vehicle: SimulatedVehicle,
    /// The motion at each moment at which something happened.
    pub(crate) motion: Vec<(MonoTime, MotionState)>,
    /// When the frames of each message were sent.
    sent: BTreeMap<(BusIndex, CanId), Vec<MonoTime>>,
    pub(crate) not_possible: Vec<&'static str>,
    /// True if frames can come so late that the gateway uses any source of the heading rate, and not the
    /// first one only.
    may_fall_back: bool,
}

/// The parts of a motion that are compared.
pub(crate) type Part = fn(&MotionState) -> f64;

impl DrivingVehicle {
    pub(crate) fn new(settings: Settings, may_fall_back: bool) -> Self {
        let plan = settings.vehicle_plan().unwrap();
        let mut vehicle = SimulatedVehicle::new(plan, SimulationSettings::default(), MonoTime::ZERO);
        for (since, request) in DRIVE.lines().filter_map(|line| request::line(line).unwrap()) {
            vehicle.schedule(MonoTime::ZERO.after(since.unwrap()), request);
        }
        let (motion, sent, not_possible) = (Vec::new(), BTreeMap::new(), Vec::new());
        Self { settings, vehicle, motion, sent, not_possible, may_fall_back }
    }

    /// The frames that are due.
    pub(crate) fn frames(&mut self, now: MonoTime) -> Vec<(BusIndex, Frame)> {
        self.vehicle.settle(now);
        self.motion.push((now, self.vehicle.motion(now)));
        let mut frames = Vec::new();
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Frame { bus, frame } => {
                    self.sent.entry((bus, frame.id())).or_default().push(now);
                    frames.push((bus, frame));
                }
                VehicleOutput::Happened(VehicleEvent::NotPossible(why)) => self.not_possible.push(why),
                VehicleOutput::Happened(_) | VehicleOutput::Error { .. } => {}
            }
        }
        frames
    }

    pub(crate) fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        self.vehicle.next_deadline(now)
    }

    /// When the oldest of the last frames with these signals was sent.
    fn oldest(&self, signals: impl Iterator<Item = SignalIndex>, now: MonoTime) -> MonoTime {
        let table = &self.settings.gateway.status.table;
        let last = |signal: SignalIndex| {
            let message = &table.messages[table.signals[signal.0].message.0];
            let sent = &self.sent[&(message.bus, message.ids.described())];
            sent[sent.partition_point(|at| *at <= now) - 1]
        };
        signals.map(last).min().unwrap_or(now)
    }

    /// A part of the motion at a time.
    pub(crate) fn at(&self, time: MonoTime, part: Part) -> f64 {
        let after = self.motion.partition_point(|(at, _)| *at < time);
        let (to, end) = &self.motion[after];
        if after == 0 || *to == time {
            return part(end);
        }
        let (from, begin) = &self.motion[after - 1];
        let share = time.since(*from).as_secs_f64() / to.since(*from).as_secs_f64();
        part(begin) + (part(end) - part(begin)) * share
    }

    /// The lowest and the highest value of a part of the motion from `begin` to `end`.
    fn range(&self, (begin, end): (MonoTime, MonoTime), part: Part) -> (f64, f64) {
        let after = self.motion.partition_point(|(at, _)| *at < begin);
        let within = self.motion[after..].iter().take_while(|(at, _)| *at <= end);
        let within = within.map(|(_, motion)| part(motion)).chain([self.at(begin, part), self.at(end, part)]);
        lowest_and_highest(within)
    }

    /// Deviations of a velocity, in shares of the resolution: of the speed and of the heading rate. The
    /// frames that were sent until `known` can be behind it.
    pub(crate) fn velocity_deviations(
        &self,
        [speed_mps, rate_radps]: [f64; 2],
        (known, stamp): (MonoTime, MonoTime),
    ) -> [f64; 2] {
        let binding = &self.settings.gateway.status;
        let velocity = binding.velocity.iter().flat_map(VelocityBinding::signals);
        let begin = self.oldest(velocity.chain(self.steering_signals()), known);
        let speeds = self.range((begin, stamp), |motion| motion.speed_mps);
        let tires = self.range((begin, stamp), |motion| motion.tire_rad);
        // Speed and steering behind a heading rate may be of different moments.
        let wheel_base_m = self.settings.gateway.status_settings.geometry.wheel_base_m.unwrap();
        let rate = |speed: f64, tire: f64| speed * tire.tan() / wheel_base_m;
        let rates = [speeds.0, speeds.1].map(|speed| [rate(speed, tires.0), rate(speed, tires.1)]);
        let rates = lowest_and_highest(rates.into_iter().flatten());
        [
            distance(speed_mps, speeds) / self.speed_resolution_mps(),
            distance(rate_radps, rates) / self.heading_rate_resolution_radps(stamp),
        ]
    }

    /// The same for the angle of the front wheels.
    pub(crate) fn tire_deviation(&self, tire_rad: f64, (known, stamp): (MonoTime, MonoTime)) -> f64 {
        let begin = self.oldest(self.steering_signals(), known);
        distance(tire_rad, self.range((begin, stamp), |motion| motion.tire_rad)) / self.tire_resolution_rad()
    }

    fn steering_signals(&self) -> impl Iterator<Item = SignalIndex> {
        let sources = self.settings.gateway.status.steering.iter();
        sources.flat_map(|source| source.angle.signals())
    }

    /// Half a raw step of the coarsest source, and what numbers with a decimal point leave.
    fn speed_resolution_mps(&self) -> f64 {
        let binding = self.settings.gateway.status.velocity.as_ref().unwrap();
        let geometry = &self.settings.gateway.status_settings.geometry;
        let step = |signal: &SpeedSignal| {
            let radius = if signal.is_rotation { geometry.wheel_radius_m.unwrap() } else { 1.0 };
            half_step(&signal.quantity) * radius * geometry.speed_scale
        };
        binding.speed_signals().map(step).fold(1e-9, f64::max)
    }

    fn tire_resolution_rad(&self) -> f64 {
        let sources = self.settings.gateway.status.steering.iter();
        let step = |source: &SteeringSource| {
            half_step(&source.angle) / if source.angle_of == AngleOf::SteeringWheel { MIN_RATIO } else { 1.0 }
        };
        sources.map(step).fold(1e-9, f64::max)
    }

    fn heading_rate_resolution_radps(&self, stamp: MonoTime) -> f64 {
        let geometry = &self.settings.gateway.status_settings.geometry;
        let binding = self.settings.gateway.status.velocity.as_ref().unwrap();
        let speed_mps = self.at(stamp, |motion| motion.speed_mps).abs();
        let tire_rad = self.at(stamp, |motion| motion.tire_rad);
        let resolution = |source: &HeadingRateSource| match source {
            // Its zero, found at standstill, has the same resolution.
            HeadingRateSource::YawRate { rate, .. } => 2.0 * half_step(rate),
            HeadingRateSource::Steering => {
                let of_tire = (speed_mps + 1.0) * self.tire_resolution_rad() / tire_rad.cos().powi(2);
                (of_tire + self.speed_resolution_mps() * (tire_rad.tan().abs() + 0.01))
                    / geometry.wheel_base_m.unwrap()
            }
            HeadingRateSource::Wheels => 2.0 * self.speed_resolution_mps() / geometry.wheel_tread_m.unwrap(),
        };
        let used = if self.may_fall_back { binding.heading_rates.len() } else { 1 };
        binding.heading_rates.iter().take(used).map(resolution).fold(0.0, f64::max)
    }
}

/// Half of what a raw step of a quantity stands for.
fn half_step(quantity: &Quantity) -> f64 {
    let finest = quantity.plus.as_ref().map_or(f64::MAX, |term| term.factor.abs());
    quantity.factor.abs().min(finest) / 2.0
}

fn lowest_and_highest(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
}

/// How far a value is outside of a range.
fn distance(value: f64, (lowest, highest): (f64, f64)) -> f64 {
    (lowest - value).max(value - highest).max(0.0)
}
