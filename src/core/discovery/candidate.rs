//! Candidates for the turn indicators and the hazard lights, and what speaks for and against each.

use std::time::Duration;

use super::capture::MessageKey;
use super::response::Shape;
use crate::core::dbc::codec::{ByteOrder, Layout};
use crate::core::time::MonoTime;

/// A signal of a message that no DBC describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundSignal {
    /// The message.
    pub message: MessageKey,
    /// The position in the message.
    pub layout: Layout,
}

impl FoundSignal {
    /// The bits of the signal, as numbered in a DBC.
    pub fn bits(&self) -> Vec<u16> {
        bits_of(self.layout)
    }
}

/// The bits of a signal, as numbered in a DBC.
pub(super) fn bits_of(layout: Layout) -> Vec<u16> {
    let positions = 0..layout.length;
    match layout.order {
        ByteOrder::Intel => positions.map(|at| layout.start + at).collect(),
        ByteOrder::Motorola => positions.map(|at| sawtooth(sawtooth(layout.start) + at)).collect(),
    }
}

/// Converts between the number of a bit and its position in the order of Motorola, which is its own inverse.
pub(super) fn sawtooth(bit: u16) -> u16 {
    bit / 8 * 8 + 7 - bit % 8
}

/// One side, or the hazard lights: a signal with its value at rest and while it is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switch {
    /// The signal.
    pub signal: FoundSignal,
    /// Raw value at rest.
    pub off: u64,
    /// Raw value while it is on, lit or pressed.
    pub on: u64,
}

/// The form in which signals show the turn indicators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnForm {
    /// One signal with a value for each state.
    Enumerated {
        /// The signal.
        signal: FoundSignal,
        /// Raw value at rest.
        off: u64,
        /// Raw value of the left side.
        left: u64,
        /// Raw value of the right side.
        right: u64,
        /// Raw value of the hazard lights; `None` when they do not show.
        both: Option<u64>,
    },
    /// A signal a side, both on for the hazard lights if those show.
    Pair {
        /// The left side.
        left: Switch,
        /// The right side.
        right: Switch,
        /// True for lamps, which flash.
        lamps: bool,
        /// True if both are on during the hazard lights.
        shows_hazard: bool,
    },
    /// The position of a stalk that springs back.
    Stalk {
        /// The signal.
        signal: FoundSignal,
        /// Raw value at rest.
        idle: u64,
        /// Raw value of a full press to the left.
        left: u64,
        /// Raw value of a full press to the right.
        right: u64,
        /// Raw values of half presses to the left and to the right, if they were seen.
        half: [Option<u64>; 2],
        /// True if a full press to the other side ended the indication.
        opposite_full_cancels: bool,
    },
}

impl TurnForm {
    /// The signals of the form.
    pub fn signals(&self) -> Vec<FoundSignal> {
        match self {
            Self::Enumerated { signal, .. } | Self::Stalk { signal, .. } => vec![*signal],
            Self::Pair { left, right, .. } => vec![left.signal, right.signal],
        }
    }

    /// The bits that tell one side from the other, by message.
    pub(super) fn telling_bits(&self) -> Vec<(MessageKey, Vec<u16>)> {
        match self {
            Self::Enumerated { signal, left, right, .. } | Self::Stalk { signal, left, right, .. } => {
                let mut bits = signal.bits();
                if signal.layout.order == ByteOrder::Motorola {
                    bits.reverse();
                }
                let differs = |at: &usize| (left ^ right) >> at & 1 == 1;
                let telling = (0..bits.len()).filter(differs).map(|at| bits[at]).collect();
                vec![(signal.message, telling)]
            }
            Self::Pair { left, right, .. } => {
                [left, right].map(|side| (side.signal.message, side.signal.bits())).to_vec()
            }
        }
    }

    /// True if it shows the hazard lights as both sides.
    pub fn shows_hazard(&self) -> bool {
        match self {
            Self::Enumerated { both, .. } => both.is_some(),
            Self::Pair { shows_hazard, .. } => *shows_hazard,
            Self::Stalk { .. } => false,
        }
    }
}

/// The form in which signals show the hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HazardForm {
    /// Both sides of the turn indicators are on.
    BothSides,
    /// A signal of their own.
    Signal(Switch),
    /// A button that springs back; each press toggles.
    Button(Switch),
}

impl HazardForm {
    /// The signal of its own; `None` without one.
    pub fn signal(&self) -> Option<FoundSignal> {
        match self {
            Self::BothSides => None,
            Self::Signal(switch) | Self::Button(switch) => Some(switch.signal),
        }
    }
}

