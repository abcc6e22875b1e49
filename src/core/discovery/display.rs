//! Texts for candidates and what speaks against them.

use std::fmt;

use super::candidate::{FoundSignal, SignalCandidate, TurnForm};
use super::timeline::DriverAction;

impl fmt::Display for FoundSignal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = self.bits();
        let (first, last) = (bits.first().copied().unwrap_or(0), bits.last().copied().unwrap_or(0));
        write!(f, "0x{} byte {} ", self.message.id, first / 8)?;
        if first == last {
            write!(f, "bit {}", first % 8)
        } else if first / 8 == last / 8 {
            write!(f, "bits {} to {}", first % 8, last % 8)
        } else {
            write!(f, "bit {} to byte {} bit {}", first % 8, last / 8, last % 8)
        }
    }
}

impl fmt::Display for TurnForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Enumerated { signal, off, left, right, both } => {
                write!(f, "{signal}: off {off}, left {left}, right {right}")?;
                both.map_or(Ok(()), |both| write!(f, ", hazard {both}"))
            }
            Self::Pair { left, right, lamps, .. } => {
                write!(f, "{}left {left}, right {right}", if *lamps { "lamps: " } else { "" })
            }
            Self::Stalk { signal, idle, left, right, .. } => {
                write!(f, "{signal}, momentary: rest {idle}, left {left}, right {right}")
            }
        }
    }
}

impl<F> SignalCandidate<F> {
    /// Returns the number of followed requests of an action, e.g. `2 of 2`.
    pub fn followed_text(&self, action: DriverAction) -> String {
        let (count, of) = self.followed[action as usize];
        format!("{count} of {of}")
    }

    /// Returns the drawbacks of this candidate that `best` does not have, or a text for its rank if there are none.
    pub fn explanation<G>(&self, best: &SignalCandidate<G>) -> String {
        let own = self.drawbacks.iter().filter(|drawback| !best.drawbacks.contains(drawback));
        let texts: Vec<_> = own.map(ToString::to_string).collect();
        if texts.is_empty() { "as good, but found later".to_owned() } else { texts.join("; ") }
    }
}
