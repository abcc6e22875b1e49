//! What drives that turn show of signs, ratio and tread: simulated cars of random geometry, and public
//! recordings.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use can_log::Log;
use gateway_base::time::MonoTime;
use gateway_core::vehicle_status::kinematics::finding::{KinematicFinding, findings};
use gateway_core::vehicle_status::kinematics::survey::{KinematicSurvey, MotionSample};
use gateway_core::vehicle_status::kinematics::{Kinematics, Rate, RatioEstimate};
use gateway_core::vehicle_status::settings::{GeometryKey, VehicleGeometry, WheelToTire};
use gateway_core::vehicle_status::steering::AngleOf;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng as _;
use signal_gateway::check::{CheckReport, Layout, recording};
use signal_gateway::config::{Overrides, load};
use signal_gateway::replay::{Replay, Routes};

use super::car::{CYCLES, Car, files};
use super::{DRIVE, REVERSE};
use crate::support::files::MemoryFiles;
use crate::support::prerequisite::{require, shared_data};

/// Time between two samples, s.
const STEP_S: f64 = 0.02;

/// A car and how its sensors err.
#[derive(Debug, Clone, Copy)]
struct SimulatedCar {
    wheel_base_m: f64,
    ratio: f64,
    tread_m: f64,
    /// Understeer, s²/m².
    understeer: f64,
    /// Angle that the steering wheel reads straight ahead, rad.
    steering_zero_rad: f64,
    /// Step of the steering signal, rad.
    steering_step_rad: f64,
    yaw_zero_radps: f64,
    yaw_noise_radps: f64,
    wheel_noise_mps: f64,
    /// Share by which the right rear tyre is smaller.
    tyre: f64,
}

/// Random numbers.
struct Random(Pcg32);

impl Random {
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    /// About normal, with this standard deviation.
    fn noise(&mut self, deviation: f64) -> f64 {
        let sum: f64 = (0..6).map(|_| self.uniform(-1.0, 1.0)).sum();
        deviation * sum / 2.0_f64.sqrt()
    }
}

impl SimulatedCar {
    fn random(random: &mut Random) -> Self {
        Self {
            wheel_base_m: random.uniform(2.3, 3.4),
            ratio: random.uniform(12.0, 19.0),
            tread_m: random.uniform(1.4, 1.7),
            understeer: random.uniform(0.0, 0.0018),
            steering_zero_rad: random.uniform(-0.05, 0.05),
            steering_step_rad: random.uniform(0.1, 1.5).to_radians(),
            yaw_zero_radps: random.uniform(-0.02, 0.02),
            yaw_noise_radps: random.uniform(0.001, 0.006),
            wheel_noise_mps: random.uniform(0.005, 0.03),
            tyre: random.uniform(-0.004, 0.004),
        }
    }

    fn geometry(&self) -> VehicleGeometry {
        VehicleGeometry {
            is_configured: true,
            wheel_base_m: Some(self.wheel_base_m),
            wheel_tread_m: Some(self.tread_m),
            wheel_to_tire: Some(WheelToTire::Ratio(self.ratio)),
            ..VehicleGeometry::default()
        }
    }

    /// The samples of a drive in a town: straight roads, bends, and so many turns of a street corner, some
    /// backward.
    fn drive(&self, turns: usize, random: &mut Random) -> Vec<MotionSample> {
        let mut samples = Vec::new();
        let mut last_rad = 0.0;
        for turn in 0..turns {
            let fast = random.uniform(8.0, 14.0);
            let bend = random.uniform(-0.01, 0.01);
            self.leg(&mut samples, &mut last_rad, (fast, bend, random.uniform(4.0, 10.0)), random);
            let backward = if turn % 5 == 4 { -0.4 } else { 1.0 };
            let speed = backward * random.uniform(3.0, 7.0);
            let left = if random.uniform(-1.0, 1.0) > 0.0 { 1.0 } else { -1.0 };
            let curvature = left / random.uniform(7.0, 15.0);
            let seconds = FRAC_PI_2 / (speed * curvature).abs();
            self.leg(&mut samples, &mut last_rad, (speed, curvature, seconds), random);
        }
        samples
    }

