//! A learned planner that sends a trajectory and a turn command, with and without faults, and what the judge
//! makes of it (docs/turn-signal-decider.md, "Learned planners"). What the planner ought to signal comes from
//! how the drive was made, not from the decider.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::DeciderSettings;
use turn_signal::flow::{DeciderRole, TurnSignalFlow, TurnSignalSettings};
use turn_signal::light_command::TurnCommand;
use turn_signal::planner_input::{Odometry, PlannerInput, PlannerRoute, TrajectoryPoint};
use turn_signal::route::Segment;
use turn_signal::side::Side;
use turn_signal::signal_judge::{VerdictCounts, VerdictKind};
use turn_signal::vehicle_state::{VehicleState, VehicleUse};

use super::line::FRONT_M;
use crate::support::clock::at;
use crate::support::docs_table;
use crate::support::random::Random;

const BEGIN: &str =
    "<!-- begin faults, made by `UPDATE_DOCS=1 cargo test --test pure learned_planners` -->\n";
const END: &str = "<!-- end faults -->";
const LANE_M: f64 = 3.5;
const CYCLE_MS: u64 = 100;
const CYCLE_S: f64 = 0.1;
const TURN_RADIUS_M: f64 = 12.0;
/// The trajectories of a planner.
#[derive(Debug, Clone, Copy)]
struct Planner {
    name: &'static str,
    /// It looks so far ahead, s.
    horizon_s: f64,
    /// Distance from point to point, metres.
    step_m: f64,
    /// Each point is up to this far beside where it should be, metres.
    noise_m: f64,
    /// The end of each trajectory is up to this far beside where the vehicle will drive, metres.
    drift_m: f64,
    /// So many of fifty drives without a fault may have a wrong verdict.
    false_alarms: u64,
    /// In so many of fifty drives each fault must be found.
    hits: u64,
}

const USUAL: Planner = Planner {
    name: "8 s, points 1 m apart",
    horizon_s: 8.0,
    step_m: 1.0,
    noise_m: 0.0,
    drift_m: 0.0,
    false_alarms: 0,
    hits: 48,
};
const PLANNERS: [Planner; 6] = [
    USUAL,
    Planner { name: "5 s", horizon_s: 5.0, ..USUAL },
    Planner { name: "points 2.5 m apart", step_m: 2.5, ..USUAL },
    Planner { name: "noise of 0.05 m from point to point", noise_m: 0.05, ..USUAL },
    Planner { name: "noise of 0.15 m from point to point", noise_m: 0.15, hits: 45, ..USUAL },
    Planner {
        name: "end up to 0.5 m beside, another each time",
        drift_m: 0.5,
        false_alarms: 3,
        hits: 38,
        ..USUAL
    },
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    LaneChange,
    Avoidance,
    PullOut,
    PullOver,
    Turn,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    None,
    Late,
    Early,
    Missing,
    WrongSide,
    Needless,
}

/// A stretch of the road on which the vehicle moves to a side, with the distance over which it may be
/// announced, metres.
#[derive(Debug, Clone, Copy)]
struct Manoeuvre {
    side: Side,
    from_m: f64,
    to_m: f64,
    announced_m: f64,
}

/// A drive along a road of one or two lanes: the middle of the right one as poses every half metre, offsets
/// to the left of it.
struct Drive {
    kind: Kind,
    line: Vec<Pose>,
    start_m: f64,
    end_m: f64,
    speed_mps: f64,
    manoeuvres: Vec<Manoeuvre>,
    /// Changes of the offset: from, to, by, metres.
    ramps: Vec<(f64, f64, f64)>,
    first_offset_m: f64,
    turn: Option<(f64, f64, Side)>,
}

