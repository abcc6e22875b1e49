//! What must hold for every drive by default, and a drive held against it.

use signal_gateway::config::drive::DriveFile;
use signal_gateway::desk::drive::run::DriveRun;
use signal_gateway::desk::drive::simulation::{DriveCycle, DriveSimulation};
use turn_signal::compat::DeciderCompat::{Improved, PathGenerator};
use turn_signal::light_command::TurnCommand;
use turn_signal::resolve::{CandidateSource, Contender};
use turn_signal::side::Side;

use super::path_generator::ReferenceRule;
use super::sections::{FRONT_M, Stretch, lanes, offers, stretches};

/// Ends that differ by more than this belong to two manoeuvres, metres.
const SAME_END_M: f64 = 2.0;
const MINIMUM_ON_S: f64 = 1.5;
/// Nearer to its turn a signal is shown whatever else is on the way: so far it is seen for a minimum time at
/// the highest speed, metres.
const SEEN_M: f64 = 23.0;
const CYCLE_S: f64 = 0.2;

/// One cycle of a drive.
#[derive(Clone, Copy)]
struct Shown {
    at_s: f64,
    at_m: f64,
    side: Option<Side>,
    winner: Option<Contender>,
}

/// A manoeuvre that was signalled: its source, its side, and where its desired and its required section end.
type Signalled = (CandidateSource, Side, [f64; 2]);

impl Shown {
    fn signalled(&self) -> Option<Signalled> {
        let winner = self.winner.filter(|winner| Some(winner.side) == self.side)?;
        let ends_m = [winner.distances.desired_end_m, winner.distances.required_end_m];
        Some((winner.source, winner.side, ends_m.map(|end_m| self.at_m + end_m)))
    }
}

fn driven(simulation: &DriveSimulation) -> Vec<Shown> {
    let mut run = DriveRun::new(simulation, Improved);
    let shown = |cycle: DriveCycle| {
        let decision = run.step(&cycle);
        let winner = decision.resolution().and_then(|resolution| resolution.winner);
        assert_ne!(decision.turn, TurnCommand::NoCommand, "at {} m", cycle.at_m);
        Shown { at_s: cycle.at_s, at_m: cycle.at_m, side: decision.turn.side(), winner }
    };
    simulation.cycles().map(shown).collect()
}

/// The first law that the drive breaks.
pub(super) fn broken(simulation: &DriveSimulation) -> Option<String> {
    let (stretches, shown) = (stretches(simulation.file()), driven(simulation));
    required_sections(&stretches, &shown)
        .or_else(|| durations(&stretches, &shown))
        .or_else(|| signalled_once(&shown))
        .or_else(|| misleading(simulation.file(), &shown))
}

/// The first cycle in which the path generator's command is not that of its rule.
pub(super) fn of_path_generator(simulation: &DriveSimulation) -> Option<String> {
    let settings = &simulation.file().decider;
    let front_m = settings.vehicle.front_m();
    let mut rule = ReferenceRule::new(simulation.road(), &settings.parameters, front_m);
    let mut run = DriveRun::new(simulation, PathGenerator);
    simulation.cycles().find_map(|cycle| {
        let shown = run.step(&cycle).turn;
        let expected = rule.command(&cycle.route, cycle.odometry?)?;
        (shown != expected)
            .then(|| format!("path_generator: {shown:?} at {:.2} m, not {expected:?}", cycle.at_m))
    })
}

/// In a required section its side is shown, or that of another one there; never none.
fn required_sections(stretches: &[Stretch], shown: &[Shown]) -> Option<String> {
    for Shown { at_m, side, .. } in shown {
        let Some(required) = stretches.iter().find(|stretch| stretch.requires_at(*at_m)) else { continue };
        let mut allowed = stretches.iter().filter(|stretch| stretch.may_require_at(*at_m));
        if !allowed.any(|stretch| Some(stretch.side) == *side) {
            return Some(format!("required: {side:?} at {at_m:.2} m, in {required:?}"));
        }
    }
    None
}

/// A side is shown for a minimum time unless another is required, and no longer than it is wanted or for that
/// time.
fn durations(stretches: &[Stretch], shown: &[Shown]) -> Option<String> {
    let mut since_s = 0.0;
    let mut wanted_s = 0.0;
    for pair in shown.windows(2) {
        let [before, now] = pair else { continue };
        if now.side != before.side {
            let lasted_s = now.at_s - since_s;
            let of_next = stretches.iter().filter(|stretch| Some(stretch.side) == now.side);
            let is_urgent = of_next.into_iter().any(|stretch| stretch.may_require_at(now.at_m));
            if before.side.is_some() && lasted_s < MINIMUM_ON_S - 1e-6 && !is_urgent {
                return Some(format!("short: {:?} for {lasted_s:.1} s to {:.2} m", before.side, now.at_m));
            }
            since_s = now.at_s;
        }
        let mut of_side = stretches.iter().filter(|stretch| Some(stretch.side) == now.side);
        if now.side.is_none() || of_side.any(|stretch| stretch.may_want_at(now.at_m)) {
            wanted_s = now.at_s;
        }
        if now.at_s - wanted_s > MINIMUM_ON_S + CYCLE_S {
            return Some(format!("long: {:?} at {:.2} m", now.side, now.at_m));
        }
    }
    None
}

/// A turn is not announced before a junction that offers its side and is not taken.
fn misleading(file: &DriveFile, shown: &[Shown]) -> Option<String> {
    let lanes = lanes(file);
    let misleads = |now: &&Shown| {
        let winner = now.winner.filter(|winner| winner.source == CandidateSource::Intersection);
        winner.is_some_and(|winner| {
            let (front_m, ahead_m) = (now.at_m + FRONT_M, winner.distances.required_start_m);
            // A junction at the start of the turn is that of the turn.
            let before_turn = front_m + 0.5..front_m + ahead_m - 0.5;
            now.signalled().is_some()
                && ahead_m > SEEN_M
                && offers(&file.road, &lanes, winner.side, before_turn)
        })
    };
    let now = shown.iter().find(misleads)?;
    Some(format!("misleading: {:?} at {:.2} m", now.side, now.at_m))
}

/// What was signalled comes back only after the other side was shown, and while its required section is not
/// over.
fn signalled_once(shown: &[Shown]) -> Option<String> {
    let is_same = |one: &Signalled, other: &Signalled| {
        let is_near = |end: usize| (one.2[end] - other.2[end]).abs() < SAME_END_M;
        (one.0, one.1) == (other.0, other.1) && is_near(0) && is_near(1)
    };
    // Since the side that is shown came on, and before.
    let (mut present, mut ended): (Vec<Signalled>, Vec<(Signalled, bool)>) = (Vec::new(), Vec::new());
    let mut side = None;
    for now in shown {
        if now.side != side {
            ended.extend(present.drain(..).map(|gone| (gone, false)));
            side = now.side;
        }
        for (_, was_displaced) in ended.iter_mut().filter(|(gone, _)| side.is_some_and(|side| side != gone.1))
        {
            *was_displaced = true;
        }
        let Some(signalled) = now.signalled() else { continue };
        if let Some(index) = ended.iter().position(|(gone, _)| is_same(gone, &signalled)) {
            let (_, was_displaced) = ended.remove(index);
            let is_over = now.winner.is_some_and(|winner| winner.distances.required_end_m < 0.0);
            if !was_displaced || is_over {
                return Some(format!("again: {signalled:?} at {:.2} m", now.at_m));
            }
        }
        if !present.iter().any(|before| is_same(before, &signalled)) {
            present.push(signalled);
        }
    }
    None
}