    /// Drives with a speed, m/s, on a curvature, 1/m, for a time, s.
    fn leg(
        &self,
        samples: &mut Vec<MotionSample>,
        tire_rad: &mut f64,
        (speed, curvature, seconds): (f64, f64, f64),
        random: &mut Random,
    ) {
        let wanted = (curvature * self.wheel_base_m * (1.0 + self.understeer * speed * speed)).atan();
        let steps = (seconds / STEP_S) as usize;
        for _ in 0..steps {
            *tire_rad += (wanted - *tire_rad).clamp(-0.4 * STEP_S, 0.4 * STEP_S);
            let rate = speed * tire_rad.tan() / (self.wheel_base_m * (1.0 + self.understeer * speed * speed));
            let rear = |side: f64| speed + side * rate * self.tread_m / 2.0;
            let front = (speed / tire_rad.cos()).abs().copysign(speed);
            let wheel = tire_rad.mul_add(self.ratio, self.steering_zero_rad);
            let mut noisy = |speed: f64| Some(speed + random.noise(self.wheel_noise_mps));
            let wheels_mps =
                [noisy(front), noisy(front), noisy(rear(-1.0)), noisy(rear(1.0) * (1.0 + self.tyre))];
            samples.push(MotionSample {
                speed_mps: f64::midpoint(wheels_mps[2].unwrap(), wheels_mps[3].unwrap()),
                other_speed_mps: Some(1.02 * speed.abs()),
                wheels_mps,
                yaw_rate_radps: Some(rate + self.yaw_zero_radps + random.noise(self.yaw_noise_radps)),
                steering_rad: Some((wheel / self.steering_step_rad).round() * self.steering_step_rad),
            });
        }
    }
}

/// Evaluates samples, each changed.
fn evaluate(
    samples: &[MotionSample],
    geometry: &VehicleGeometry,
    change: impl Fn(MotionSample) -> MotionSample,
) -> Kinematics {
    let mut survey = KinematicSurvey::default();
    for (step, sample) in (0..).zip(samples) {
        survey.add(change(*sample), MonoTime::from_millis(step * 20));
    }
    Kinematics::of(survey, geometry, Some(AngleOf::SteeringWheel))
}

fn random(seed: u64) -> Random {
    Random(Pcg32::new(seed, TAU.to_bits()))
}

/// The quantities that a car has on its bus, by bit: yaw rate, wheels.
fn without(sample: MotionSample, has_yaw_rate: bool, has_wheels: bool) -> MotionSample {
    MotionSample {
        yaw_rate_radps: sample.yaw_rate_radps.filter(|_| has_yaw_rate),
        wheels_mps: if has_wheels { sample.wheels_mps } else { [None; 4] },
        ..sample
    }
}

#[test]
fn intervals_hold_the_truth_and_what_is_right_is_never_warned_of() {
    const DRIVES: u64 = 60;
    let (mut ratios, mut treads, mut missed_ratios, mut missed_treads) = (0, 0, 0, 0);
    let (mut widths, mut wrong) = (0.0, Vec::new());
    for seed in 0..DRIVES {
        let mut random = random(seed);
        let car = SimulatedCar::random(&mut random);
        let turns = 4 + (seed % 17) as usize;
        let samples = car.drive(turns, &mut random);
        let geometry = car.geometry();
        for (has_yaw_rate, has_wheels) in [(true, true), (true, false), (false, true)] {
            let found = evaluate(&samples, &geometry, |sample| without(sample, has_yaw_rate, has_wheels));
            if let Some((RatioEstimate::Ratio(ratio), _)) = found.ratio {
                ratios += 1;
                missed_ratios += usize::from(car.ratio < ratio.low || car.ratio > ratio.high);
                widths += (ratio.high - ratio.low) / car.ratio;
            }
            if let Some(tread) = found.tread_m {
                treads += 1;
                missed_treads += usize::from(car.tread_m < tread.low || car.tread_m > tread.high);
            }
            let warned = findings(&found, &geometry);
            if !warned.is_empty() {
                wrong.push(format!("{seed}: {warned:?}"));
            }
        }
    }
    let mean = widths / ratios as f64;
    println!(
        "{missed_ratios} of {ratios} ratios missed, width {mean:.3}; {missed_treads} of {treads} treads"
    );
    assert_eq!(wrong, Vec::<String>::new());
    assert!(ratios as u64 > DRIVES * 3 * 95 / 100 && treads as u64 > DRIVES * 95 / 100, "{ratios} {treads}");
    assert!(missed_ratios * 20 <= ratios && missed_treads * 20 <= treads, "{missed_ratios} {missed_treads}");
    assert!(mean < 0.35, "intervals as wide as {mean:.3} of the ratio say little");
}

