//! The cost of the turn signal decider: a decision, loading a map, and how that grows from 500 lanelets to
//! 50,000.
//!
//! `cargo bench --bench turn_signal`. The limits compare figures of the same run: a decision must not cost
//! much more because the map is large, and a megabyte of a large map not much more than one of a small map.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // a program for developers, numbers far below 2^52

mod city;
#[path = "../comparison.rs"]
mod comparison;

use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Duration;

use city::City;
use comparison::{Row, figure, peers, point, processor_time, run};
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::polyline::{at_arc, headed};
use lanelet2_map::lane_network::LaneNetwork;
use lanelet2_map::osm;
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;
use signal_gateway::config::files::Disk;
use signal_gateway::config::map::read_lane_network;
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::inputs::{Inputs, Timed};
use turn_signal::light_command::TurnCommand;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use turn_signal::planner_input::Odometry;
use turn_signal::route::{Route, Segment};
use turn_signal::side::Side;

/// Crossings on a side: about 500, 5,000 and 50,000 lanelets, and 1, 10 and 100 MB of text.
const SIDES: [usize; 3] = [6, 18, 56];
/// The route that all cities have, in steps of two blocks.
const STEPS: usize = 5;
/// Largest growth of the cost of a decision among a hundred times the lanelets.
const MAX_GROWTH: f64 = 10.0;
/// Largest growth of the cost of a megabyte of a map when there are a hundred times as many.
const MAX_GROWTH_EACH: f64 = 5.0;
/// Largest growth of the cost of a decision on a route of eleven times the lanelets.
const MAX_GROWTH_WITH_ROUTE: f64 = 8.0;

/// Each figure is the median of so many.
const SAMPLES: usize = 9;
/// Decisions of one drive, and how far the vehicle comes from one to the next, metres.
const CYCLES: u32 = 400;
const CYCLE_M: f64 = 1.0;
/// The first is so far along the route that the distance path is whole, metres.
const FIRST_M: f64 = 150.0;
const SPEED_MPS: f64 = 10.0;

/// The costs of a decision at one size, nanoseconds.
struct Figures {
    /// Improved mode, upstream's, improved with a lane change.
    decision_ns: [f64; 3],
    /// On a route through the whole city.
    long_route_ns: f64,
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", side, path] => {
            std::fs::write(path, City { side: side.parse().unwrap() }.osm()).unwrap();
            return ExitCode::SUCCESS;
        }
        ["read", path] => {
            black_box(read_lane_network(&Disk, Path::new(path)).unwrap());
            return ExitCode::SUCCESS;
        }
        _ => {}
    }
    // First, while this process is small: children show at least as much memory.
    let (mut good, read_s_per_mb) = read_files();
    let figures: Vec<Figures> = SIDES.map(|side| measure(City { side })).into();
    let (first, last) = (figures.first().unwrap(), figures.last().unwrap());
    let mut grown = |what: &str, [few, many]: [f64; 2], most: f64| {
        let grown = many / few;
        println!("turn signal, growth of {what}: {grown:.2} times, {most} is the most");
        good &= grown <= most;
    };
    let names = ["a decision", "a decision as upstream", "a decision with a lane change"];
    for ((name, few), many) in names.iter().zip(first.decision_ns).zip(last.decision_ns) {
        grown(&format!("{name} with the map"), [few, many], MAX_GROWTH);
    }
    let by_route = [last.decision_ns[0], last.long_route_ns];
    grown("a decision with the route", by_route, MAX_GROWTH_WITH_ROUTE);
    grown("a megabyte read with the map", read_s_per_mb, MAX_GROWTH_EACH);
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Reads maps from files, as the gateway does, each in a process of its own. Returns whether that costs
/// little enough, and the seconds a megabyte of the smallest and of the largest.
fn read_files() -> (bool, [f64; 2]) {
    let (own, folder) = (std::env::current_exe().unwrap(), tempfile::tempdir().unwrap());
    let mut good = true;
    let mut s_per_mb = Vec::new();
    for side in SIDES {
        let path = folder.path().join("map.osm");
        assert!(Command::new(&own).args(["write", &side.to_string()]).arg(&path).status().unwrap().success());
        let size_mb = std::fs::metadata(&path).unwrap().len() as f64 / 1e6;
        let (time, peak_kib) = run(Command::new(&own).arg("read").arg(&path));
        let (read_s, peak_mb) = (time.as_secs_f64(), peak_kib as f64 * 1024.0 / 1e6);
        point("map: time", "s", size_mb, read_s);
        point("map: memory", "MB", size_mb, peak_mb);
        println!(
            "turn signal, map of {size_mb:.1} MB: read in {:.0} ms with {peak_mb:.0} MB of memory",
            read_s * 1e3
        );
        s_per_mb.push(read_s / size_mb);
        if side < SIDES[SIDES.len() - 1] {
            continue;
        }
        let what = format!("map of {size_mb:.0} MB");
        let peer = "its size";
        let memory =
            Row { what: &what, ours: peak_mb, peer, theirs: size_mb, unit: "MB", aim: Some(1.5), limit: 1.5 };
        good &= memory.print();
        if let Some(peers) = peers(&["xml", path.to_str().unwrap()]) {
            let theirs = figure(&peers, "read a byte of a map with quick-xml") * size_mb * 1e6 / 1e9;
            let peer = "its XML alone, with quick-xml";
            good &=
                Row { what: &what, ours: read_s, peer, theirs, unit: "s", aim: None, limit: 12.0 }.print();
        }
    }
    (good, [s_per_mb[0], s_per_mb[s_per_mb.len() - 1]])
}

