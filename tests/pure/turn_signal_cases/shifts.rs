//! docs/spec/turn-signal-decider.md, "Shift rule": the rule for all that moves sideways, step by step; S1 to
//! S11; P-1.

use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, Roadside};
use turn_signal::compat::DeciderCompat::Upstream;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::shift::ShiftVerdict::{
    HatchedSide, NearBound, NearlyDone, OffPath, Signalled, StandsBeforeReturn, StaysInLane,
    SwervingIsSilent, TooEarly, TooSmall,
};
use turn_signal::shift::{Shift, ShiftKind, ShiftLine, ShiftOutcome, ShiftVerdict, ShiftedPath, judge};

use super::drive::{Drive, straight_lane};

/// A path along x from 0 to 200, a point every metre, whose offset goes from one value to another.
pub(crate) fn ramp(start: usize, end: usize, before_m: f64, after_m: f64) -> ShiftedPath {
    #[allow(clippy::cast_precision_loss)]
    let offsets: Vec<f64> = (0..=200)
        .map(|x: usize| {
            let share = (x.clamp(start, end) - start) as f64 / (end - start) as f64;
            before_m + (after_m - before_m) * share
        })
        .collect();
    let poses = (0..=200_i32).zip(&offsets).map(|(x, y)| Pose::new(f64::from(x), *y, 0.0)).collect();
    ShiftedPath::new(poses, offsets).unwrap()
}

pub(crate) fn line_of(path: &ShiftedPath, start_index: usize, end_index: usize) -> ShiftLine {
    ShiftLine { start_index, end_index, start: path.poses()[start_index], end: path.poses()[end_index] }
}

/// A shift with its circumstances, to be judged.
#[derive(Clone)]
struct Judged {
    shift: (f64, f64),
    range: (usize, usize),
    ego: Pose,
    speed_mps: f64,
    current_m: f64,
    kind: ShiftKind,
    forward: bool,
    stop_override: bool,
    swerving: bool,
    half_width_m: f64,
    left: Roadside,
    right: Roadside,
}

fn outgoing(x: f64, speed_mps: f64, current_m: f64) -> Judged {
    Judged {
        shift: (0.0, 1.5),
        range: (50, 80),
        ego: Pose::new(x, current_m, 0.0),
        speed_mps,
        current_m,
        kind: ShiftKind::Avoidance,
        forward: true,
        stop_override: false,
        swerving: true,
        half_width_m: 1.75,
        left: Roadside { hatched: false, lane: true },
        right: Roadside { hatched: false, lane: true },
    }
}

fn returning(x: f64, speed_mps: f64, current_m: f64) -> Judged {
    Judged { shift: (1.5, 0.0), range: (100, 130), ..outgoing(x, speed_mps, current_m) }
}

impl Judged {
    fn outcome(&self) -> ShiftOutcome {
        let mut drive = Drive::new(Upstream);
        let mut lane = Lanelet { left: self.left, right: self.right, ..straight_lane(1, -60.0, 300.0) };
        for (bound, sign) in [(&mut lane.left_bound, 1.0), (&mut lane.right_bound, -1.0)] {
            for point in bound.iter_mut() {
                point.y_m = sign * self.half_width_m;
            }
        }
        drive.road = LaneNetwork::new([lane], Vec::new());
        drive.parameters.on_swerving = self.swerving;
        let path = ramp(self.range.0, self.range.1, self.shift.0, self.shift.1);
        let shift = Shift {
            path: &path,
            line: line_of(&path, self.range.0, self.range.1),
            lanes: &[1],
            current_shift_m: self.current_m,
            kind: self.kind,
            forward: self.forward,
            stop_override: self.stop_override,
            nears_junction: false,
            is_announced: false,
        };
        judge(&drive.context(self.ego, self.speed_mps), &shift)
    }

    fn verdict(&self) -> (ShiftVerdict, TurnCommand) {
        let outcome = self.outcome();
        (outcome.verdict, outcome.section.turn)
    }
}

