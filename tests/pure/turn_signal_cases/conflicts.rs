//! docs/spec/turn-signal-decider.md, "Conflict patterns": conflicts of two and three records over a whole drive,
//! improved and as upstream.

use signal_gateway::core::light_command::TurnCommand;
use signal_gateway::core::turn_signal::resolve::{
    CandidateOutcome, CandidateSource, Candidates, Case, PairwiseRules,
};
use signal_gateway::core::turn_signal::section::Section;
use signal_gateway::core::turn_signal::side::Side::{self, Left, Right};

use super::line::{record, resolve_at};

const FRONT_M: f64 = 2.0;

fn pair(p: Section, q: Section) -> Candidates {
    Candidates { intersection: Some(p), manoeuvre: Some(q), ..Candidates::default() }
}

/// A side with the stretch it is signalled on: start, with the start itself, end, with the end itself.
pub(crate) type Stretch = (Side, f64, bool, f64, bool);

/// A stretch with both ends.
const fn closed(side: Side, from: f64, to: f64) -> Stretch {
    (side, from, true, to, true)
}
/// A stretch without its end.
const fn until(side: Side, from: f64, to: f64) -> Stretch {
    (side, from, true, to, false)
}
/// A stretch without its start.
const fn after(side: Side, from: f64, to: f64) -> Stretch {
    (side, from, false, to, true)
}

fn expected_at(stretches: &[Stretch], x: f64) -> TurnCommand {
    let within = |(_, from, with_from, to, with_to): &&Stretch| {
        (x > *from || *with_from && x == *from) && (x < *to || *with_to && x == *to)
    };
    stretches.iter().find(within).map_or(TurnCommand::Disable, |(side, ..)| (*side).into())
}

fn check(id: &str, candidates: &Candidates, stretches: &[Stretch], rules: &PairwiseRules) {
    // Quarters are exact, so that boundaries are met and just missed.
    for x in (-40..=480).map(|quarter| f64::from(quarter) / 4.0) {
        let got = resolve_at(x, FRONT_M, candidates, rules);
        assert_eq!(got.signal(), expected_at(stretches, x), "{id} at {x}: {:?}", got.evaluated);
    }
}

fn left(desired: [f64; 2], required: [f64; 2]) -> Section {
    record(Left, desired, required)
}
fn right(desired: [f64; 2], required: [f64; 2]) -> Section {
    record(Right, desired, required)
}

pub(crate) fn cases() -> Vec<(&'static str, Candidates, Vec<Stretch>)> {
    vec![
        (
            "C1",
            pair(left([0.0, 60.0], [20.0, 40.0]), right([10.0, 72.0], [30.0, 50.0])),
            vec![closed(Left, -2.0, 40.0), after(Right, 40.0, 72.0)],
        ),
        (
            "C2",
            pair(left([0.0, 80.0], [20.0, 40.0]), right([10.0, 64.0], [30.0, 50.0])),
            vec![closed(Left, -2.0, 40.0), after(Right, 40.0, 64.0), after(Left, 64.0, 80.0)],
        ),
        (
            "C3",
            pair(left([0.0, 60.0], [20.0, 50.0]), right([10.0, 56.0], [26.0, 38.0])),
            vec![closed(Left, -2.0, 60.0)],
        ),
        (
            "C3b",
            pair(left([0.0, 60.0], [20.0, 50.0]), right([10.0, 72.0], [26.0, 38.0])),
            vec![closed(Left, -2.0, 60.0), after(Right, 60.0, 72.0)],
        ),
        (
            "C4",
            pair(left([0.0, 72.0], [34.0, 54.0]), right([10.0, 60.0], [20.0, 44.0])),
            vec![until(Left, -2.0, 8.0), until(Right, 8.0, 32.0), closed(Left, 32.0, 72.0)],
        ),
        (
            "C5",
            pair(left([0.0, 80.0], [34.0, 46.0]), right([10.0, 66.0], [22.0, 58.0])),
            vec![
                closed(Right, 32.0, 32.0),
                closed(Left, -2.0, 46.0),
                after(Right, 46.0, 66.0),
                after(Left, 66.0, 80.0),
            ],
        ),
        (
            "C6",
            pair(left([0.0, 70.0], [20.0, 28.0]), right([10.0, 60.0], [40.0, 50.0])),
            vec![until(Left, -2.0, 38.0), closed(Right, 38.0, 60.0), after(Left, 60.0, 70.0)],
        ),
        (
            "C7",
            pair(left([0.0, 80.0], [44.0, 56.0]), right([10.0, 60.0], [18.0, 26.0])),
            vec![until(Left, -2.0, 8.0), until(Right, 8.0, 42.0), closed(Left, 42.0, 80.0)],
        ),
        (
            "C8",
            pair(left([0.0, 80.0], [30.0, 40.0]), right([10.0, 60.0], [30.0, 50.0])),
            vec![
                closed(Right, 28.0, 28.0),
                closed(Left, -2.0, 40.0),
                after(Right, 40.0, 60.0),
                after(Left, 60.0, 80.0),
            ],
        ),
        (
            "C9",
            pair(left([0.0, 80.0], [30.0, 40.0]), right([10.0, 60.0], [30.0, 40.0])),
            vec![until(Left, -2.0, 8.0), until(Right, 8.0, 28.0), closed(Left, 28.0, 80.0)],
        ),
        (
            "C10",
            pair(left([0.0, 80.0], [20.0, 40.0]), right([0.0, 60.0], [30.0, 50.0])),
            vec![closed(Left, -2.0, 40.0), after(Right, 40.0, 60.0), after(Left, 60.0, 80.0)],
        ),
        (
            "C11",
            pair(left([0.0, 80.0], [30.0, 50.0]), right([0.0, 60.0], [20.0, 40.0])),
            vec![until(Right, -2.0, 28.0), closed(Left, 28.0, 80.0)],
        ),
        (
            "same required end",
            pair(left([0.0, 80.0], [20.0, 40.0]), right([10.0, 60.0], [30.0, 40.0])),
            vec![closed(Left, -2.0, 40.0), after(Right, 40.0, 60.0), after(Left, 60.0, 80.0)],
        ),
        (
            "T1",
            Candidates {
                intersection: Some(left([0.0, 90.0], [20.0, 30.0])),
                roundabout: Some(right([10.0, 100.0], [40.0, 50.0])),
                manoeuvre: Some(left([30.0, 80.0], [60.0, 70.0])),
            },
            vec![
                until(Left, -2.0, 38.0),
                until(Right, 38.0, 58.0),
                closed(Left, 58.0, 80.0),
                after(Right, 80.0, 100.0),
            ],
        ),
        (
            "T2",
            Candidates {
                intersection: Some(left([0.0, 90.0], [60.0, 70.0])),
                roundabout: Some(right([10.0, 100.0], [40.0, 50.0])),
                manoeuvre: Some(left([20.0, 80.0], [22.0, 30.0])),
            },
            vec![
                until(Left, -2.0, 8.0),
                until(Right, 8.0, 18.0),
                until(Left, 18.0, 38.0),
                until(Right, 38.0, 58.0),
                closed(Left, 58.0, 90.0),
                after(Right, 90.0, 100.0),
            ],
        ),
        (
            "T3",
            Candidates {
                intersection: Some(left([0.0, 60.0], [20.0, 30.0])),
                roundabout: Some(right([0.0, 60.0], [32.0, 40.0])),
                manoeuvre: Some(left([0.0, 60.0], [42.0, 50.0])),
            },
            vec![closed(Left, -2.0, 30.0), after(Right, 30.0, 40.0), after(Left, 40.0, 60.0)],
        ),
    ]
}

