//! What a vehicle profile says, compiled: which bits of which message mean what.
//!
//! Built once at start by `config::settings`, which has checked it against the DBC. Everything
//! here is by index: nothing is looked up by name per frame.

use std::time::Duration;

use super::fusion::SourceSettings;
use super::integrity::MessageIntegrity;
use super::lamp::LampSettings;
use super::lamp::timing::Resolution;
use super::meaning::{Meaning, ValueMap};
use super::stalk::{StalkPosition, StalkSettings};
use crate::core::dbc::codec::SignalCodec;
use crate::core::event::BusIndex;
use crate::core::frame::CanId;

/// A bound message, by position in [`LightsBinding::messages`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MessageIndex(pub usize);

/// A bound signal, by position in [`LightsBinding::signals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SignalIndex(pub usize);

/// Everything the profile binds for turn indicators and hazard lights.
#[derive(Debug, Clone)]
pub struct LightsBinding {
    /// The messages needed, each once.
    pub messages: Vec<BoundMessage>,
    /// The signals needed, each once.
    pub signals: Vec<BoundSignal>,
    /// Where the turn state comes from.
    pub turn: TurnBinding,
    /// Fault signals beside the turn state.
    pub turn_faults: FaultBinding,
    /// Where the hazard state comes from.
    pub hazard: HazardBinding,
    /// Fault signals beside the hazard state.
    pub hazard_faults: FaultBinding,
    /// What the turn report says while the hazard lights are on.
    pub turn_while_hazard: TurnWhileHazard,
}

/// A message of the DBC on one bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundMessage {
    /// DBC name.
    pub name: String,
    /// The bus it comes on; the same id on another bus is another message.
    pub bus: BusIndex,
    /// Identifier.
    pub id: CanId,
    /// How long its values may be believed.
    pub timing: Timing,
    /// What its frames must prove before any of their signals is used.
    pub integrity: Option<MessageIntegrity>,
}

/// How a message is sent, and so how long its last values may be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// Sent again and again: silence longer than the limit makes its values unknown.
    Cyclic {
        /// Longest silence that is still believed.
        timeout: Duration,
    },
    /// Sent on change only: its values hold as long as the bus is alive.
    Event,
    /// Sent on change and slowly repeated: both must hold.
    EventCyclic {
        /// Longest silence that is still believed.
        timeout: Duration,
    },
}

impl Timing {
    /// Longest silence of the message that is still believed.
    pub fn timeout(self) -> Option<Duration> {
        match self {
            Self::Cyclic { timeout } | Self::EventCyclic { timeout } => Some(timeout),
            Self::Event => None,
        }
    }

    /// Whether it is sent on change: a change may be missed while the bus is silent.
    pub fn is_event(self) -> bool {
        match self {
            Self::Event | Self::EventCyclic { .. } => true,
            Self::Cyclic { .. } => false,
        }
    }
}

/// One signal of a bound message.
#[derive(Debug, Clone)]
pub struct BoundSignal {
    /// `MESSAGE.SIGNAL`, for people.
    pub name: String,
    /// The message that carries it.
    pub message: MessageIndex,
    /// How to read it.
    pub codec: SignalCodec,
}

/// A signal with the meaning of its raw values.
#[derive(Debug, Clone)]
pub struct Role<T> {
    /// The signal.
    pub signal: SignalIndex,
    /// Its values.
    pub values: ValueMap<T>,
}

/// What an enumerated turn signal can say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TurnCode {
    /// No indicator on.
    Off,
    /// Left indicators on.
    Left,
    /// Right indicators on.
    Right,
    /// Both sides on: hazard.
    Both,
}

/// Where the turn state comes from.
#[derive(Debug, Clone)]
pub enum TurnBinding {
    /// The vehicle has no indicators: DISABLE for ever.
    NotFitted,
    /// What the vehicle sends of them.
    From(Sources<TurnSource>),
}

/// Sources of one state.
#[derive(Debug, Clone)]
pub struct Sources<S> {
    /// The most trusted first; at least one.
    pub list: Vec<NamedSource<S>>,
    /// How long a source may contradict the one that is believed before diagnostics warn.
    pub disagreement: Duration,
}

/// One of several sources of a state.
#[derive(Debug, Clone)]
pub struct NamedSource<S> {
    /// What diagnostics call it; empty for the only one.
    pub name: String,
    /// Whether it may stand in for others.
    pub settings: SourceSettings,
    /// Its signals.
    pub source: S,
}