fn measure(city: City) -> Figures {
    let osm = osm::read(city.osm().as_bytes()).unwrap();
    let road = LaneNetwork::read(&osm, &Points::new(&osm, &Projector::Local).unwrap()).unwrap();
    let lanelets = road.lanes().count();
    let drive = Drive::new(&road, &city.staircase(STEPS));
    let decision_ns = [
        drive.decision_ns(DeciderCompat::Improved, &[]),
        drive.decision_ns(DeciderCompat::Upstream, &[]),
        drive.decision_ns(DeciderCompat::Improved, &drive.lane_change()),
    ];
    let long = Drive::new(&road, &city.staircase(city.side - 1));
    let long_route_ns = long.decision_ns(DeciderCompat::Improved, &[]);
    let [improved, compat, with_lane_change] = decision_ns.map(|ns| ns / 1e3);
    println!(
        "turn signal, {lanelets} lanelets: a decision in {improved:.1} µs, as upstream {compat:.1} µs, with a lane change {with_lane_change:.1} µs, on a route of {} lanelets {:.1} µs",
        long.lanelets,
        long_route_ns / 1e3
    );
    point("decision: lanelets of the map", "µs", lanelets as f64, improved);
    point("decision: lanelets of the route", "µs", long.lanelets as f64, long_route_ns / 1e3);
    Figures { decision_ns, long_route_ns }
}

/// A drive along a route.
struct Drive<'a> {
    road: &'a LaneNetwork,
    route: Route,
    lanelets: usize,
    /// Poses of the vehicle, cycle by cycle.
    poses: Vec<Pose>,
}

impl<'a> Drive<'a> {
    fn new(road: &'a LaneNetwork, lanelets: &[i64]) -> Self {
        let line: Vec<_> =
            lanelets.iter().flat_map(|id| road.lane(*id).unwrap().centerline.iter().copied()).collect();
        let at = |cycle| at_arc(&line, FIRST_M + CYCLE_M * f64::from(cycle)).unwrap();
        let points: Vec<_> = (0..CYCLES).map(at).collect();
        let segments = lanelets.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] });
        let route = Route::new(1, headed(&line)[0], segments.collect()).unwrap().checked(road).unwrap();
        Self { road, route, lanelets: lanelets.len(), poses: headed(&points) }
    }

    /// A lane change that begins and ends on the route.
    fn lane_change(&self) -> [Manoeuvre; 1] {
        let at = |share: usize| Some(self.poses[self.poses.len() * share / 4]);
        [Manoeuvre::LaneChange(LaneChange {
            side: Side::Left,
            phase: LaneChangePhase::Running,
            start: at(1),
            crossing: at(2),
            end: at(3),
            previous_path: Vec::new(),
            minimum_length_m: 0.0,
        })]
    }

    /// Nanoseconds a decision, over the whole drive.
    fn decision_ns(&self, mode: DeciderCompat, manoeuvres: &[Manoeuvre]) -> f64 {
        median(SAMPLES, || {
            let mut decider = Decider::new(DeciderSettings::deployed(mode));
            let mut signalled = 0;
            let ns = timed(self.poses.len(), || {
                for (cycle, pose) in (0..).zip(&self.poses) {
                    let now = MonoTime::ZERO.after(Duration::from_millis(100 * cycle));
                    let timed: Vec<_> =
                        manoeuvres.iter().map(|value| Timed { at: now, value: value.clone() }).collect();
                    let odometry = Odometry { pose: *pose, speed_mps: SPEED_MPS };
                    let inputs = Inputs {
                        odometry: Some(Timed { at: now, value: odometry }),
                        road: Some(self.road),
                        route: Some(&self.route),
                        planned_path: None,
                        manoeuvres: &timed,
                        lane_driving: true,
                    };
                    let decision = decider.decide(&inputs, now);
                    signalled += usize::from(matches!(decision.turn, TurnCommand::Left | TurnCommand::Right));
                }
            });
            assert!(signalled > self.poses.len() / 4, "{signalled}: the drive has turns");
            ns
        })
    }
}

/// Nanoseconds for each of so many.
fn timed(count: usize, action: impl FnOnce()) -> f64 {
    let start = processor_time();
    action();
    processor_time().saturating_sub(start).as_secs_f64() * 1e9 / count as f64
}

fn median(samples: usize, sample: impl FnMut() -> f64) -> f64 {
    let mut samples: Vec<_> = std::iter::repeat_with(sample).take(samples).collect();
    samples.sort_by(f64::total_cmp);
    samples[samples.len() / 2]
}