#[test]
fn wrong_signs_and_wrong_dimensions_are_always_found() {
    for seed in 0..20 {
        let mut random = random(1000 + seed);
        let car = SimulatedCar::random(&mut random);
        let samples = car.drive(8 + (seed % 13) as usize, &mut random);
        let geometry = car.geometry();
        let opposite = |rate: Rate| {
            move |sample: MotionSample| match rate {
                Rate::YawRate => {
                    MotionSample { yaw_rate_radps: sample.yaw_rate_radps.map(|rate| -rate), ..sample }
                }
                Rate::Steering => {
                    MotionSample { steering_rad: sample.steering_rad.map(|angle| -angle), ..sample }
                }
                Rate::Wheels => {
                    let [front_left, front_right, left, right] = sample.wheels_mps;
                    MotionSample { wheels_mps: [front_left, front_right, right, left], ..sample }
                }
            }
        };
        for rate in [Rate::YawRate, Rate::Steering, Rate::Wheels] {
            let found = evaluate(&samples, &geometry, opposite(rate));
            assert_eq!(findings(&found, &geometry), [KinematicFinding::WrongSign(vec![rate])], "{seed}");
        }
        let found =
            evaluate(&samples, &geometry, |sample| without(opposite(Rate::Steering)(sample), true, false));
        let either = KinematicFinding::WrongSign(vec![Rate::YawRate, Rate::Steering]);
        assert_eq!(findings(&found, &geometry), [either], "{seed}");
        for wrong in [0.7, 1.3] {
            let of_ratio = VehicleGeometry {
                wheel_to_tire: Some(WheelToTire::Ratio(car.ratio * wrong)),
                ..geometry.clone()
            };
            let of_tread = VehicleGeometry { wheel_tread_m: Some(car.tread_m * wrong), ..geometry.clone() };
            for (key, geometry) in
                [(GeometryKey::SteeringRatio, of_ratio), (GeometryKey::WheelTread, of_tread)]
            {
                let found = evaluate(&samples, &geometry, |sample| sample);
                let warned = findings(&found, &geometry);
                let is_it = |finding: &KinematicFinding| matches!(finding, KinematicFinding::Dimension { key: of, .. } if *of == key);
                assert!(
                    matches!(warned.as_slice(), [finding] if is_it(finding)),
                    "{seed} {key:?} {wrong}: {warned:?} {found:?} {car:?}"
                );
            }
        }
        let in_km_h = |sample: MotionSample| MotionSample {
            other_speed_mps: sample.other_speed_mps.map(|speed| speed * 3.6),
            ..sample
        };
        let found = evaluate(&samples, &geometry, in_km_h);
        assert!(
            matches!(findings(&found, &geometry).as_slice(), [KinematicFinding::SecondByFirst(_)]),
            "{seed}"
        );
    }
}

#[test]
fn a_straight_drive_shows_nothing() {
    let mut random = random(1);
    let car = SimulatedCar::random(&mut random);
    let (mut samples, mut tire_rad) = (Vec::new(), 0.0);
    for speed in [10.0, 15.0, 20.0] {
        car.leg(&mut samples, &mut tire_rad, (speed, 0.0005, 20.0), &mut random);
    }
    let opposite = |sample: MotionSample| MotionSample {
        yaw_rate_radps: sample.yaw_rate_radps.map(|rate| -rate),
        ..sample
    };
    let found = evaluate(&samples, &car.geometry(), opposite);
    assert_eq!((found.turns, found.has_rates, found.ratio, found.tread_m), (0, true, None, None));
    assert_eq!(findings(&found, &car.geometry()), []);
}

