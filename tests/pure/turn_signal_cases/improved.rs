//! Improved beside upstream: no return of finished manoeuvres (W4), minimum durations (W2), and equality
//! where neither applies.

use std::collections::BTreeSet;
use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::path::PathFrame;
use lanelet2_map::lane_network::TurnDirection;
use proptest::prelude::*;
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::finished::FinishedMemory;
use turn_signal::light_command::TurnCommand;
use turn_signal::min_duration::{Held, MinDurationFilter, MinDurations};
use turn_signal::resolve::{CandidateOutcome, CandidateSource, Candidates, PairwiseRules, Resolution};
use turn_signal::section::Section;
use turn_signal::side::Side;

use super::conflicts::cases;
use super::drive::{Drive, turn, turn_of};
use super::laws::any_candidates;
use super::line::{NEAREST, at, blinking, line, resolve_at};

const FRONT_M: f64 = 2.0;

/// The rules of the default, nothing finished.
fn improved() -> PairwiseRules {
    PairwiseRules { start_belongs_to_before: true, nested_waits: true, ..PairwiseRules::default() }
}

/// Resolves without what has finished, and notes what has.
fn resolve_and_note(
    memory: &mut FinishedMemory,
    x: f64,
    candidates: &Candidates,
    is_shown: bool,
) -> Resolution {
    let path = line(-20, 140);
    let path_frame = PathFrame::new(&path, at(x), FRONT_M, NEAREST);
    let of = |source| candidates.of(source).map(|section| (source, section));
    let sections: Vec<(CandidateSource, Section)> = CandidateSource::ALL.into_iter().filter_map(of).collect();
    let is_finished =
        |(source, section): &&(CandidateSource, Section)| memory.is_finished(&path_frame, *source, section);
    let finished = sections.iter().filter(is_finished).map(|(source, _)| *source).collect();
    let resolution = resolve_at(x, FRONT_M, candidates, &PairwiseRules { finished, ..improved() });
    let winner = resolution.winner.and_then(|winner| of(winner.source));
    let shown = if is_shown { resolution.signal() } else { TurnCommand::Disable };
    memory.note(&path_frame, &sections, winner.as_ref(), shown);
    resolution
}

/// A whole drive, with the memory of finished manoeuvres as the decider keeps it.
fn signals(candidates: &Candidates) -> Vec<(f64, TurnCommand)> {
    let mut memory = FinishedMemory::default();
    let step = |x: f64| (x, resolve_and_note(&mut memory, x, candidates, true).signal());
    (-40..=480).map(|quarter| f64::from(quarter) / 4.0).map(step).collect()
}

#[test]
fn c2_and_c5_end_off_by_default() {
    for (id, expected) in [
        ("C1", "LEFT -2 to 40, RIGHT 40.25 to 72"),
        ("C2", "LEFT -2 to 40, RIGHT 40.25 to 64"),
        ("C3", "LEFT -2 to 60"),
        ("C3b", "LEFT -2 to 60, RIGHT 60.25 to 72"),
        ("C4", "LEFT -2 to 7.75, RIGHT 8 to 31.75, LEFT 32 to 72"),
        ("C5", "LEFT -2 to 7.75, RIGHT 8 to 31.75, LEFT 32 to 46, RIGHT 46.25 to 66"),
        ("C6", "LEFT -2 to 37.75, RIGHT 38 to 60"),
        ("C7", "LEFT -2 to 7.75, RIGHT 8 to 41.75, LEFT 42 to 80"),
        ("C8", "LEFT -2 to 40, RIGHT 40.25 to 60"),
        ("C9", "LEFT -2 to 80"),
        ("C10", "LEFT -2 to 40, RIGHT 40.25 to 60"),
        ("C11", "RIGHT -2 to 27.75, LEFT 28 to 80"),
        ("T1", "LEFT -2 to 37.75, RIGHT 38 to 57.75, LEFT 58 to 80"),
        ("T2", "LEFT -2 to 7.75, RIGHT 8 to 17.75, LEFT 18 to 37.75, RIGHT 38 to 57.75, LEFT 58 to 90"),
        ("T3", "LEFT -2 to 30, RIGHT 30.25 to 40, LEFT 40.25 to 60"),
    ] {
        let (_, candidates, _) = cases().into_iter().find(|(other, ..)| *other == id).unwrap();
        assert_eq!(blinking(signals(&candidates)), expected, "{id}");
    }
}

