//! Damage to bytes and to sequences of blocks.

use super::choices::Choices;

/// Numbers that a field of a file has when somebody means harm.
const EXTREME: [u64; 10] =
    [0, 1, 2, 0x7F, 0xFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF, 0x7FFF_FFFF_FFFF_FFFF, u64::MAX];

/// Changes a few bytes, or cuts.
pub(crate) fn bytes(choices: &mut Choices<'_>, content: &mut Vec<u8>) {
    let at = choices.place(content.len());
    match choices.below(6) {
        0 | 1 => {
            let change = u8::try_from(1 + choices.below(255)).unwrap_or(1);
            if let Some(byte) = content.get_mut(at) {
                *byte ^= change;
            }
        }
        2 | 3 => {
            let width = *choices.pick(&[1, 2, 4, 8]);
            let number = *choices.pick(&EXTREME);
            let mut field = number.to_le_bytes();
            if choices.percent(30) {
                field[..width].reverse();
            }
            let at = if choices.percent(50) { at / width * width } else { at };
            for (byte, new) in content.iter_mut().skip(at).take(width).zip(field) {
                *byte = new;
            }
        }
        4 => content.truncate(at),
        _ => {
            // A part again, over what follows it or pushed between.
            let length = 1 + choices.below(64);
            let part: Vec<u8> = content.iter().skip(at).take(length).copied().collect();
            let to = choices.place(content.len());
            if choices.percent(50) {
                content.splice(to..to, part);
            } else {
                for (byte, new) in content.iter_mut().skip(to).zip(part) {
                    *byte = new;
                }
            }
        }
    }
}

/// Repeats, moves, cuts or changes blocks; `most` is the most bytes that they then have.
pub(crate) fn blocks(choices: &mut Choices<'_>, blocks: &mut Vec<Vec<u8>>, most: usize) {
    if blocks.is_empty() {
        return;
    }
    let at = choices.place(blocks.len());
    match choices.below(8) {
        0 | 1 => bytes(choices, &mut blocks[at]),
        2 => {
            let times = 1 << choices.below(14);
            let length: usize = blocks.iter().map(Vec::len).sum();
            let times = times.min(most.saturating_sub(length) / blocks[at].len().max(1));
            let copies = vec![blocks[at].clone(); times];
            blocks.splice(at..at, copies);
        }
        3 => {
            let to = choices.place(blocks.len());
            blocks.swap(at, to);
        }
        4 => _ = blocks.remove(at),
        5 => {
            // The second half of a block, where a whole one is expected.
            let half = blocks[at].len() / 2;
            let part = blocks[at][half..].to_vec();
            blocks.insert(at, part);
        }
        6 => {
            let place = choices.place(blocks[at].len());
            blocks[at].truncate(place);
        }
        _ => {
            let length: usize = blocks.iter().map(Vec::len).sum();
            if 2 * length < most {
                blocks.extend_from_within(..);
            }
        }
    }
}
