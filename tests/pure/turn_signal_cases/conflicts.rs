//! docs/spec/turn-signal-decider.md, "Conflict patterns": conflicts of two and three records over a whole
//! drive, improved and as upstream.

use turn_signal::light_command::TurnCommand;
use turn_signal::resolve::{CandidateOutcome, CandidateSource, Candidates, Case, PairwiseRules};
use turn_signal::section::Section;
use turn_signal::side::Side::{self, Left, Right};

use super::line::{record, resolve_at};

const FRONT_M: f64 = 2.0;

/// A side with the stretch it is signalled on: start, with the start itself, end, with the end itself.
type Stretch = (Side, f64, bool, f64, bool);

/// Reads `left [-2, 40], right (40, 72]`: intervals as mathematics writes them.
fn stretches(text: &str) -> Vec<Stretch> {
    let stretch = |text: &str| {
        let (side, interval) = text.trim_start_matches(", ").split_once(' ').unwrap();
        let (from, to) = interval[1..interval.len() - 1].split_once(", ").unwrap();
        let side = match side {
            "left" => Left,
            "right" => Right,
            _ => panic!("{text}: expected left or right"),
        };
        (side, from.parse().unwrap(), interval.starts_with('['), to.parse().unwrap(), interval.ends_with(']'))
    };
    text.split_inclusive([']', ')']).map(stretch).collect()
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

/// Where a record is desired from and to, and required from and to.
type Places = [i32; 4];

fn left(places: Places) -> Section {
    side_record(Left, places)
}
fn right(places: Places) -> Section {
    side_record(Right, places)
}
fn side_record(side: Side, places: Places) -> Section {
    let [desired_start, desired_end, required_start, required_end] = places.map(f64::from);
    record(side, [desired_start, desired_end], [required_start, required_end])
}

/// Its name, the records, and the signals of a drive past them.
type Conflict = (&'static str, Candidates, Vec<Stretch>);

fn pair(name: &'static str, p: Places, q: Places, signals: &str) -> Conflict {
    let (intersection, manoeuvre) = (Some(left(p)), Some(right(q)));
    (name, Candidates { intersection, manoeuvre, ..Candidates::default() }, stretches(signals))
}
fn three(name: &'static str, [p, q, r]: [Places; 3], signals: &str) -> Conflict {
    let (intersection, roundabout, manoeuvre) = (Some(left(p)), Some(right(q)), Some(left(r)));
    (name, Candidates { intersection, roundabout, manoeuvre }, stretches(signals))
}

pub(crate) fn cases() -> [Conflict; 16] {
    [
        pair("C1", [0, 60, 20, 40], [10, 72, 30, 50], "left [-2, 40], right (40, 72]"),
        pair("C2", [0, 80, 20, 40], [10, 64, 30, 50], "left [-2, 40], right (40, 64], left (64, 80]"),
        pair("C3", [0, 60, 20, 50], [10, 56, 26, 38], "left [-2, 60]"),
        pair("C3b", [0, 60, 20, 50], [10, 72, 26, 38], "left [-2, 60], right (60, 72]"),
        pair("C4", [0, 72, 34, 54], [10, 60, 20, 44], "left [-2, 8), right [8, 32), left [32, 72]"),
        pair(
            "C5",
            [0, 80, 34, 46],
            [10, 66, 22, 58],
            "right [32, 32], left [-2, 46], right (46, 66], left (66, 80]",
        ),
        pair("C6", [0, 70, 20, 28], [10, 60, 40, 50], "left [-2, 38), right [38, 60], left (60, 70]"),
        pair("C7", [0, 80, 44, 56], [10, 60, 18, 26], "left [-2, 8), right [8, 42), left [42, 80]"),
        pair(
            "C8",
            [0, 80, 30, 40],
            [10, 60, 30, 50],
            "right [28, 28], left [-2, 40], right (40, 60], left (60, 80]",
        ),
        pair("C9", [0, 80, 30, 40], [10, 60, 30, 40], "left [-2, 8), right [8, 28), left [28, 80]"),
        pair("C10", [0, 80, 20, 40], [0, 60, 30, 50], "left [-2, 40], right (40, 60], left (60, 80]"),
        pair("C11", [0, 80, 30, 50], [0, 60, 20, 40], "right [-2, 28), left [28, 80]"),
        pair(
            "same required end",
            [0, 80, 20, 40],
            [10, 60, 30, 40],
            "left [-2, 40], right (40, 60], left (60, 80]",
        ),
        three(
            "T1",
            [[0, 90, 20, 30], [10, 100, 40, 50], [30, 80, 60, 70]],
            "left [-2, 38), right [38, 58), left [58, 80], right (80, 100]",
        ),
        three(
            "T2",
            [[0, 90, 60, 70], [10, 100, 40, 50], [20, 80, 22, 30]],
            "left [-2, 8), right [8, 18), left [18, 38), right [38, 58), left [58, 90], right (90, 100]",
        ),
        three(
            "T3",
            [[0, 60, 20, 30], [0, 60, 32, 40], [0, 60, 42, 50]],
            "left [-2, 30], right (30, 40], left (40, 60]",
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
