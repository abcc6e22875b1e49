//! A simulated vehicle drives, its frames reach the gateway, and each report is compared with what the
//! vehicle did.

use can_signal::can::input::CanInput;
use can_signal::can::link::LinkState;
use can_signal::validation::meaning::Meaning;
use gateway_base::diagnostics::Level;
use gateway_base::names::state_word;
use gateway_base::time::MonoTime;
use gateway_core::control_mode::ControlMode;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::control_mode::ControlModeSource;
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::gear::{Gear, GearCode};
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::settings::{VehicleGeometry, WheelToTire};
use gateway_core::vehicle_status::steering::TireAngle;
use gateway_core::vehicle_status::velocity::binding::{HeadingRateSource, SpeedSignals};
use signal_gateway::config::Settings;

use super::car::settings;
use crate::pure::vehicles::{profile_names, read_profile};
use crate::support::clock::{EPOCH_NS, at, millis};
use crate::support::driving_vehicle::{DrivingVehicle, END, Part, geometry};

/// Times in milliseconds with the gear that is engaged then.
const GEARS: [(u64, Gear); 5] = [
    (2_900, Gear::Park),
    (10_000, Gear::Drive),
    (19_000, Gear::Reverse),
    (25_400, Gear::Neutral),
    (29_900, Gear::Park),
];
/// When each report has begun.
const BEGUN: MonoTime = MonoTime::from_millis(2_500);

/// What came of a drive.
struct Driven {
    car: DrivingVehicle,
    gateway: Gateway,
    /// Reports, each with its stamp; when one is withdrawn, with the time.
    reports: Vec<(MonoTime, VehicleStatusOutput)>,
}

fn drive(settings: Settings) -> Driven {
    let gateway = Gateway::new(settings.gateway.clone(), LinkState::Up, at(MonoTime::ZERO));
    let mut driven = Driven { car: DrivingVehicle::new(settings, false), gateway, reports: Vec::new() };
    let mut now = MonoTime::ZERO;
    while now <= END {
        for (bus, frame) in driven.car.frames(now) {
            let stamp = at(now).wall;
            driven.gateway.handle(CanInput::Frame { bus, frame, stamp }, at(now));
            driven.take(now);
        }
        driven.gateway.handle(Input::Tick, at(now));
        driven.take(now);
        let next = driven.car.next_deadline(now).into_iter().chain([driven.gateway.next_deadline()]);
        now = next.min().unwrap();
    }
    driven
}

fn stamp<T: Copy>(step: Step<T>) -> Option<MonoTime> {
    match step {
        Step::Publish(_, stamp) => Some(MonoTime::from_nanos((stamp.as_nanos() - EPOCH_NS).unsigned_abs())),
        Step::Withdraw => None,
    }
}

/// The worst deviations of a drive, in shares of what is allowed, and the number of reports.
#[derive(Debug, Default)]
struct Deviations {
    speed: f64,
    heading_rate: f64,
    tire: f64,
    velocities: usize,
    tires: usize,
}

impl Driven {
    fn take(&mut self, now: MonoTime) {
        while let Some(output) = self.gateway.poll_output() {
            let Output::VehicleStatus(output) = output else { continue };
            let stamp = match output {
                VehicleStatusOutput::Velocity(step) => stamp(step),
                VehicleStatusOutput::Steering(step) => stamp(step),
                VehicleStatusOutput::Gear(step) => stamp(step),
                VehicleStatusOutput::ControlMode(step) => stamp(step),
                VehicleStatusOutput::Doors(step) => stamp(step),
            };
            self.reports.push((stamp.unwrap_or(now), output));
        }
    }

