//! Random numbers by purpose, so that no draw depends on the number of previous draws.

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::settings::Spells;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DrawKind {
    Latency = 1,
    Loss,
    Freeze,
    Miss,
    Unknown,
    Confusion,
    Confidence,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Draws {
    seed: u64,
}

/// The state of a fault that lasts for several messages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spell {
    is_on: bool,
}

impl Draws {
    pub(super) const fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Draws a number from 0 to 1, excluding 1, uniformly.
    pub(super) fn share(self, kind: DrawKind, of: [u64; 2], message: u64) -> f64 {
        StandardUniform.sample(&mut self.generator(kind, of, message))
    }

    /// Draws from the normal distribution of mean 0 and standard deviation 1.
    pub(super) fn normal(self, kind: DrawKind, of: [u64; 2], message: u64) -> f64 {
        StandardNormal.sample(&mut self.generator(kind, of, message))
    }

    pub(super) fn happens(self, probability: f64, kind: DrawKind, of: [u64; 2], message: u64) -> bool {
        probability > 0.0 && self.share(kind, of, message) < probability
    }

    /// Returns the generator of a draw. Each key is mixed with a random number seeded by the previous keys.
    fn generator(self, kind: DrawKind, [one, other]: [u64; 2], message: u64) -> Pcg32 {
        let keys = [kind as u64, one, other];
        let seed = keys.into_iter().fold(self.seed, |seed, key| Pcg32::seed_from_u64(seed).next_u64() ^ key);
        Pcg32::seed_from_u64(Pcg32::seed_from_u64(seed).next_u64() ^ message)
    }
}

impl Spell {
    /// Decides whether the fault continues, or begins, with this message.
    pub(super) fn goes_on(
        &mut self,
        draws: Draws,
        spells: Spells,
        kind: DrawKind,
        of: u64,
        message: u64,
    ) -> bool {
        let [begin, end] = [[of, 0], [of, 1]];
        let lasts = self.is_on && !draws.happens(spells.mean_length.recip(), kind, end, message);
        self.is_on = lasts || draws.happens(spells.probability, kind, begin, message);
        self.is_on
    }
}
