//! What is chosen for a nest: by chance from a seed, or by the bytes of a recipe, of which a fuzzer changes
//! one at a time.

/// Where choices come from.
#[derive(Debug, Clone)]
pub(crate) enum Choices<'a> {
    /// `SplitMix64`.
    Chance(u64),
    /// Each choice takes a byte or a few; when there are none left, the first possibility is chosen.
    Recipe(&'a [u8]),
}

impl Choices<'_> {
    /// The choices of one nest.
    pub(crate) fn of(seed: u64, number: u64) -> Self {
        let mut first = Self::Chance(seed);
        Self::Chance(first.next() ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    fn next(&mut self) -> u64 {
        self.number(8)
    }

    fn number(&mut self, bytes: usize) -> u64 {
        match self {
            Self::Chance(state) => {
                *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
                let mixed = (*state ^ *state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
                mixed ^ mixed >> 31
            }
            Self::Recipe(left) => {
                let (taken, rest) = left.split_at(bytes.min(left.len()));
                *left = rest;
                taken.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
            }
        }
    }

    /// A number below this one, which is not 0.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        let bytes = if end <= 1 << 8 {
            1
        } else if end <= 1 << 16 {
            2
        } else {
            4
        };
        usize::try_from(self.number(bytes) % end as u64).unwrap_or(0)
    }

    /// A power of two, below two to the power of `log`. A fuzzer needs many small things rather than a large
    /// one.
    pub(crate) fn length(&mut self, log: usize) -> usize {
        let log = if matches!(self, Self::Recipe(_)) { log.min(15) } else { log };
        1 << self.below(log)
    }

    /// True with so many percent of all choices; with a recipe, not when it has ended.
    pub(crate) fn percent(&mut self, chance: usize) -> bool {
        99 - self.below(100) < chance
    }

    pub(crate) fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }

    /// A place in something of this length; 0 of nothing.
    pub(crate) fn place(&mut self, length: usize) -> usize {
        self.below(length.max(1))
    }
}