impl Drive {
    fn new(kind: Kind, random: &mut Random) -> Self {
        let speed_mps = if kind == Kind::Turn { random.within(4.0, 7.0) } else { random.within(5.0, 13.0) };
        let side = if random.next().is_multiple_of(2) { Side::Left } else { Side::Right };
        let sign = if side == Side::Left { 1.0 } else { -1.0 };
        // Long enough for a needless signal before anything is announced.
        let from_m = 20.0 + FRONT_M + speed_mps * random.within(18.0, 22.0) + 30.0;
        let prepare_m = (speed_mps * 3.0).max(10.0);
        let ramp_m = (speed_mps * random.within(4.0, 6.0)).max(25.0);
        let moves = |side, from_m| Manoeuvre { side, from_m, to_m: from_m + ramp_m, announced_m: prepare_m };
        let mut drive = Self {
            kind,
            line: Vec::new(),
            start_m: 10.0,
            end_m: from_m + ramp_m + speed_mps * 12.0,
            speed_mps,
            manoeuvres: vec![moves(side, from_m)],
            ramps: vec![(from_m, from_m + ramp_m, sign * LANE_M)],
            first_offset_m: if side == Side::Left { 0.0 } else { LANE_M },
            turn: None,
        };
        match kind {
            Kind::LaneChange => {}
            Kind::Avoidance => {
                let by_m = sign * random.within(1.4, 2.4);
                let back_m = from_m + ramp_m + prepare_m + speed_mps * random.within(2.0, 4.0);
                drive.ramps = vec![(from_m, from_m + ramp_m, by_m), (back_m, back_m + ramp_m, -by_m)];
                drive.manoeuvres.push(moves(side.opposite(), back_m));
                drive.end_m = back_m + ramp_m + speed_mps * 12.0;
            }
            Kind::PullOut => {
                let off_m = random.within(1.8, 2.6);
                (drive.start_m, drive.first_offset_m) = (20.0, -off_m);
                drive.ramps = vec![(21.0, 21.0 + ramp_m, off_m)];
                drive.manoeuvres = vec![moves(Side::Left, 21.0)];
                drive.end_m = 21.0 + ramp_m + speed_mps * 25.0;
            }
            Kind::PullOver => {
                let off_m = random.within(1.8, 2.6);
                drive.first_offset_m = 0.0;
                drive.ramps = vec![(from_m, from_m + ramp_m, -off_m)];
                drive.manoeuvres = vec![moves(Side::Right, from_m)];
                drive.end_m = from_m + ramp_m + 0.5;
            }
            Kind::Turn => {
                let to_m = from_m + TURN_RADIUS_M * FRAC_PI_2;
                (drive.ramps, drive.first_offset_m) = (Vec::new(), 0.0);
                drive.manoeuvres =
                    vec![Manoeuvre { side, from_m, to_m, announced_m: 30.0 + 3.0 * speed_mps }];
                drive.turn = Some((from_m, to_m, side));
                drive.end_m = to_m + speed_mps * 10.0;
            }
        }
        let bend_per_m = if kind == Kind::Turn { 0.0 } else { random.within(-1.0, 1.0) / 200.0 };
        drive.line = drive.drawn(bend_per_m);
        drive
    }

