//! Velocity and steering of a public drive against what was measured beside the bus: comma2k19, a RAV4 with
//! GNSS/INS.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use can_log::Log;
use flate2::read::GzDecoder;
use gateway_base::diagnostics::Level;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::plausibility::alarm::ALARMS;
use signal_gateway::config::{Overrides, load};
use signal_gateway::replay::{Replay, Routes};

use crate::pure::vehicles::playback::play_file;
use crate::support::files::MemoryFiles;
use crate::support::prerequisite::{require, shared_data};

/// A quantity over time, seconds since the first frame.
type Series = Vec<(f64, f64)>;

/// The measurements of the data set by the names of their quantities.
fn truth(folder: &Path) -> BTreeMap<String, Series> {
    let file = std::fs::File::open(folder.join("comma2k19-rav4-b0c9d232-seg40.truth.csv.gz")).unwrap();
    let mut text = String::new();
    GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let mut series: BTreeMap<String, Series> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let fields: Vec<_> = line.split(',').collect();
        let [time, quantity, value] = fields[..] else { panic!("{line}") };
        series.entry(quantity.to_owned()).or_default().push((time.parse().unwrap(), value.parse().unwrap()));
    }
    series
}

/// What the gateway reports of the drive: speed, heading rate, angle of the front wheels.
fn reported(folder: &Path, profile: &str) -> [Series; 3] {
    let gateway = format!(
        "profile = \"{profile}\"\n[can.body]\ninterface = \"can0\"\n[reports]\nmax_rate_hz = 200\n\
         [vehicle_geometry]\nwheel_base_m = 2.66\nwheel_tread_m = 1.57\nsteering_ratio = 10.0\nmax_steer_angle_rad = 1.5\n"
    );
    let files = MemoryFiles::new([("gateway.toml", gateway)]).or_disk();
    let settings = load(&files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
    let routes = Routes::by_interface(&settings.gateway);
    let log = Log::open(&folder.join("comma2k19-rav4-b0c9d232-seg40.candump.log.gz")).unwrap();
    let mut replay = Replay::new(settings.gateway, log, routes).unwrap();
    let first = replay.now().wall.as_nanos();
    let seconds = |stamp: i64| (stamp - first) as f64 / 1e9;
    let mut series = [const { Series::new() }; 3];
    loop {
        while let Some(output) = replay.poll_output() {
            let Output::VehicleStatus(output) = output else { continue };
            match output {
                VehicleStatusOutput::Velocity(Step::Publish(velocity, stamp)) => {
                    let at = seconds(stamp.as_nanos());
                    series[0].push((at, velocity.longitudinal_mps));
                    series[1].push((at, velocity.heading_rate_radps));
                }
                VehicleStatusOutput::Steering(Step::Publish(tire, stamp)) => {
                    series[2].push((seconds(stamp.as_nanos()), tire.0));
                }
                _ => {}
            }
        }
        if !replay.step().unwrap() {
            return series;
        }
    }
}

/// The value of a series at a time, by straight lines; `None` outside.
fn at(series: &Series, time: f64) -> Option<f64> {
    let above = series.partition_point(|(at, _)| *at < time);
    let (t0, v0) = series[above.checked_sub(1)?];
    let (t1, v1) = *series.get(above)?;
    Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0))
}