    /// Compares the reports on velocity and steering with the motion.
    fn deviations(&self) -> Deviations {
        let mut deviations = Deviations::default();
        for (stamp, output) in self.reports.iter().filter(|(stamp, _)| *stamp > BEGUN) {
            match output {
                VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) => {
                    let reported = [velocity.longitudinal_mps, velocity.heading_rate_radps];
                    let [speed, rate] = self.car.velocity_deviations(reported, (*stamp, *stamp));
                    deviations.speed = deviations.speed.max(speed);
                    deviations.heading_rate = deviations.heading_rate.max(rate);
                    deviations.velocities += 1;
                }
                VehicleStatusOutput::Steering(Step::Publish(TireAngle(angle), _)) => {
                    let tire = self.car.tire_deviation(*angle, (*stamp, *stamp));
                    deviations.tire = deviations.tire.max(tire);
                    deviations.tires += 1;
                }
                _ => {}
            }
        }
        deviations
    }

    /// The report at a time; `None` while there is none.
    fn report_at(&self, report: StatusReport, millis: u64) -> Option<String> {
        let until = MonoTime::from_millis(millis);
        let reports = self.reports.iter().rev();
        let (_, last) = reports.into_iter().find(|(at, output)| *at <= until && output.report() == report)?;
        Some(last.named()?.state)
    }

    /// What is expected of gear, mode and doors, each with its time in milliseconds.
    fn expected_switches(&self) -> Vec<(StatusReport, u64, Option<String>)> {
        let binding = &self.car.settings.gateway.status;
        let mut expected = Vec::new();
        if let Some(gear) = &binding.gear {
            let codes = gear.sources[0].role.values.entries();
            let has = |code| codes.iter().any(|(_, meaning)| *meaning == Meaning::Defined(code));
            let shown = |gear| match gear {
                gear if has(GearCode::Engaged(gear)) => Some(gear),
                _ if has(GearCode::NotReverse) => None,
                Gear::Park if has(GearCode::Engaged(Gear::Neutral)) => Some(Gear::Neutral),
                _ => Gear::all().find(|gear| has(GearCode::Engaged(*gear)) && gear.direction() == Some(1.0)),
            };
            for (millis, gear) in GEARS {
                let name = shown(gear).map(|gear| state_word(&gear));
                expected.push((StatusReport::Gear, millis, name));
            }
        }
        if let Some(control_mode) = &binding.control_mode {
            let driven = match &control_mode.source {
                ControlModeSource::Axes(axes) if axes.longitudinal.is_empty() => {
                    ControlMode::AutonomousSteerOnly
                }
                ControlModeSource::Axes(axes) if axes.steering.is_none() => {
                    ControlMode::AutonomousVelocityOnly
                }
                ControlModeSource::Axes(_) | ControlModeSource::Named(_) => ControlMode::Autonomous,
            };
            for (millis, mode) in [(25_900, driven), (26_900, ControlMode::Manual), (29_900, driven)] {
                expected.push((StatusReport::ControlMode, millis, Some(state_word(&mode))));
            }
        }
        if !binding.doors.is_empty() {
            let doors =
                [(26_400, DoorState::Closed), (27_900, DoorState::Opened), (29_900, DoorState::Closed)];
            for (millis, state) in doors {
                let states = vec![state_word(&state); binding.doors.len()].join(", ");
                expected.push((StatusReport::Doors, millis, Some(states)));
            }
        }
        expected
    }

    fn wrong_switches(&self) -> Vec<String> {
        let expected = self.expected_switches().into_iter();
        let wrong = expected.filter_map(|(report, millis, expected)| {
            let found = self.report_at(report, millis);
            let text = format!("{} at {millis} ms: {found:?}, expected {expected:?}", report.name());
            (found != expected).then_some(text)
        });
        wrong.collect()
    }

    /// Reports that end after they have begun.
    fn withdrawn(&self) -> Vec<(u64, StatusReport)> {
        let ends = self.reports.iter().filter(|(at, output)| *at > BEGUN && output.named().is_none());
        ends.map(|(at, output)| (millis(*at), output.report())).collect()
    }
}

/// What is wrong with the reports on a drive; empty if nothing is.
fn judged(settings: Settings) -> (Deviations, Vec<String>) {
    let driven = drive(settings);
    let deviations = driven.deviations();
    let mut wrong = driven.wrong_switches();
    let worst = deviations.speed.max(deviations.heading_rate).max(deviations.tire);
    if worst > 1.0 + 1e-6 {
        wrong.push(format!("{deviations:?} of the resolution"));
    }
    let binding = &driven.car.settings.gateway.status;
    let streams = [
        (StatusReport::Velocity, has_velocity(binding), deviations.velocities),
        (StatusReport::Steering, !binding.steering.is_empty(), deviations.tires),
    ];
    for (report, is_expected, count) in streams {
        let status = driven.gateway.statuses(END).into_iter().find(|status| status.task == report.name());
        if is_expected && (count < MIN_REPORTS || status.is_none_or(|status| status.level != Level::Ok)) {
            wrong.push(format!("{count} reports on {}", report.name()));
        }
        let end = driven.withdrawn().into_iter().find(|(_, withdrawn)| *withdrawn == report);
        wrong.extend(end.map(|(at, report)| format!("{} ends at {at} ms", report.name())));
    }
    (deviations, wrong)
}