#[test]
fn another_manoeuvre_of_the_same_source_may_be_signalled() {
    let (_, c2, _) = cases().into_iter().find(|(id, ..)| *id == "C2").unwrap();
    let after = |is_shown: bool, candidates: &Candidates| {
        let mut memory = FinishedMemory::default();
        for x in [0.0, 30.0, 45.0, 60.0] {
            resolve_and_note(&mut memory, x, &c2, is_shown);
        }
        resolve_and_note(&mut memory, 70.0, candidates, true).signal()
    };
    assert_eq!(after(true, &c2), TurnCommand::Disable);
    assert_eq!(after(false, &c2), TurnCommand::Left, "a side that a minimum duration kept from being shown");
    let mut next = c2;
    next.intersection.as_mut().unwrap().desired_end = at(120.0);
    assert_eq!(after(true, &next), TurnCommand::Left);
}

#[test]
fn a_signal_lasts_and_leaves_a_gap() {
    use TurnCommand::{Disable, Left, NoCommand, Right};
    let mut min_duration = MinDurationFilter::default();
    let time = MonoTime::from_millis;
    let (left, off) = (Some(Held::On(Side::Left)), Some(Held::Off));
    for (ms, requested, signal, held, deadline) in [
        (0, Disable, Disable, None, None),
        (100, Left, Left, None, None),
        (200, Disable, Left, left, Some(1600)),
        (300, Right, Left, left, Some(1600)),
        (1599, NoCommand, Left, left, Some(1600)),
        (1600, Right, Disable, off, Some(2100)),
        (2099, Right, Disable, off, Some(2100)),
        (2100, Right, Right, None, None),
        (9000, Right, Right, None, None),
        (9100, Disable, Disable, None, None),
        (9200, Right, Disable, off, Some(9600)),
        (9600, Right, Right, None, None),
        (11_100, NoCommand, NoCommand, None, None),
    ] {
        let shown = min_duration.show(requested, &[], MinDurations::READABLE, time(ms));
        assert_eq!((shown.signal, shown.held, shown.deadline), (signal, held, deadline.map(time)), "{ms} ms");
    }
    min_duration.show(Left, &[], MinDurations::READABLE, time(12_000));
    min_duration.force_off(time(12_100));
    assert_eq!(
        min_duration.show(Left, &[], MinDurations::READABLE, time(12_200)).held,
        off,
        "switched off early, and the gap is kept"
    );
}

#[test]
fn a_required_section_is_signalled_at_once() {
    use TurnCommand::{Disable, Left, Right};
    let mut min_duration = MinDurationFilter::default();
    let left = Some(Held::On(Side::Left));
    let (on_the_left, on_the_right): (&[Side], &[Side]) = (&[Side::Left], &[Side::Right]);
    for (ms, requested, required, signal, held) in [
        (0, Left, &[][..], Left, None),
        (100, Right, &[], Left, left),
        (150, Right, on_the_left, Left, left),
        (200, Right, on_the_right, Right, None),
        (300, Disable, on_the_right, Right, Some(Held::On(Side::Right))),
        (1700, Disable, &[], Disable, None),
        (1800, Left, &[], Disable, Some(Held::Off)),
        (1900, Left, on_the_left, Left, None),
        // Never dark while anything is required.
        (3500, Right, &[], Disable, Some(Held::Off)),
        (3600, Right, on_the_left, Right, None),
    ] {
        let shown = min_duration.show(requested, required, MinDurations::READABLE, MonoTime::from_millis(ms));
        assert_eq!((shown.signal, shown.held), (signal, held), "{ms} ms");
    }
}

fn any_request() -> impl Strategy<Value = TurnCommand> {
    use TurnCommand::{Disable, Left, NoCommand, Right};
    prop_oneof![Just(Disable), Just(NoCommand), Just(Left), Just(Right)]
}

/// Runs of one signal, each with its first and last instant.
fn runs(shown: &[(u64, TurnCommand)]) -> Vec<(TurnCommand, u64, u64)> {
    let mut runs: Vec<(TurnCommand, u64, u64)> = Vec::new();
    for (ms, signal) in shown {
        match runs.last_mut() {
            Some((same, _, last)) if same.side() == signal.side() => *last = *ms,
            _ => runs.push((*signal, *ms, *ms)),
        }
    }
    runs
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn signals_and_gaps_keep_their_minimum_durations(requests in proptest::collection::vec((1..700_u64, any_request()), 1..60)) {
        let (mut min_duration, mut now, mut shown) = (MinDurationFilter::default(), 0, Vec::new());
        for (pause, request) in requests {
            now += pause;
            shown.push((now, min_duration.show(request, &[], MinDurations::READABLE, MonoTime::from_millis(now)).signal));
        }
        let runs = runs(&shown);
        for pair in runs.windows(2) {
            let [(signal, from, _), (next, until, _)] = pair else { unreachable!() };
            let least = if signal.side().is_some() { 1500 } else { 500 };
            // The first run of all may be off for any time.
            prop_assert!(until - from >= least || *from == runs[0].1 && signal.side().is_none(), "{runs:?}");
            let sides = (signal.side(), next.side());
            prop_assert!(sides.0.is_none() || sides.1.is_none(), "from side to side without a gap: {runs:?}");
        }
    }

    #[test]
    fn a_request_that_lasts_is_shown(request in any_request(), before in any_request()) {
        let mut min_duration = MinDurationFilter::default();
        min_duration.show(before, &[], MinDurations::READABLE, MonoTime::from_millis(10));
        // A side that must stay, the gap after it, and then the request.
        min_duration.show(request, &[], MinDurations::READABLE, MonoTime::from_millis(1510));
        let shown = min_duration.show(request, &[], MinDurations::READABLE, MonoTime::from_millis(2010));
        prop_assert_eq!((shown.signal, shown.held), (request, None));
    }
}