/// A recording of the car of these tests: six corners between slow straights, the fourth one backward.
fn recorded() -> String {
    let (mut log, mut car) = (String::new(), Car::default());
    for now_ms in (0..60_000_u64).step_by(10) {
        let phase = now_ms % 10_000;
        let is_backward = now_ms / 10_000 == 3;
        let is_at_rest = phase < 2_000;
        car.gear = if is_backward { REVERSE } else { DRIVE };
        let speed = if is_at_rest { 0.0 } else { 4.0 };
        car.speed_mps = if is_backward { -speed } else { speed };
        let side = if now_ms / 10_000 % 2 == 0 { 0.3 } else { -0.25 };
        car.tire_rad = if phase > 5_000 { side } else { 0.0 };
        for (id, _) in CYCLES.into_iter().filter(|(_, cycle_ms)| now_ms.is_multiple_of(*cycle_ms)) {
            let data: String = car.frame(id).data.iter().map(|byte| format!("{byte:02X}")).collect();
            let seconds = now_ms / 1000;
            log +=
                &format!("({}.{:06}) can0 {id:03X}#{data}\n", 1_700_000_000 + seconds, now_ms % 1000 * 1000);
        }
    }
    log
}

/// Checks that recording after edits of the profile and of the gateway's file: the findings about the motion,
/// and all facts.
fn checked(profile: &[(&str, &str)], gateway: &[(&str, &str)]) -> (Vec<String>, String) {
    let settings = files(profile, gateway).settings();
    let log = Log::new(Box::new(std::io::Cursor::new(recorded().into_bytes()))).unwrap();
    let routes = Routes::by_interface(&settings.gateway);
    let replay = Replay::surveying(settings.gateway.clone(), log, routes).unwrap();
    let (report, outcome) = recording(&settings, replay);
    outcome.unwrap();
    motion(&report)
}

#[test]
fn check_says_what_a_recording_shows_and_what_it_contradicts() {
    let (findings, facts) = checked(&[], &[]);
    assert_eq!(findings, [] as [&str; 0], "{facts}");
    for fact in [
        "yaw rate and steering turn to the same side",
        "yaw rate and rear wheels turn to the same side",
        "steering and rear wheels turn to the same side",
        "steering_ratio 15.",
        " by the yaw rate in 6 turns",
        "wheel_tread_m 1.5",
        "the second source of the speed reads 1.000 to 1.000 times the first",
    ] {
        assert!(facts.contains(fact), "{fact}: {facts}");
    }
    let yaw_left = r#"unit = "deg/s", positive = "left""#;
    let yaw_right = r#"unit = "deg/s", positive = "right""#;
    let steering_left = r#"unit = "deg", positive = "left""#;
    let steering_right = r#"unit = "deg", positive = "right""#;
    for (profile, gateway, expected) in [
        (Some((yaw_left, yaw_right)), None, "the yaw rate has the wrong sign: check `positive` of yaw_rate"),
        (
            Some((steering_left, steering_right)),
            None,
            "the steering has the wrong sign: check `positive` of [steering]",
        ),
        (
            None,
            Some(("steering_ratio = 16.0", "steering_ratio = 12.0")),
            "steering_ratio of [vehicle_geometry] looks like 15.",
        ),
        (
            None,
            Some(("wheel_tread_m = 1.6", "wheel_tread_m = 1.2")),
            "wheel_tread_m of [vehicle_geometry] looks like 1.5",
        ),
        (
            None,
            Some(("steering_ratio = 16.0", "")),
            "[vehicle_geometry]: the recording shows steering_ratio = 1",
        ),
        (None, Some(("wheel_base_m = 2.7", "")), "[vehicle_geometry]: the recording shows steering_ratio 1"),
    ] {
        let (profile, gateway): (Vec<_>, Vec<_>) =
            (profile.into_iter().collect(), gateway.into_iter().collect());
        let (findings, facts) = checked(&profile, &gateway);
        let is_it = matches!(findings.as_slice(), [finding] if finding.starts_with(expected));
        assert!(is_it, "{expected}: {findings:?}\n{facts}");
    }
    // A listed ratio is compared as well, and the measured one is there to replace it.
    let (findings, facts) = checked(&[], &[("steering_ratio = 16.0", "car = \"Acura RDX 2019\"")]);
    let [wrong, lines] = findings.as_slice() else { panic!("{findings:?}\n{facts}") };
    assert!(wrong.starts_with("steering_ratio of [vehicle_geometry] looks like 15."), "{wrong}");
    assert!(wrong.ends_with(", opendbc's list says 11.95 for Acura RDX 2019–2021"), "{wrong}");
    assert!(
        lines.contains("steering_ratio = 1") && lines.contains(" and measured = \"6 turns, 15."),
        "{lines}"
    );
    let (findings, _) =
        checked(&[], &[("steering_ratio = 16.0", "steering_ratio = 16.0\nmeasured = \"6 turns\"")]);
    assert_eq!(findings, [] as [&str; 0]);
}

