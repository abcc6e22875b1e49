//! Any bytes are refused with a reason or accepted, without a panic.

use proptest::prelude::*;
use proptest::test_runner::Config;
use traffic_lights::compat::Compat;

use crate::pure::scenario_refusals::read_as;

const NAMES: [&str; 3] = ["s.toml", "s.yaml", "s.xosc"];
const SOUND: [&[u8]; 3] = [
    include_bytes!("../../../config/scenarios/bench.toml"),
    // Behind the byte that is the fuzz target's own.
    include_bytes!("../../../fuzz/corpus/scenario_file/1_tier4.yaml").split_at(1).1,
    include_bytes!("../../../config/scenarios/bench.xosc"),
];
/// Pieces that mean something to one of the readers.
#[rustfmt::skip]
const PIECES: &[&str] = &[
    "<", ">", "/>", "\"", "'", "&amp;", "&", "<!--", "-->", "]]>", "$", "${p}", "[", "]", "{", "}", ": ",
    "- ", "*a", "&a ", "? ", "|\n", "#", "=", "\n", "\t", "nan", "-1", "1e999", "99999999999999999999",
    "unknown", "ä", "\u{FEFF}", "\0", "none", "event", "OpenSCENARIO:\n", "[[event]]\n", "<<: ",
];

fn assert_reasons(which: usize, bytes: &[u8]) -> Result<(), TestCaseError> {
    for compat in [Compat::Improved, Compat::Upstream] {
        match read_as(compat, NAMES[which], bytes) {
            Ok(file) => {
                for part in file.not_interpreted {
                    let position = part.location.position;
                    prop_assert!(!part.to_string().contains('\n'));
                    prop_assert!(position.line > 0 && position.column > 0);
                }
            }
            Err(problems) => {
                prop_assert!(!problems.is_empty());
                for problem in problems {
                    prop_assert!(
                        !problem.reason.is_empty() && !problem.to_string().contains('\n'),
                        "{problem}"
                    );
                    // What is not text has no lines.
                    let is_binary = str::from_utf8(bytes).is_err();
                    prop_assert!(problem.position.map_or(is_binary, |at| at.line > 0 && at.column > 0));
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(Config { cases: 1_000, failure_persistence: None, ..Config::default() })]

    #[test]
    fn arbitrary_bytes_are_refused_with_a_reason(
        which in 0..3_usize,
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        assert_reasons(which, &bytes)?;
    }

    #[test]
    fn pieces_in_any_order_are_refused_with_a_reason(
        which in 0..3_usize,
        pieces in proptest::collection::vec(proptest::sample::select(PIECES), 0..30),
    ) {
        assert_reasons(which, pieces.concat().as_bytes())?;
    }

    #[test]
    fn damaged_scenarios_are_refused_with_a_reason(
        which in 0..3_usize,
        damages in proptest::collection::vec((any::<usize>(), 0..30_usize, proptest::sample::select(PIECES)), 1..4),
    ) {
        let mut bytes = SOUND[which].to_vec();
        for (at, cut, piece) in damages {
            let from = at % bytes.len().max(1);
            let to = (from + cut).min(bytes.len());
            bytes.splice(from..to, piece.bytes());
        }
        assert_reasons(which, &bytes)?;
    }
}