/// Something that speaks against a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawback {
    /// It did not follow this many requests.
    Missed(usize),
    /// At this many requests it had values that are not a state.
    OtherValues(usize),
    /// It flashes, so that its state has to be derived.
    Flashes,
    /// The hazard lights do not show in it.
    HidesHazard,
    /// It shows a moment only, so that its state has to be derived.
    Momentary,
    /// Left and right are in different messages.
    TwoMessages,
    /// Its byte changes whenever anything in the message does, as a checksum does.
    LikeChecksum,
    /// Bits beside it change with the requests in other manners, as lower bits of a number do.
    PartOfNumber,
    /// Bits beside it that follow the requests as well.
    Cut(u16),
    /// It is not in a message of the turn indicators.
    OtherMessage,
    /// Bits between its own never changed.
    Gaps(u16),
    /// It has more bits than two.
    Wide(u16),
    /// Its value at rest is not 0.
    RestsOn,
    /// Its message is not sent regularly.
    Irregular,
    /// Its message has no proven checksum.
    NoChecksum,
    /// Its message has no counter.
    NoCounter,
}

impl Drawback {
    /// The weight: the sum of a candidate's weights decides its rank.
    pub(super) fn weight(self) -> usize {
        match self {
            Self::Missed(count) | Self::OtherValues(count) => MISSED * count,
            Self::Flashes => 6,
            Self::HidesHazard => 8,
            Self::Momentary => 40,
            Self::TwoMessages => 50,
            Self::LikeChecksum | Self::PartOfNumber => 20,
            Self::Cut(bits) => 4 * usize::from(bits),
            Self::OtherMessage => 15,
            Self::Gaps(bits) => 2 * usize::from(bits),
            Self::Wide(bits) => usize::from(bits),
            Self::RestsOn => 5,
            Self::Irregular => 10,
            Self::NoChecksum => 2,
            Self::NoCounter => 1,
        }
    }
}

/// The time of a response to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ResponseTime {
    pub(super) at: MonoTime,
    /// By so much it may be later than what the driver did.
    pub(super) late: Duration,
}

impl ResponseTime {
    /// True if both may be of the same moment.
    fn may_be(self, other: Self) -> bool {
        let begins = |time: Self| time.at.before(time.late).before(SIMULTANEOUS);
        begins(self) <= other.at && begins(other) <= self.at
    }
}

/// The weight of a request that was not followed.
const MISSED: usize = 30;
/// Driver's reactions, lights and messages differ by this much in time, beside the periods of messages.
const SIMULTANEOUS: Duration = Duration::from_millis(150);

/// A candidate with its evidence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Candidate<F> {
    /// The signals and their values.
    pub form: F,
    /// The manner in which it shows the action.
    pub shape: Shape,
    /// Requests that it followed, for each of [`Action::ALL`](super::timeline::Action::ALL), with their number.
    pub followed: [(usize, usize); 3],
    /// What speaks against it.
    pub drawbacks: Vec<Drawback>,
    /// For each request the times of the response and of its end, and by how much they may be late.
    pub(super) times: Vec<[Option<ResponseTime>; 2]>,
}

impl<F> Candidate<F> {
    /// Number of requests that it did not follow.
    pub(super) fn missed(&self) -> usize {
        self.followed.iter().map(|(count, of)| of - count).sum()
    }

    /// True if its bits may be a part of something else.
    pub(super) fn is_suspect(&self) -> bool {
        let is_part = |drawback: &Drawback| {
            matches!(drawback, Drawback::LikeChecksum | Drawback::PartOfNumber | Drawback::OtherValues(_))
        };
        self.drawbacks.iter().any(is_part)
    }

    /// True if its bits may be those of a checksum.
    pub(super) fn is_like_checksum(&self) -> bool {
        self.drawbacks.contains(&Drawback::LikeChecksum)
    }

    /// Number of requests of either side that it did not follow.
    pub(super) fn missed_sides(&self) -> usize {
        self.followed[..2].iter().map(|(count, of)| of - count).sum()
    }

    /// True if the other one follows the requests as well, but at other times: one of the two does so by chance.
    pub(super) fn is_disputed_by(&self, other: &Self) -> bool {
        let (apart, _) = self.times_apart(other);
        apart > 0 && self.has_rival(other)
    }

    /// Likewise at most of the times, so that it is not because of a late frame.
    pub(super) fn is_mostly_disputed_by(&self, other: &Self) -> bool {
        let (apart, all) = self.times_apart(other);
        apart * 2 > all && self.has_rival(other)
    }

    /// True if the other one followed as many requests, and is not much worse.
    pub(super) fn has_rival(&self, other: &Self) -> bool {
        other.missed() <= self.missed() && other.weight() < self.weight() + MISSED
    }

    /// Number of times at which the other one came or went at another moment, and of all that both have.
    fn times_apart(&self, other: &Self) -> (usize, usize) {
        let times = self.times.iter().flatten().zip(other.times.iter().flatten());
        let both: Vec<_> = times.filter_map(|(own, other)| own.zip(*other)).collect();
        (both.iter().filter(|(own, other)| !own.may_be(*other)).count(), both.len())
    }

    /// Sum of the weights of all drawbacks; the candidate with the lowest one is first.
    pub fn weight(&self) -> usize {
        self.drawbacks.iter().map(|drawback| drawback.weight()).sum()
    }
}