/// Checks a public recording with a geometry.
fn check(folder: &Path, log: &str, profile: &str, geometry: &str) -> CheckReport {
    let gateway = format!(
        "profile = \"{profile}\"\n[can.body]\ninterface = \"can0\"\n[vehicle_geometry]\nmax_steer_angle_rad = 1.5\n{geometry}"
    );
    check_with(&MemoryFiles::new([("gateway.toml", gateway)]).or_disk(), &folder.join(log))
}

fn check_with(files: &MemoryFiles, path: &Path) -> CheckReport {
    let settings = load(files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
    let mut routes = Routes::by_interface(&settings.gateway);
    routes.adopt_only_interface(path);
    let replay = Replay::surveying(settings.gateway.clone(), Log::open(path).unwrap(), routes).unwrap();
    let (report, outcome) = recording(&settings, replay);
    outcome.unwrap();
    report
}

/// The findings about the motion, and its facts.
fn motion(report: &CheckReport) -> (Vec<String>, String) {
    let facts = report.facts_text(Layout::default());
    let facts: Vec<_> = facts.lines().filter(|line| line.starts_with("motion")).collect();
    let parts = [
        "wrong sign",
        "looks like",
        "as far as",
        "wheels read",
        "of the speed reads",
        "exchanged",
        "recording shows",
    ];
    let findings = report.findings().into_iter().map(|finding| finding.text.clone());
    let findings = findings.filter(|text| parts.iter().any(|part| text.contains(part)));
    (findings.collect(), facts.join("\n"))
}

#[test]
fn public_drives_raise_no_alarm_with_the_right_geometry() {
    let folder = require!(shared_data()).join("can-logs");
    let too_straight = "the recording does not turn enough";
    for (log, profile, wheel_base_m, ratio, tread_m, expected) in [
        ("comma2k19-rav4-b0c9d232-seg40.candump.log.gz", "toyota_nodsu", 2.66, 14.3, 1.57, too_straight),
        (
            "comma2k19-rav4-b0c9d232-seg40.candump.log.gz",
            "toyota_nodsu",
            2.66,
            16.88,
            1.57,
            "reads 1.000 to 1.006 times",
        ),
        (
            "eld-civic-type-r-2019-turnonanddrive.log",
            "honda_civic_hatchback_2017",
            2.70,
            15.38,
            1.59,
            too_straight,
        ),
        (
            "ford-mustang-s550.txt.gz",
            "ford_lincoln",
            2.72,
            16.0,
            1.65,
            "front wheels read 0.898 to 1.014 times",
        ),
    ] {
        let geometry = format!(
            "wheel_base_m = {wheel_base_m}\nsteering_ratio = {ratio}\nwheel_tread_m = {tread_m}\nwheel_radius_m = 0.33"
        );
        let (findings, facts) = motion(&check(&folder, log, profile, &geometry));
        assert_eq!(findings, [] as [&str; 0], "{log}");
        assert!(facts.contains(expected), "{log}: {facts}");
    }
}
