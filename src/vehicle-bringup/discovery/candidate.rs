//! Candidates for the turn indicators and the hazard lights, with the evidence for and against each.

use std::fmt;
use std::time::Duration;

use derive_more::Display;

use super::capture::MessageKey;
use super::response::{Followed, ResponseShape};
use super::timeline::DriverAction;
use can_signal::dbc::codec::{ByteOrder, Layout};
use gateway_base::time::MonoTime;

/// A signal of a message that no DBC describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundSignal {
    /// Message that carries the signal.
    pub message: MessageKey,
    /// Position of its bits in the message.
    pub layout: Layout,
}

impl FoundSignal {
    /// Returns the bits of the signal, as numbered in a DBC.
    pub fn bits(&self) -> Vec<u16> {
        bits_of(self.layout)
    }
}

/// Returns the bits of a signal, as numbered in a DBC.
pub(super) fn bits_of(layout: Layout) -> Vec<u16> {
    let positions = 0..layout.length;
    match layout.order {
        ByteOrder::Intel => positions.map(|at| layout.start + at).collect(),
        ByteOrder::Motorola => positions.map(|at| sawtooth(sawtooth(layout.start) + at)).collect(),
    }
}

/// Converts between the number of a bit and its position in Motorola order; the conversion is its own
/// inverse.
pub(super) fn sawtooth(bit: u16) -> u16 {
    bit / 8 * 8 + 7 - bit % 8
}

/// One side, or the hazard lights: a signal with its value at rest and while it is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[display("{signal} = {on} (rest {off})")]
pub struct Switch {
    /// Signal that shows the state.
    pub signal: FoundSignal,
    /// Raw value at rest.
    pub off: u64,
    /// Raw value while it is on, lit or pressed.
    pub on: u64,
}

/// The form in which signals show the turn indicators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // numbers are raw values
pub enum TurnForm {
    /// One signal with a value for each state.
    Enumerated {
        signal: FoundSignal,
        off: u64,
        left: u64,
        right: u64,
        /// Raw value of the hazard lights; `None` if they are not shown.
        both: Option<u64>,
    },
    /// One signal for each side; both are on for the hazard lights if these are shown.
    Pair {
        left: Switch,
        right: Switch,
        /// True for lamps, which flash.
        lamps: bool,
        /// True if both are on during the hazard lights.
        shows_hazard: bool,
    },
    /// The position of a stalk that springs back.
    Stalk {
        signal: FoundSignal,
        idle: u64,
        /// Raw value of a full press to the left.
        left: u64,
        /// Raw value of a full press to the right.
        right: u64,
        /// Raw values of half presses to the left and to the right, if observed.
        half: [Option<u64>; 2],
        /// True if a full press to the other side ended the indication.
        opposite_full_cancels: bool,
    },
}

impl TurnForm {
    /// Returns the signals of the form.
    pub fn signals(&self) -> Vec<FoundSignal> {
        match self {
            Self::Enumerated { signal, .. } | Self::Stalk { signal, .. } => vec![*signal],
            Self::Pair { left, right, .. } => vec![left.signal, right.signal],
        }
    }

    /// Returns the bits that distinguish the sides, by message.
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

    /// Returns true if it shows the hazard lights as both sides.
    pub fn shows_hazard(&self) -> bool {
        match self {
            Self::Enumerated { both, .. } => both.is_some(),
            Self::Pair { shows_hazard, .. } => *shows_hazard,
            Self::Stalk { .. } => false,
        }
    }
}

/// The form in which signals show the hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum HazardForm {
    /// Both sides of the turn indicators are on.
    #[display("both sides of the turn indicators")]
    BothSides,
    /// A signal of their own.
    Signal(Switch),
    /// A button that springs back; each press toggles the lights.
    #[display("button: {_0}")]
    Button(Switch),
}

impl HazardForm {
    /// Returns the separate signal of the hazard lights; `None` without one.
    pub fn signal(&self) -> Option<FoundSignal> {
        match self {
            Self::BothSides => None,
            Self::Signal(switch) | Self::Button(switch) => Some(switch.signal),
        }
    }
}

/// A drawback of a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum Drawback {
    #[display("did not follow {_0} of the requests")]
    Missed(usize),
    #[display("had other values at {_0} of the requests")]
    OtherValues(usize),
    #[display("flashes: its state has to be derived")]
    Flashes,
    #[display("does not show the hazard lights")]
    HidesHazard,
    #[display("shows a moment only: its state has to be derived")]
    Momentary,
    #[display("left and right are in different messages")]
    TwoMessages,
    /// Its byte changes whenever anything in the message changes, like a checksum.
    #[display("its byte changes with everything in the message, as a checksum does")]
    LikeChecksum,
    #[display("bits beside it change like bits of a number")]
    PartOfNumber,
    #[display("{_0} bits beside it follow the requests as well")]
    Cut(u16),
    #[display("is not in a message of the turn indicators")]
    OtherMessage,
    #[display("{_0} of its bits never changed")]
    Gaps(u16),
    #[display("has {_0} more bits than needed for three states")]
    Wide(u16),
    #[display("is not 0 at rest")]
    RestsOn,
    #[display("its message is not sent regularly")]
    Irregular,
    /// Its message has no proven checksum.
    #[display("its message has no known checksum")]
    NoChecksum,
    #[display("its message has no counter")]
    NoCounter,
}