/// Pairs of truth and report at the times of the truth, within a part of the drive.
fn pairs(truth: &Series, reported: &Series, part: std::ops::Range<f64>) -> Vec<(f64, f64)> {
    let within = truth.iter().filter(|(time, _)| part.contains(time));
    within.filter_map(|(time, value)| Some((*value, at(reported, *time)?))).collect()
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

/// Scale that makes reports the truth, by least squares through zero.
fn scale(pairs: &[(f64, f64)]) -> f64 {
    pairs.iter().map(|(truth, found)| truth * found).sum::<f64>()
        / pairs.iter().map(|(_, found)| found * found).sum::<f64>()
}

fn rms(differences: impl Iterator<Item = f64> + Clone) -> f64 {
    mean(differences.map(|difference| difference * difference)).sqrt()
}

/// The change of a heading over three seconds, so that the noise of single values does not count.
fn turns(heading: &Series) -> Series {
    let change = |(time, before): &(f64, f64)| Some((*time, at(heading, time + 3.0)? - before));
    heading.iter().filter_map(change).collect()
}

/// What is wrong with the reports of a drive; empty if nothing is.
fn judge(truth: &BTreeMap<String, Series>, [speed, rate, _]: &[Series; 3]) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut expect = |is_right: bool, what: String| {
        if !is_right {
            wrong.push(what);
        }
    };
    let measured = &truth["gnss_ins_speed_mps"];
    let factor = scale(&pairs(measured, speed, 0.0..30.0));
    expect((0.97..1.03).contains(&factor), format!("speed scale {factor:.4}"));
    let second = pairs(measured, speed, 30.0..60.0);
    let off = rms(second.iter().map(|(truth, found)| truth - factor * found));
    let share = mean(second.iter().map(|(truth, found)| factor * found / truth)) - 1.0;
    expect(off < 0.06 && share.abs() < 0.01, format!("speed: {off:.3} m/s rms, {:.2} %", share * 100.0));
    let measured = &truth["gnss_ins_heading_rad"];
    let mut heading = 0.0;
    let integrated = rate.windows(2).map(|pair| {
        heading += pair[0].1 * (pair[1].0 - pair[0].0);
        (pair[1].0, heading)
    });
    let integrated: Series = integrated.collect();
    let first = pairs(&turns(measured), &turns(&integrated), 0.0..27.0);
    let bias = mean(first.iter().map(|(truth, found)| (found - truth) / 3.0));
    let integrated: Series =
        integrated.iter().map(|(time, heading)| (*time, heading - bias * time)).collect();
    // Three seconds of the drive, which is nearly straight, turn by 0.3° as a rule, noise included.
    let turning = pairs(&turns(measured), &turns(&integrated), 0.0..60.0);
    let turning: Vec<_> =
        turning.into_iter().filter(|(truth, _)| truth.abs() > 0.6_f64.to_radians()).collect();
    let swapped: Vec<_> = turning.iter().map(|(truth, found)| (*found, *truth)).collect();
    let slope = scale(&swapped);
    expect((0.95..=1.05).contains(&slope), format!("slope of the heading rate {slope:.3}"));
    let start = at(&integrated, 30.0).unwrap() - at(measured, 30.0).unwrap();
    let off = pairs(measured, &integrated, 30.0..59.5);
    let worst =
        off.iter().map(|(truth, found)| (found - start - truth).abs()).fold(0.0, f64::max).to_degrees();
    expect(worst < 1.0, format!("heading off by {worst:.2}°"));
    let off = rms(second.iter().map(|(truth, found)| truth - factor * found));
    println!(
        "scale {factor:.4}, {off:.3} m/s rms, slope {slope:.3} of {} turns, bias {bias:.4} rad/s, heading within {worst:.2}°",
        turning.len()
    );
    wrong
}

#[test]
fn a_drive_with_gnss_is_reported_as_it_was() {
    let folder = require!(shared_data()).join("can-logs");
    let truth = truth(&folder);
    let reports = reported(&folder, "toyota_nodsu");
    assert_eq!(judge(&truth, &reports), Vec::<String>::new());
    // The data set's own decoding of the steering wheel, where both have a value of the same frame.
    let steering = &truth["dataset_steering_wheel_deg"];
    let near = |time: f64| {
        let after = reports[2].partition_point(|(at, _)| *at < time - 0.000_5);
        reports[2]
            .get(after)
            .filter(|(at, _)| (at - time).abs() < 0.001)
            .map(|(_, angle)| angle.to_degrees() * 10.0)
    };
    let found: Vec<_> = steering.iter().filter_map(|(time, angle)| Some((*angle, near(*time)?))).collect();
    assert!(found.len() > 4_000, "{}", found.len());
    let equal = found.iter().filter(|(angle, found)| (angle - found).abs() < 1e-6).count();
    assert!(equal * 100 >= found.len() * 99, "{equal} of {}", found.len());
}

