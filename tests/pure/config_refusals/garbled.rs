//! Configurations damaged at random: refused or accepted, but read to the end without a panic.

use proptest::prelude::*;

use crate::pure::config_refusals::{load_texts, sound};
use crate::support::property::for_all;

/// Pieces that mean something to the reader.
#[rustfmt::skip]
const PIECES: &[&str] = &[
    "[", "]", "\"", "=", "{", "}", "..=", "-1", "0x", "99999999999999999999", "\n", "#", "nan", "ä", "'''",
    "[turn]", "[hazard]", "signal", "fitted = false", "both = [3]", "from = \"reason\"", "[message.BLINK]",
    "\"4..=7\"", "\"-9..=170141183460469231731687303715884105727\"", "[[turn.fault_signal]]", "\u{FEFF}",
];

#[derive(Debug, Clone)]
enum Damage {
    Cut(usize, usize),
    Insert(usize, &'static str),
    Swap(usize, usize),
    Byte(usize, u8),
}

fn any_damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        (any::<usize>(), 0..40_usize).prop_map(|(at, length)| Damage::Cut(at, length)),
        (any::<usize>(), proptest::sample::select(PIECES)).prop_map(|(at, piece)| Damage::Insert(at, piece)),
        (any::<usize>(), any::<usize>()).prop_map(|(a, b)| Damage::Swap(a, b)),
        (any::<usize>(), any::<u8>()).prop_map(|(at, byte)| Damage::Byte(at, byte)),
    ]
}

fn damage(bytes: &mut Vec<u8>, damages: &[Damage]) {
    for damage in damages {
        let length = bytes.len().max(1);
        match *damage {
            Damage::Cut(at, count) => {
                let from = at % length;
                bytes.drain(from.min(bytes.len())..(from + count).min(bytes.len()));
            }
            Damage::Insert(at, piece) => {
                let at = (at % length).min(bytes.len());
                bytes.splice(at..at, piece.bytes());
            }
            Damage::Swap(a, b) => {
                let mut lines: Vec<_> = bytes.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
                let count = lines.len();
                lines.swap(a % count, b % count);
                *bytes = lines.join(&b'\n');
            }
            Damage::Byte(at, byte) => {
                if let Some(there) = bytes.get_mut(at % length) {
                    *there = byte;
                }
            }
        }
    }
}

fn damaged_configurations_are_refused_in_words_over(cases: u32) {
    let file = proptest::sample::select(&["gateway.toml", "car.toml", "car.dbc"][..]);
    for_all(cases, (file, proptest::collection::vec(any_damage(), 1..6)), |(file, damages)| {
        let mut texts = sound();
        damage(texts.bytes_mut(file), &damages);
        if let Err(problems) = load_texts(&texts) {
            prop_assert!(!problems.is_empty());
            for problem in problems {
                prop_assert!(!problem.reason.is_empty(), "{problem}");
                prop_assert!(problem.position.is_none_or(|at| at.line > 0 && at.column > 0));
                prop_assert!(!problem.to_string().contains('\n'), "{problem}");
            }
        }
        Ok(())
    });
}

#[test]
fn damaged_configurations_are_refused_in_words() {
    damaged_configurations_are_refused_in_words_over(400);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn damaged_configurations_are_refused_in_words() {
        super::damaged_configurations_are_refused_in_words_over(2_000);
    }
}