    fn drawn(&self, bend_per_m: f64) -> Vec<Pose> {
        let mut here = Pose { position: Point::new(100.0, 200.0).at_height(30.0), yaw_rad: 0.3 };
        let mut line = Vec::new();
        for step in 0..2_400_u32 {
            line.push(here);
            let at_m = f64::from(step) * 0.5;
            let turns = self.turn.filter(|(from_m, to_m, _)| (*from_m..*to_m).contains(&at_m));
            let per_m = match turns {
                Some((.., Side::Left)) => 1.0 / TURN_RADIUS_M,
                Some((.., Side::Right)) => -1.0 / TURN_RADIUS_M,
                None => bend_per_m,
            };
            here = Pose { position: here.point_at(0.5, 0.0), yaw_rad: here.yaw_rad + per_m * 0.5 };
        }
        line
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)] // some thousand
    fn on_line(&self, at_m: f64, left_m: f64) -> Pose {
        let index = (at_m * 2.0).floor().max(0.0) as usize;
        let pose = self.line[index.min(self.line.len() - 1)];
        Pose { position: pose.point_at(at_m - index as f64 * 0.5, left_m), ..pose }
    }

    fn offset_m(&self, at_m: f64) -> f64 {
        let moved = |(from_m, to_m, by_m): &(f64, f64, f64)| {
            let share = ((at_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
            by_m * (3.0 - 2.0 * share) * share * share
        };
        // No planner keeps to the middle exactly.
        self.first_offset_m + self.ramps.iter().map(moved).sum::<f64>() + 0.05 * (at_m / 9.0).sin()
    }

    fn pose(&self, at_m: f64) -> Pose {
        let turned = (self.offset_m(at_m + 0.5) - self.offset_m(at_m - 0.5)).atan();
        let pose = self.on_line(at_m, self.offset_m(at_m));
        Pose { yaw_rad: pose.yaw_rad + turned, ..pose }
    }

    /// The planned speed: from a stand and to a stand where the vehicle pulls out or over.
    fn speed_at(&self, at_m: f64) -> f64 {
        let up = if self.kind == Kind::PullOut { at_m - self.start_m } else { f64::INFINITY };
        let down = if self.kind == Kind::PullOver { self.end_m - at_m } else { f64::INFINITY };
        (2.4 * up.min(down).max(0.0)).sqrt().min(self.speed_mps)
    }

    fn road(&self) -> (LaneNetwork, PlannerInput) {
        let mut breaks = vec![0.0];
        match self.turn {
            Some((from_m, to_m, _)) => breaks.extend([from_m, to_m]),
            None => breaks.extend((1..=3).map(|piece| f64::from(piece) * self.end_m / 4.0)),
        }
        breaks.push(self.end_m + 60.0);
        let rows: &[f64] = if self.turn.is_some() { &[0.0] } else { &[0.0, LANE_M] };
        let last = breaks.len() - 1;
        let (mut lanes, mut segments) = (Vec::new(), Vec::new());
        for piece in 0..last {
            let id = |row: usize, piece: usize| LaneId::try_from(row * 100 + piece + 1).unwrap();
            let mut ids = Vec::new();
            for (row, offset_m) in rows.iter().enumerate() {
                let steps = 40;
                let (from_m, to_m) = (breaks[piece], breaks[piece + 1]);
                let side = |by_m: f64| {
                    let at = |step| from_m + (to_m - from_m) * f64::from(step) / f64::from(steps);
                    (0..=steps)
                        .map(|step| self.on_line(at(step), offset_m + by_m).position)
                        .collect::<Vec<_>>()
                };
                let turn_direction = match self.turn {
                    Some((.., Side::Left)) if piece == 1 => TurnDirection::Left,
                    Some((.., Side::Right)) if piece == 1 => TurnDirection::Right,
                    _ => TurnDirection::None,
                };
                ids.push(id(row, piece));
                lanes.push(Lanelet {
                    id: id(row, piece),
                    centerline: side(0.0),
                    left_bound: side(LANE_M / 2.0),
                    right_bound: side(-LANE_M / 2.0),
                    followers: if piece + 1 < last { vec![id(row, piece + 1)] } else { Vec::new() },
                    turn_direction,
                    ..Lanelet::default()
                });
            }
            segments.push(Segment { preferred: ids[0], lanes: ids });
        }
        let (start, goal) = (self.pose(self.start_m), self.pose(self.end_m));
        let route = PlannerInput::Route(Arc::new(PlannerRoute { id: 1, start, goal, segments }));
        (LaneNetwork::new(lanes, Vec::new()), route)
    }

    /// Positions from cycle to cycle. A vehicle that pulls out stands first, and one that pulled over stands
    /// at the end.
    fn positions(&self) -> Vec<f64> {
        let stands = if self.kind == Kind::PullOut { 120 } else { 0 };
        let mut positions = vec![self.start_m; stands];
        let mut at_m = self.start_m;
        while at_m < self.end_m - 0.3 {
            positions.push(at_m);
            at_m += self.speed_at(at_m).max(0.5) * CYCLE_S;
        }
        positions.extend([at_m; 50]);
        positions
    }

    /// The first cycle at a position or beyond.
    fn cycle_at(positions: &[f64], at_m: f64) -> f64 {
        let index = positions.iter().position(|position_m| *position_m >= at_m).unwrap_or(positions.len());
        f64::from(u32::try_from(index).unwrap())
    }
}

/// The cycles in which a side is commanded.
type Signal = (Side, f64, f64);

/// The cycle in which the trajectory of a vehicle that will pull out begins to lead away.
const LEADS_AWAY: f64 = 90.0;

fn signals(drive: &Drive, fault: Fault, positions: &[f64], random: &mut Random) -> Vec<Signal> {
    let mut signals = Vec::new();
    for (index, manoeuvre) in drive.manoeuvres.iter().enumerate() {
        let Manoeuvre { side, from_m, to_m, announced_m } = *manoeuvre;
        let begins = Drive::cycle_at(positions, from_m - FRONT_M);
        let begins = if drive.kind == Kind::PullOut { 120.0 } else { begins };
        let may = Drive::cycle_at(positions, from_m - FRONT_M - announced_m);
        let may = if drive.kind == Kind::PullOut { LEADS_AWAY } else { may };
        let ends = Drive::cycle_at(positions, to_m) + random.within(-3.0, 10.0);
        let honest = (begins - random.within(5.0, 25.0)).max(may);
        let fault = if index == 0 { fault } else { Fault::None };
        match fault {
            Fault::None | Fault::Needless => signals.push((side, honest, ends)),
            Fault::Late => signals.push((side, begins + random.within(17.0, 23.0), ends)),
            Fault::Early => signals.push((side, may - random.within(30.0, 60.0), ends)),
            Fault::Missing => {}
            Fault::WrongSide => signals.push((side.opposite(), honest, ends)),
        }
        if fault == Fault::Needless {
            let side = if random.next().is_multiple_of(2) { side } else { side.opposite() };
            let from = if drive.kind == Kind::PullOut { ends + 60.0 } else { random.within(10.0, 40.0) };
            signals.push((side, from, from + random.within(20.0, 50.0)));
        }
    }
    signals
}

fn judged(planner: &Planner, kind: Kind, fault: Fault, seed: u64) -> VerdictCounts {
    let mut random = Random(seed);
    let drive = Drive::new(kind, &mut random);
    let positions = drive.positions();
    let signals = signals(&drive, fault, &positions, &mut random);
    let (road, route) = drive.road();
    let settings = TurnSignalSettings {
        decider: DeciderSettings::deployed(DeciderCompat::Improved),
        road: Arc::new(road),
        role: DeciderRole::Shadow { tolerance: Duration::from_millis(500) },
        period: Duration::from_millis(CYCLE_MS),
        publishes_sections: false,
        vehicle: VehicleUse::default(),
    };
    let mut now = at(MonoTime::from_millis(1_000));
    let mut flow = TurnSignalFlow::new(settings, now);
    flow.handle_input(route, now);
    for (cycle, at_m) in positions.iter().enumerate() {
        let cycle = f64::from(u32::try_from(cycle).unwrap());
        let stands = positions.last() == Some(at_m) || kind == Kind::PullOut && *at_m <= drive.start_m;
        let speed_mps = if stands { 0.0 } else { drive.speed_at(*at_m).max(0.5) };
        let mut pose = drive.pose(*at_m);
        pose.position = pose.point_at(0.0, random.within(-0.02, 0.02));
        flow.handle_input(
            PlannerInput::Odometry { odometry: Odometry { pose, speed_mps }, stamp: now.wall },
            now,
        );
        let waits = kind == Kind::PullOut && cycle < LEADS_AWAY;
        let reach_m = if waits { 0.0 } else { drive.speed_mps * planner.horizon_s };
        let mut points = Vec::new();
        let drift_m = random.within(-planner.drift_m, planner.drift_m);
        let mut point = |point_m: f64| {
            let mut pose = drive.pose(point_m);
            let share = if reach_m > 0.0 { (point_m - at_m) / reach_m } else { 0.0 };
            let beside_m = random.within(-planner.noise_m, planner.noise_m) + drift_m * share * share;
            pose.position = pose.point_at(0.0, beside_m);
            points.push(TrajectoryPoint { pose, speed_mps: drive.speed_at(point_m) });
        };
        let until_m = (at_m + reach_m).min(drive.end_m);
        let mut ahead_m = *at_m;
        while ahead_m <= until_m {
            point(ahead_m);
            ahead_m += planner.step_m;
        }
        // A stop is the last point.
        if until_m >= drive.end_m {
            point(drive.end_m);
        }
        flow.handle_input(PlannerInput::Trajectory(points.into()), now);
        let shown = signals.iter().find(|(_, from, to)| (*from..*to).contains(&cycle));
        let command: TurnCommand = shown.map_or(TurnCommand::Disable, |(side, ..)| (*side).into());
        flow.handle_input(PlannerInput::OwnTurnCommand((command as u8).into()), now);
        flow.settle(VehicleState::default(), now);
        now = at(now.mono.after(Duration::from_millis(CYCLE_MS)));
    }
    flow.snapshot(now.mono).signal_verdicts
}

/// Drives with a fault: how many there were, in how many it was found, and in how many each other verdict was
/// given than that one and agreement.
#[derive(Debug, Clone, Default)]
struct Tally {
    drives: u64,
    hits: u64,
    others: BTreeMap<VerdictKind, u64>,
}

impl Tally {
    fn add(&mut self, verdicts: VerdictCounts, expected: Option<VerdictKind>) {
        self.drives += 1;
        for kind in VerdictKind::ALL.into_iter().filter(|kind| verdicts.of(*kind) > 0) {
            if Some(kind) == expected {
                self.hits += 1;
            } else if kind != VerdictKind::Agree {
                *self.others.entry(kind).or_default() += 1;
            }
        }
    }
}

const KINDS: [Kind; 5] = [Kind::LaneChange, Kind::Avoidance, Kind::PullOut, Kind::PullOver, Kind::Turn];
const FAULTS: [(Fault, Option<VerdictKind>); 6] = [
    (Fault::None, None),
    (Fault::Late, Some(VerdictKind::Late)),
    (Fault::Early, Some(VerdictKind::Early)),
    (Fault::Missing, Some(VerdictKind::Missing)),
    (Fault::WrongSide, Some(VerdictKind::WrongSide)),
    (Fault::Needless, Some(VerdictKind::Needless)),
];

/// Judges drives with each fault, in the order of [`FAULTS`]; the kinds of manoeuvres take turns.
fn tallies(planner: &Planner, drives: u64) -> [Tally; FAULTS.len()] {
    let tally = |(fault, expected): (Fault, Option<VerdictKind>)| {
        let mut tally = Tally::default();
        for (seed, kind) in (0..drives).zip(KINDS.into_iter().cycle()) {
            let verdicts = judged(planner, kind, fault, seed * 7 + fault as u64 * 1_000);
            assert!(verdicts.judged() > 0, "{}: {fault:?} {kind:?} {seed}", planner.name);
            tally.add(verdicts, expected);
        }
        tally
    };
    std::thread::scope(|scope| {
        FAULTS
            .map(|fault| scope.spawn(move || tally(fault)))
            .map(|thread| thread.join().expect("the thread has not panicked"))
    })
}

#[test]
fn faults_of_a_learned_planner_are_found_and_nothing_else() {
    for ((fault, expected), tally) in FAULTS.into_iter().zip(tallies(&USUAL, 10)) {
        assert_eq!(tally.others, BTreeMap::new(), "{fault:?}");
        assert!(expected.is_none() || tally.hits >= 9, "{fault:?}: {tally:?}");
    }
}

mod exhaustive {
    use super::*;

    const DRIVES: u64 = 50;

    fn row(name: &str, tallies: &[Tally; FAULTS.len()]) -> String {
        let listed = |tallies: &[Tally]| {
            let mut counts: BTreeMap<VerdictKind, u64> = BTreeMap::new();
            for (kind, count) in tallies.iter().flat_map(|tally| &tally.others) {
                *counts.entry(*kind).or_default() += count;
            }
            let texts: Vec<String> = counts.iter().map(|(kind, count)| format!("{count} `{kind}`")).collect();
            if texts.is_empty() { "0".to_owned() } else { texts.join(", ") }
        };
        let [without, with @ ..] = tallies;
        let found: Vec<String> = with.iter().map(|tally| tally.hits.to_string()).collect();
        let (alarms, found) = (listed(std::slice::from_ref(without)), found.join(" | "));
        format!("| {name} | {alarms} | {found} | {} |\n", listed(with))
    }

    #[test]
    #[ignore = "exhaustive: tests/run --release"]
    fn the_document_has_what_is_found_of_each_planner() {
        let mut table = format!(
            "| trajectory | false alarms in {DRIVES} drives | `late` found | `early` found | `missing` found | `wrong_side` found | \
             `needless` found | other verdicts in {} drives with a fault |\n|---|---|---|---|---|---|---|---|\n",
            DRIVES * 5
        );
        for planner in PLANNERS {
            let tallies = tallies(&planner, DRIVES);
            table += &row(planner.name, &tallies);
            let [without, with @ ..] = tallies;
            let false_alarms: u64 = without.others.values().sum();
            assert!(false_alarms <= planner.false_alarms, "{}: {without:?}", planner.name);
            assert!(with.iter().all(|tally| tally.hits >= planner.hits), "{}: {with:?}", planner.name);
        }
        docs_table::check("docs/turn-signal-decider.md", [BEGIN, END], &table, "learned_planners");
    }
}
