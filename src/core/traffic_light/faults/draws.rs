//! Random numbers by what they are for, so that no draw depends on how many there were before.

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::Spells;

/// What a draw is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Latency = 1,
    Loss,
    Freeze,
    Miss,
    Unknown,
    Confusion,
    Confidence,
}

/// All draws of a seed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draws {
    seed: u64,
}

/// Whether something that lasts for a while goes on at present.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spell {
    is_on: bool,
}

impl Draws {
    pub(super) const fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// From 0 to 1, 1 excluded, all as likely.
    pub(super) fn share(self, kind: Kind, of: [u64; 2], message: u64) -> f64 {
        StandardUniform.sample(&mut self.generator(kind, of, message))
    }

    /// Mean 0, standard deviation 1.
    pub(super) fn normal(self, kind: Kind, of: [u64; 2], message: u64) -> f64 {
        StandardNormal.sample(&mut self.generator(kind, of, message))
    }

    /// With the given probability.
    pub(super) fn happens(self, probability: f64, kind: Kind, of: [u64; 2], message: u64) -> bool {
        probability > 0.0 && self.share(kind, of, message) < probability
    }

    /// Each word decides which generator the next one is drawn from.
    fn generator(self, kind: Kind, [one, other]: [u64; 2], message: u64) -> Pcg32 {
        let words = [kind as u64, one, other];
        let seed =
            words.into_iter().fold(self.seed, |seed, word| Pcg32::seed_from_u64(seed).next_u64() ^ word);
        Pcg32::seed_from_u64(Pcg32::seed_from_u64(seed).next_u64() ^ message)
    }
}

impl Spell {
    /// Whether it goes on, or begins, with this message.
    pub(super) fn goes_on(
        &mut self,
        draws: Draws,
        spells: Spells,
        kind: Kind,
        of: u64,
        message: u64,
    ) -> bool {
        let [begin, end] = [[of, 0], [of, 1]];
        let lasts = self.is_on && !draws.happens(spells.mean_length.recip(), kind, end, message);
        self.is_on = lasts || draws.happens(spells.probability, kind, begin, message);
        self.is_on
    }
}