#[test]
fn the_listed_positions_give_the_listed_records() {
    use TurnCommand::{Left, NoCommand, Right};
    let cases = [
        // what, outcome, command, D and R start, ignored
        ("out 22.2", outgoing(22.2, 8.0, 0.0), TooEarly, NoCommand, None),
        ("out 22.3", outgoing(22.3, 8.0, 0.0), Signalled, Left, Some((22.3, 50.0, 80.0))),
        ("out 46.0", outgoing(46.0, 8.0, 0.0), Signalled, Left, Some((46.0, 50.0, 80.0))),
        ("out 46.3", outgoing(46.3, 8.0, 0.0), Signalled, Left, Some((50.0, 50.0, 80.0))),
        ("out 78", outgoing(78.0, 8.0, 1.39), Signalled, Left, Some((50.0, 50.0, 80.0))),
        ("out 79", outgoing(79.0, 8.0, 1.41), NearlyDone, NoCommand, None),
        ("out 36.2", outgoing(36.2, 2.0, 0.0), TooEarly, NoCommand, None),
        ("out 36.3", outgoing(36.3, 2.0, 0.0), Signalled, Left, Some((36.3, 50.0, 80.0))),
        ("back 72.1", returning(72.1, 8.0, 1.5), TooEarly, NoCommand, None),
        ("back 72.3", returning(72.3, 8.0, 1.5), Signalled, Right, Some((72.3, 100.0, 130.0))),
        ("back 96.3", returning(96.3, 8.0, 1.5), Signalled, Right, Some((100.0, 100.0, 130.0))),
        ("back, 0.09 left", returning(128.0, 8.0, 0.09), NearlyDone, NoCommand, None),
    ];
    for (what, judged, verdict, turn, positions) in cases {
        let outcome = judged.outcome();
        assert_eq!((outcome.verdict, outcome.section.turn), (verdict, turn), "{what}");
        assert_eq!(outcome.ignore(), verdict == NearlyDone, "{what}");
        if let Some((desired, start, end)) = positions {
            let section = outcome.section;
            let xs =
                [section.desired_start, section.required_start, section.desired_end, section.required_end]
                    .map(|pose| pose.position.x_m);
            assert_eq!(xs, [desired, start, end, end], "{what}");
        }
    }
}

#[test]
fn s1_to_s11() {
    use TurnCommand::{Left, NoCommand, Right};
    let at_48 = || outgoing(48.0, 8.0, 0.0);
    let hatched = Roadside { hatched: true, lane: false };
    let narrow = |judged: Judged| Judged { half_width_m: 1.0, ..judged };
    let s4 = || Judged { half_width_m: 5.0, ..at_48() };
    let s9 = || returning(98.0, 0.05, 1.5);
    for (id, judged, verdict, turn) in [
        ("S1", narrow(Judged { shift: (0.0, 0.29), ..at_48() }), TooSmall, NoCommand),
        ("S2", narrow(Judged { shift: (0.0, 0.30), ..at_48() }), Signalled, Left),
        ("S3", narrow(Judged { shift: (0.0, -0.30), ..at_48() }), Signalled, Right),
        ("S4", s4(), StaysInLane, NoCommand),
        ("S5 pull over", Judged { kind: ShiftKind::PullOver, ..s4() }, Signalled, Left),
        ("S5 pull out", Judged { kind: ShiftKind::PullOut, ..s4() }, Signalled, Left),
        ("S6", Judged { swerving: false, ..at_48() }, SwervingIsSilent, NoCommand),
        ("S7", Judged { left: hatched, ..at_48() }, HatchedSide, NoCommand),
        ("S8", Judged { left: Roadside { lane: true, ..hatched }, ..at_48() }, Signalled, Left),
        ("S9", s9(), StandsBeforeReturn, NoCommand),
        ("S10", Judged { stop_override: true, ..s9() }, Signalled, Right),
        ("S11", Judged { speed_mps: 0.1, ..s9() }, Signalled, Right),
    ] {
        assert_eq!(judged.verdict(), (verdict, turn), "{id}");
    }
}