/// A drive whose records come and go at random, through the whole decider.
fn drive_randomly(compat: DeciderCompat, steps: &[(u64, Candidates)]) -> Vec<(u64, TurnCommand, bool)> {
    let mut drive = Drive::new(compat);
    let mut ms = 0;
    let mut shown = Vec::new();
    for (at, (pause, candidates)) in (0_u32..).zip(steps) {
        ms += pause;
        drive.wait(Duration::from_millis(*pause));
        // Lanelets anywhere: the turns are new ones each time.
        drive.observed.turns = [candidates.intersection, candidates.manoeuvre]
            .iter()
            .flatten()
            .zip(0..)
            .map(|(record, id)| turn_of(record, i64::from(at / 3) * 10 + id))
            .collect();
        let decision = drive.step(f64::from(at), 8.0, &[]);
        let winner = decision.resolution().and_then(|resolution| resolution.winner);
        shown.push((ms, decision.turn, winner.is_some_and(|winner| winner.distances.are_required())));
    }
    shown
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Where no signal returns and no front is exactly at a start, memory and resolver change nothing.
    #[test]
    fn without_a_return_the_default_is_upstream(candidates in any_candidates()) {
        let upstream: Vec<(f64, TurnCommand)> = (-40..=480)
            .map(|quarter| f64::from(quarter) / 4.0)
            .map(|x| (x, resolve_at(x, FRONT_M, &candidates, &improved())))
            .map(|(x, resolution)| (x, resolution.signal()))
            .collect();
        let default = signals(&candidates);
        for ((x, one), (_, other)) in upstream.iter().zip(&default) {
            if one != other {
                // Only a contender whose required section is over can make the difference: by
                // winning, or among three by deciding whom it is compared with.
                let resolution = resolve_at(*x, FRONT_M, &candidates, &PairwiseRules::default());
                let over = resolution.evaluated.iter().any(|evaluated| {
                    let contends = matches!(evaluated.outcome, CandidateOutcome::Won | CandidateOutcome::LostTo { .. });
                    contends && evaluated.distances.is_some_and(|d| d.required_end_m < 0.0)
                });
                prop_assert!(over, "{x}: {one} {other}");
            }
        }
    }

    #[test]
    fn the_decider_never_flaps_by_default(
        steps in proptest::collection::vec((20..400_u64, any_candidates()), 1..60),
    ) {
        let shown = drive_randomly(Improved, &steps);
        let required: BTreeSet<u64> = shown.iter().filter(|shown| shown.2).map(|shown| shown.0).collect();
        let runs = runs(&shown.iter().map(|(ms, signal, _)| (*ms, *signal)).collect::<Vec<_>>());
        for pair in runs.windows(2) {
            let [(signal, from, _), (next, until, _)] = pair else { unreachable!() };
            // Only what is required comes before the minimum durations.
            let is_urgent = next.side().is_some() && required.contains(until);
            prop_assert!(signal.side().is_none() || until - from >= 1500 || is_urgent, "{runs:?}");
            prop_assert!(signal.side().is_none() || next.side().is_none() || is_urgent, "{runs:?}");
        }
        // Upstream's does: it decides every sample alone.
        prop_assert_eq!(drive_randomly(Upstream, &steps).len(), steps.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// One turn, or two to the same side, at a speed that does not fall: no weakness applies.
    #[test]
    fn at_a_constant_speed_improved_and_upstream_signal_turns_alike(
        start in 20..120_i32, length in 5..40_i32, gap in 0..30_i32, second in any::<bool>(),
        speed in 2.0..16.0_f64, left in any::<bool>(),
    ) {
        let direction = if left { TurnDirection::Left } else { TurnDirection::Right };
        let stretch = |id, from: i32| {
            let (from, to) = (f64::from(from), f64::from(from + length));
            turn(id, direction, from, to, to - 2.0)
        };
        let drive = |compat| {
            let mut drive = Drive::new(compat);
            drive.observed.turns = vec![stretch(5, start)];
            if second {
                drive.observed.turns.push(stretch(6, start + length + gap));
            }
            drive.through((-50..=250).map(f64::from), speed, |_| Vec::new())
        };
        prop_assert_eq!(drive(Upstream), drive(Improved));
    }
}