#[test]
fn every_listed_conflict_is_settled_as_upstream_does() {
    for (id, candidates, stretches) in cases() {
        check(id, &candidates, &stretches, &PairwiseRules::default());
    }
}

/// W3: the glitch at P's required start is gone; nothing else changes.
#[test]
fn by_default_no_single_sample_stands_out_at_the_required_start() {
    let rules = PairwiseRules { start_belongs_to_before: true, ..PairwiseRules::default() };
    for (id, candidates, mut stretches) in cases() {
        stretches.retain(|(_, from, _, to, _)| from != to);
        check(id, &candidates, &stretches, &rules);
    }
}

#[test]
fn three_records_name_their_winners() {
    use CandidateSource::{Intersection, Manoeuvre, Roundabout};
    for (id, x, winner) in [
        ("T1", 30.0, Intersection),
        ("T1", 40.0, Roundabout),
        ("T1", 70.0, Manoeuvre),
        ("T1", 90.0, Roundabout),
        ("T2", 0.0, Intersection),
        ("T2", 10.0, Roundabout),
        ("T2", 30.0, Manoeuvre),
        ("T2", 50.0, Roundabout),
        ("T2", 80.0, Intersection),
        ("T3", 0.0, Intersection),
        ("T3", 35.0, Roundabout),
        ("T3", 50.0, Manoeuvre),
    ] {
        let (_, candidates, _) = cases().into_iter().find(|(other, ..)| *other == id).unwrap();
        let got = resolve_at(x, FRONT_M, &candidates, &PairwiseRules::default());
        assert_eq!(got.winner.unwrap().source, winner, "{id} at {x}");
    }
}

#[test]
fn every_branch_has_its_label_and_the_loser_its_reason() {
    let candidates = |id: &str| cases().into_iter().find(|(other, ..)| *other == id).unwrap().1;
    for (id, x, case, winner) in [
        ("C3", 20.0, Case::A1, CandidateSource::Intersection),
        ("C1", 20.0, Case::A2, CandidateSource::Intersection),
        ("C6", 30.0, Case::A3, CandidateSource::Intersection),
        ("C1", 41.0, Case::A4, CandidateSource::Manoeuvre),
        ("C5", 30.0, Case::B1, CandidateSource::Intersection),
        ("C5", 50.0, Case::B1, CandidateSource::Manoeuvre),
        ("C4", 20.0, Case::B2, CandidateSource::Manoeuvre),
        ("C4", 40.0, Case::B2, CandidateSource::Intersection),
    ] {
        let got = resolve_at(x, FRONT_M, &candidates(id), &PairwiseRules::default());
        assert_eq!((got.case, got.winner.unwrap().source), (Some(case), winner), "{id} at {x}");
        let lost = got
            .evaluated
            .iter()
            .find(|other| matches!(other.outcome, CandidateOutcome::LostTo { .. }))
            .unwrap();
        assert_eq!(lost.outcome, CandidateOutcome::LostTo { source: winner, case }, "{id} at {x}");
        assert_ne!(lost.source, winner);
    }
    let outcomes = |x: f64| {
        resolve_at(x, FRONT_M, &candidates("C1"), &PairwiseRules::default()).evaluated.map(|w| w.outcome)
    };
    assert_eq!(
        outcomes(-3.0),
        [CandidateOutcome::NotReached, CandidateOutcome::Absent, CandidateOutcome::NotReached]
    );
    assert_eq!(outcomes(65.0), [CandidateOutcome::Passed, CandidateOutcome::Absent, CandidateOutcome::Won]);
}