#[test]
fn hatched_markings_forbid_by_class_and_side() {
    let hatched = Roadside { hatched: true, lane: false };
    let free = Roadside { hatched: false, lane: false };
    for (what, shift, current, left, right, forbidden) in [
        ("avoiding right over it", (0.0, -1.5), 0.0, free, hatched, true),
        ("avoiding right, it is left", (0.0, -1.5), 0.0, hatched, free, false),
        ("back from the left", (1.5, 0.0), 1.5, hatched, free, true),
        ("back from the left, it is right", (1.5, 0.0), 1.5, free, hatched, false),
        ("back from the right", (-1.5, 0.0), -1.5, free, hatched, true),
        ("farther left", (1.0, 2.0), 1.0, hatched, free, true),
        ("less far left", (2.0, 1.0), 2.0, hatched, free, true),
        ("farther right", (-1.0, -2.0), -1.0, free, hatched, true),
        ("no lane either, but not hatched", (0.0, 1.5), 0.0, free, free, false),
    ] {
        let judged = Judged { shift, left, right, ..outgoing(48.0, 8.0, current) };
        assert_eq!(judged.verdict().0 == HatchedSide, forbidden, "{what}: {:?}", judged.verdict());
        let pulling = Judged { kind: ShiftKind::PullOver, ..judged };
        assert_ne!(pulling.verdict().0, HatchedSide, "{what}: only when avoiding");
    }
}

#[test]
fn p1_pulling_out_ends_near_the_far_bound() {
    for (y, verdict, turn) in [
        (2.0, Signalled, TurnCommand::Right),
        (0.499, Signalled, TurnCommand::Right),
        (0.497, NearBound, TurnCommand::NoCommand),
        (0.2, NearBound, TurnCommand::NoCommand),
        (0.09, NearlyDone, TurnCommand::NoCommand),
    ] {
        let judged = Judged {
            shift: (2.0, 0.0),
            range: (10, 40),
            ego: Pose::new(20.0, y, 0.0),
            current_m: y,
            kind: ShiftKind::PullOut,
            ..outgoing(20.0, 4.0, y)
        };
        assert_eq!(judged.verdict(), (verdict, turn), "P-1 at {y}");
        assert_eq!(judged.outcome().ignore(), verdict != Signalled);
        let wide = Judged { half_width_m: 5.0, ..judged };
        assert_ne!(wide.verdict().0, NearBound, "a wide lane never fires (W15)");
    }
}

#[test]
fn backwards_is_hazard_lights_and_lines_off_the_path_are_nothing() {
    let back = Judged { forward: false, ..outgoing(48.0, -1.0, 0.0) }.outcome();
    assert_eq!((back.section.turn, back.section.hazard), (TurnCommand::NoCommand, HazardCommand::Enable));
    assert_eq!(back.section.required_start, Pose::new(-50.0, 0.0, 0.0), "the start of the route");
    let drive = Drive::new(Upstream);
    let path = ramp(50, 80, 0.0, 1.5);
    for (start_index, end_index) in [(201, 80), (50, 201), (usize::MAX, usize::MAX)] {
        let shift = Shift {
            path: &path,
            line: ShiftLine { start_index, end_index, ..line_of(&path, 50, 80) },
            lanes: &[1],
            current_shift_m: 0.0,
            kind: ShiftKind::Avoidance,
            forward: true,
            stop_override: false,
            nears_junction: false,
            is_announced: false,
        };
        let outcome = judge(&drive.context(Pose::new(48.0, 0.0, 0.0), 8.0), &shift);
        assert_eq!((outcome.verdict, outcome.ignore()), (OffPath, true));
    }
}

#[test]
fn offsets_that_are_not_numbers_are_not_signalled() {
    for judged in [
        Judged { shift: (0.0, 1.5), current_m: f64::NAN, ..outgoing(48.0, 8.0, 0.0) },
        Judged { current_m: f64::INFINITY, shift: (0.0, 0.1), ..outgoing(48.0, 8.0, 0.0) },
    ] {
        assert_eq!(judged.verdict().1, TurnCommand::NoCommand);
    }
}
