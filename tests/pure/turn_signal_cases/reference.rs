//! Upstream's resolution written down a second time, in numbers alone, beside the resolver in
//! upstream-compatible mode. Random triples of records get the same command, winner and case from both.

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use turn_signal::resolve::{CandidateSource, Candidates, PairwiseRules};
use turn_signal::section::Section;
use turn_signal::side::Side;

use super::laws::any_candidates;
use super::line::resolve_at;

const FRONT_M: f64 = 2.0;

struct Record {
    source: CandidateSource,
    side: Side,
    desired_m: [f64; 2],
    required_m: [f64; 2],
}

/// The source and the side that are signalled, and the case that decided last.
type Winner = (CandidateSource, Side, &'static str);

fn record(source: CandidateSource, section: &Section, x_m: f64) -> Option<Record> {
    let between = |start: f64, end: f64| [start - x_m - FRONT_M, end - x_m];
    Some(Record {
        source,
        side: section.turn.side()?,
        desired_m: between(section.desired_start.position.x_m, section.desired_end.position.x_m),
        required_m: between(section.required_start.position.x_m, section.required_end.position.x_m),
    })
}

/// The later one wins over the earlier one, and by which case.
fn later_wins([ps, pe]: [f64; 2], [qs, qe]: [f64; 2]) -> (bool, &'static str) {
    let has_claim = ps > 0.0 || ps < 0.0 && pe >= 0.0;
    match (ps < qs, pe < qe) {
        (true, _) if qe < pe => (false, "A1"),
        (true, _) if has_claim => (false, "A2"),
        (true, _) if qs > 0.0 => (false, "A3"),
        (true, _) => (true, "A4"),
        (false, true) => (!has_claim, "B1"),
        (false, false) => (ps > 0.0, "B2"),
    }
}

fn upstream(candidates: &Candidates, x_m: f64) -> Option<Winner> {
    let given = [
        (CandidateSource::Intersection, candidates.intersection),
        (CandidateSource::Roundabout, candidates.roundabout),
        (CandidateSource::Manoeuvre, candidates.manoeuvre),
    ];
    let mut valid: Vec<Record> = given
        .into_iter()
        .filter_map(|(source, section)| record(source, &section?, x_m))
        .filter(|record| record.desired_m[0] <= 0.0 && record.desired_m[1] >= 0.0)
        .collect();
    valid.sort_by(|one, other| one.desired_m[0].total_cmp(&other.desired_m[0]));
    let mut valid = valid.into_iter();
    let mut holder = valid.next()?;
    let mut last_case = "";
    for next in valid {
        let (is_later, case) = later_wins(holder.required_m, next.required_m);
        last_case = case;
        if is_later {
            holder = next;
        }
    }
    Some((holder.source, holder.side, last_case))
}

/// Compares random triples, and returns how many had a winner.
fn compare(triples: u32) -> u32 {
    let config = Config { cases: triples, failure_persistence: None, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let positions_m = proptest::prop_oneof![(-5..110_i32).prop_map(f64::from), -5.0..110.0_f64];
    let won = std::cell::Cell::new(0);
    TestRunner::new_with_rng(config, rng)
        .run(&(any_candidates(), positions_m), |(candidates, x_m)| {
            let resolution = resolve_at(x_m, FRONT_M, &candidates, &PairwiseRules::default());
            let case = resolution.case.map(|case| case.to_string()).unwrap_or_default();
            let winner = resolution.winner.map(|winner| (winner.source, winner.side, case.as_str()));
            proptest::prop_assert_eq!(winner, upstream(&candidates, x_m));
            won.set(won.get() + u32::from(winner.is_some()));
            Ok(())
        })
        .unwrap_or_else(|differs| panic!("{differs}"));
    won.get()
}

#[test]
fn random_triples_are_decided_as_upstream_does() {
    assert!(compare(2_000) > 500);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn sixty_thousand_triples_are_decided_as_upstream_does() {
        assert!(super::compare(60_000) > 15_000);
    }
}