/// 10 a second.
const MIN_REPORTS: usize = 275;

/// True if the profile has a heading rate beside the speed.
fn has_velocity(binding: &StatusBinding) -> bool {
    let is_usable = |source: &HeadingRateSource| match source {
        HeadingRateSource::YawRate { .. } => true,
        HeadingRateSource::Steering => !binding.steering.is_empty(),
        HeadingRateSource::Wheels => false,
    };
    binding.velocity.as_ref().is_some_and(|velocity| {
        let has_wheels =
            velocity.speeds.iter().any(|source| matches!(source.signals, SpeedSignals::Wheels { .. }));
        has_wheels || velocity.heading_rates.iter().any(is_usable)
    })
}

#[test]
fn each_simulated_vehicle_is_reported_as_it_moves() {
    let (mut wrong, mut velocities, mut tires) = (Vec::new(), 0, 0);
    for name in profile_names() {
        let mut settings = read_profile(&name);
        if settings.gateway.status.reports().next().is_none() {
            continue;
        }
        settings.gateway.status_settings.geometry = geometry();
        let (deviations, of_profile) = judged(settings);
        velocities += usize::from(deviations.velocities > 0);
        tires += usize::from(deviations.tires > 0);
        wrong.extend(of_profile.into_iter().map(|wrong| format!("{name}: {wrong}")));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!((velocities, tires), (32, 32), "profiles with these reports");
}

#[test]
fn the_simulated_vehicle_has_the_configured_dimensions() {
    let table = WheelToTire::Table(vec![(-8.0, -0.4), (0.0, 0.0), (8.0, 0.5)]);
    let variable = WheelToTire::Variable { constant: 16.0, per_speed_squared: 0.002, per_angle: 0.04 };
    // With an offset the front wheels are never straight by the form with the speed, whose age would show.
    for (wheel_to_tire, steering_offset_rad) in [(table, -0.03), (variable, 0.0)] {
        for read in [|| read_profile("toyota_nodsu"), || read_profile("vw_mqb"), || settings(&[], &[])] {
            let mut settings = read();
            settings.gateway.status_settings.geometry = VehicleGeometry {
                wheel_base_m: Some(3.1),
                wheel_tread_m: Some(1.4),
                speed_scale: 1.1,
                steering_offset_rad,
                wheel_to_tire: Some(wheel_to_tire.clone()),
                ..geometry()
            };
            let (deviations, wrong) = judged(settings);
            assert!(wrong.is_empty(), "{wrong:#?} {deviations:?}");
        }
    }
}

#[test]
fn the_drive_goes_both_ways_and_to_both_sides() {
    let driven = drive(settings(&[], &[]));
    let range = |part: Part| {
        let values = driven.car.motion.iter().map(|(_, motion)| part(motion));
        values.fold((0.0, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)))
    };
    let (backward, forward) = range(|motion| motion.speed_mps);
    let (right, left) = range(|motion| motion.heading_rate_radps);
    assert!((backward + 3.0).abs() < 1e-9 && (forward - 8.0).abs() < 1e-9, "{backward} {forward}");
    assert!(right < -0.6 && left > 0.6, "{right} {left}");
    assert_eq!(driven.car.not_possible, Vec::<&str>::new());
    // 8 m/s² for a second.
    let stop = driven.car.at(MonoTime::from_millis(16_510), |motion| motion.speed_mps);
    let before = driven.car.at(MonoTime::from_millis(16_400), |motion| motion.speed_mps);
    assert!(stop == 0.0 && (0.7..0.9).contains(&before), "{before} {stop}");
}