impl Drawback {
    /// Returns the weight; the sum of a candidate's weights decides its rank.
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ResponseTime {
    pub(super) at: MonoTime,
    /// Largest delay after the driver's action.
    pub(super) late: Duration,
}

impl ResponseTime {
    /// Returns true if both may belong to the same moment.
    fn may_be(self, other: Self) -> bool {
        let begins = |time: Self| time.at.before(time.late).before(SIMULTANEOUS);
        begins(self) <= other.at && begins(other) <= self.at
    }
}

/// Weight of a request that was not followed.
const MISSED: usize = 30;
/// Largest difference in time between the driver's reaction, lights and messages, in addition to message
/// periods.
const SIMULTANEOUS: Duration = Duration::from_millis(150);

/// A candidate with evidence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignalCandidate<F> {
    /// The signals and their values.
    pub form: F,
    /// Way in which it shows the action.
    pub shape: ResponseShape,
    /// Requests of each of [`DriverAction::ALL`](super::timeline::DriverAction::ALL).
    pub followed: [Followed; 3],
    /// All evidence against it.
    pub drawbacks: Vec<Drawback>,
    /// Times of the response and of its end for each request, with their largest delays.
    pub(super) times: Vec<[Option<ResponseTime>; 2]>,
}

impl<F> SignalCandidate<F> {
    /// Creates a candidate, and adds the requests that it missed to its drawbacks.
    pub(super) fn new(
        form: F,
        shape: ResponseShape,
        followed: [Followed; 3],
        mut drawbacks: Vec<Drawback>,
        times: Vec<[Option<ResponseTime>; 2]>,
    ) -> Self {
        let missed = followed.iter().map(|followed| followed.missed()).sum();
        drawbacks.extend((missed > 0).then_some(Drawback::Missed(missed)));
        Self { form, shape, followed, drawbacks, times }
    }

    pub(super) fn missed(&self) -> usize {
        self.followed.iter().map(|followed| followed.missed()).sum()
    }

    /// Returns true if its bits may be part of something else.
    pub(super) fn is_suspect(&self) -> bool {
        let is_part = |drawback: &Drawback| {
            matches!(drawback, Drawback::LikeChecksum | Drawback::PartOfNumber | Drawback::OtherValues(_))
        };
        self.drawbacks.iter().any(is_part)
    }

    pub(super) fn is_like_checksum(&self) -> bool {
        self.drawbacks.contains(&Drawback::LikeChecksum)
    }

    /// Returns the number of requests for either side that it did not follow.
    pub(super) fn missed_sides(&self) -> usize {
        self.followed[..2].iter().map(|followed| followed.missed()).sum()
    }

    /// Returns true if the other candidate also follows the requests, but at other times, so that one of them
    /// follows by chance.
    pub(super) fn is_disputed_by(&self, other: &Self) -> bool {
        let (apart, _) = self.times_apart(other);
        apart > 0 && self.has_rival(other)
    }

    /// Like [`Self::is_disputed_by`], but at most of the common times, which late frames cannot explain.
    pub(super) fn is_mostly_disputed_by(&self, other: &Self) -> bool {
        let (apart, all) = self.times_apart(other);
        apart * 2 > all && self.has_rival(other)
    }

    /// Returns true if the other candidate followed as many requests and is not much worse.
    pub(super) fn has_rival(&self, other: &Self) -> bool {
        other.missed() <= self.missed() && other.weight() < self.weight() + MISSED
    }

    /// Returns how often the other candidate came or went at another time, and the number of all common
    /// times.
    fn times_apart(&self, other: &Self) -> (usize, usize) {
        let times = self.times.iter().flatten().zip(other.times.iter().flatten());
        let both: Vec<_> = times.filter_map(|(own, other)| own.zip(*other)).collect();
        (both.iter().filter(|(own, other)| !own.may_be(*other)).count(), both.len())
    }

    /// Returns the sum of the weights of all drawbacks; the candidate with the lowest sum is first.
    pub fn weight(&self) -> usize {
        self.drawbacks.iter().map(|drawback| drawback.weight()).sum()
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
        let Followed { count, of } = self.followed[action as usize];
        format!("{count} of {of}")
    }

    /// Returns the drawbacks of this candidate that `best` does not have, or a text for its rank if there are
    /// none.
    pub fn explanation<G>(&self, best: &SignalCandidate<G>) -> String {
        let own = self.drawbacks.iter().filter(|drawback| !best.drawbacks.contains(drawback));
        let texts: Vec<_> = own.map(ToString::to_string).collect();
        if texts.is_empty() { "as good, but found later".to_owned() } else { texts.join("; ") }
    }
}
