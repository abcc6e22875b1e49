//! Texts for candidates and what speaks against them.

use std::fmt;

use super::candidate::{Drawback, FoundSignal, HazardForm, SignalCandidate, Switch, TurnForm};
use super::findings::{Certainty, Doubt};
use super::timeline::DriverAction;

impl fmt::Display for DriverAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.mark().fmt(f)
    }
}

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

impl fmt::Display for Switch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {} (rest {})", self.signal, self.on, self.off)
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

impl fmt::Display for HazardForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BothSides => f.write_str("both sides of the turn indicators"),
            Self::Signal(switch) => write!(f, "{switch}"),
            Self::Button(switch) => write!(f, "button: {switch}"),
        }
    }
}

impl fmt::Display for Drawback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missed(count) => write!(f, "did not follow {count} of the requests"),
            Self::OtherValues(count) => write!(f, "had other values at {count} of the requests"),
            Self::Flashes => f.write_str("flashes: its state has to be derived"),
            Self::HidesHazard => f.write_str("does not show the hazard lights"),
            Self::Momentary => f.write_str("shows a moment only: its state has to be derived"),
            Self::TwoMessages => f.write_str("left and right are in different messages"),
            Self::LikeChecksum => {
                f.write_str("its byte changes with everything in the message, as a checksum does")
            }
            Self::PartOfNumber => f.write_str("bits beside it change like bits of a number"),
            Self::Cut(bits) => write!(f, "{bits} bits beside it follow the requests as well"),
            Self::OtherMessage => f.write_str("is not in a message of the turn indicators"),
            Self::Gaps(bits) => write!(f, "{bits} of its bits never changed"),
            Self::Wide(bits) => write!(f, "has {bits} more bits than needed for three states"),
            Self::RestsOn => f.write_str("is not 0 at rest"),
            Self::Irregular => f.write_str("its message is not sent regularly"),
            Self::NoChecksum => f.write_str("its message has no known checksum"),
            Self::NoCounter => f.write_str("its message has no counter"),
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

impl fmt::Display for Certainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sure => "found",
            Self::Unsure => "not sure",
            Self::NotFound => "not found",
            Self::NotVisible => "not visible on this bus",
        })
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Twin(twin) => {
                write!(f, "{twin} always changed together with it: one may be of a checksum or counter")
            }
            Self::Checksum => f.write_str("it may be a part of a checksum, which another candidate is not"),
            Self::Disputed => f.write_str("another signal followed as well, at other moments"),
        }
    }
}