impl<S> Sources<S> {
    /// A state with one source.
    pub fn only(source: S) -> Self {
        let settings = SourceSettings::default();
        Self {
            list: vec![NamedSource { name: String::new(), settings, source }],
            disagreement: Duration::ZERO,
        }
    }
}

/// One thing that tells the turn state.
#[derive(Debug, Clone)]
pub enum TurnSource {
    /// One enumerated signal.
    Enumerated(Role<TurnCode>),
    /// One steady signal a side.
    Pair(SidePair),
    /// One lamp a side, which blinks.
    Lamps {
        /// `true` = lit; both in the same message.
        pair: SidePair,
        /// Times.
        settings: LampSettings,
        /// Whether the message shows every flash.
        resolution: Resolution,
    },
    /// A stalk that springs back.
    Stalk {
        /// Where it is.
        role: Role<StalkPosition>,
        /// Rules and times.
        settings: StalkSettings,
    },
}

impl TurnSource {
    /// Whether it can tell that both sides are on.
    pub fn shows_both(&self) -> bool {
        match self {
            Self::Enumerated(role) => {
                role.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(TurnCode::Both))
            }
            Self::Pair(pair) | Self::Lamps { pair, .. } => pair.both == BothOn::Hazard,
            Self::Stalk { .. } => false,
        }
    }

    /// Its signals.
    pub fn signals(&self) -> impl Iterator<Item = SignalIndex> {
        let (first, second) = match self {
            Self::Enumerated(role) => (role.signal, None),
            Self::Pair(pair) | Self::Lamps { pair, .. } => (pair.left.signal, Some(pair.right.signal)),
            Self::Stalk { role, .. } => (role.signal, None),
        };
        std::iter::once(first).chain(second)
    }
}

/// One signal a side, `true` = on.
#[derive(Debug, Clone)]
pub struct SidePair {
    /// Left side.
    pub left: Role<bool>,
    /// Right side.
    pub right: Role<bool>,
    /// What both sides on at once means.
    pub both: BothOn,
}

/// What a pair with both sides on means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BothOn {
    /// The hazard lights are on.
    Hazard,
    /// The vehicle never sends it: an undefined value.
    Undefined,
}

/// Where the hazard state comes from.
#[derive(Debug, Clone)]
pub enum HazardBinding {
    /// The vehicle has no hazard lights: DISABLE for ever.
    NotFitted,
    /// The vehicle has them but the profile cannot see them: never published.
    Unbound,
    /// What the vehicle sends of them.
    From(Sources<HazardSource>),
}

/// One thing that tells the hazard state.
#[derive(Debug, Clone)]
pub enum HazardSource {
    /// Both turn sides on at once, as told by the turn sources that can show it.
    BothSides,
    /// A signal of its own.
    Signal {
        /// The signal.
        role: Role<HazardCode>,
        /// Names of the reasons that [`HazardCode::reason`] points into; empty when it has none.
        reasons: Vec<String>,
    },
    /// A button that springs back: each press turns the lights on or off.
    Button {
        /// `true` = pressed.
        role: Role<bool>,
        /// Longest time of unknown positions that cannot hide a press.
        blind: Duration,
        /// How long it must be watched before the state is known.
        settle: Duration,
    },
}

/// What a hazard signal can say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct HazardCode {
    /// Whether the hazard lights are on.
    pub active: bool,
    /// Why, as a position in the binding's list of reasons.
    pub reason: Option<u8>,
}

/// Signals that report a broken sensor or lamp, and what that does to the report.
#[derive(Debug, Clone, Default)]
pub struct FaultBinding {
    /// `true` = fault; each with the text an operator reads.
    pub signals: Vec<FaultSignal>,
    /// What a fault does to a report whose state is still defined.
    pub on_fault: OnFault,
}

/// One signal that reports a fault.
#[derive(Debug, Clone)]
pub struct FaultSignal {
    /// `true` = broken.
    pub role: Role<bool>,
    /// What an operator reads, e.g. `left front lamp`.
    pub text: String,
}

/// What a reported fault does to a report whose state is still defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum OnFault {
    /// Keep publishing; diagnostics say ERROR.
    #[default]
    Report,
    /// Stop publishing.
    Withhold,
}

/// What the turn report says while the hazard lights are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TurnWhileHazard {
    /// DISABLE, as every known vehicle interface does.
    #[default]
    Disable,
    /// What the turn signal itself says.
    Keep,
}