#[test]
fn wrong_reports_of_the_drive_are_told() {
    let folder = require!(shared_data()).join("can-logs");
    let truth = truth(&folder);
    let right = reported(&folder, "toyota_nodsu");
    let changed = |index: usize, change: &dyn Fn(f64) -> f64| {
        let mut reports = right.clone();
        reports[index].iter_mut().for_each(|(_, value)| *value = change(*value));
        judge(&truth, &reports)
    };
    for (index, change) in [
        (0, &(|_| 0.0) as &dyn Fn(f64) -> f64),
        (0, &|speed| -speed),
        (0, &|speed| speed * 3.6),
        (1, &|_| 0.0),
        (1, &|rate| -rate),
        (1, &|rate: f64| rate.to_degrees()),
        (1, &|rate: f64| rate.to_radians()),
    ] {
        assert_ne!(changed(index, change), Vec::<String>::new());
    }
}

/// Healthy public drives: the recording, its profile, the bus there, and wheel base, tread and rolling
/// radius.
const DRIVES: [(&str, &str, &str, [f64; 3]); 4] = [
    ("comma2k19-rav4-b0c9d232-seg40.candump.log.gz", "toyota_nodsu", "body", [2.66, 1.57, 0.35]),
    ("ford-mustang-s550.txt.gz", "ford_lincoln", "body", [2.72, 1.64, 0.331]),
    ("eld-civic-type-r-2019-turnonanddrive.log", "honda_civic_hatchback_2017", "body", [2.7, 1.59, 0.32]),
    ("eld-kona-turnonlog.log", "hyundai_kia", "powertrain", [2.6, 1.57, 0.32]),
];

/// The statuses of the vehicle's status that were not OK in a drive.
fn abnormal(folder: &Path, [recording, profile, bus]: [&str; 3], geometry: [f64; 3]) -> Vec<String> {
    let [base, tread, radius] = geometry;
    let gateway = format!(
        "profile = \"{profile}\"\n[can.{bus}]\ninterface = \"can0\"\n[vehicle_geometry]\nwheel_base_m = {base}\n\
         wheel_tread_m = {tread}\nwheel_radius_m = {radius}\nsteering_ratio = 16.0\nmax_steer_angle_rad = 0.7\n"
    );
    let files = MemoryFiles::new([("gateway.toml", gateway)]).or_disk();
    let settings = load(&files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
    let playback = play_file(&settings, &folder.join(recording));
    assert!(playback.status.len() > 500, "{recording}: {} reports", playback.status.len());
    let changes = playback.changes.into_iter().filter(|change| change.level != Level::Ok);
    changes.map(|change| change.message).collect()
}

#[test]
fn healthy_public_drives_raise_no_alarm() {
    let folder = require!(shared_data()).join("can-logs");
    for (recording, profile, bus, geometry) in DRIVES {
        for message in abnormal(&folder, [recording, profile, bus], geometry) {
            let alarm = ALARMS.iter().find(|row| message.contains(row.text));
            assert!(alarm.is_none(), "{recording}: {message}");
        }
    }
    // With rear wheels of half the radius, the sources of the speed differ.
    let messages = abnormal(&folder, [DRIVES[1].0, DRIVES[1].1, DRIVES[1].2], [2.72, 1.64, 0.165]);
    let is_alarm = |message: &&String| ALARMS.iter().any(|row| message.contains(row.text));
    assert!(messages.iter().any(|message| is_alarm(&message)), "{messages:?}");
}
