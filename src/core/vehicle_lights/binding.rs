//! What a vehicle profile says of the lights, compiled: which signals tell them, and how.
//!
//! Built once at start by `config::settings`, which has checked it against the DBC. Everything
//! here is by index: nothing is looked up by name per frame.

use std::time::Duration;

use super::fusion::SourceSettings;
use super::lamp::LampSettings;
use super::lamp::timing::Resolution;
use super::stalk::{StalkPosition, StalkSettings};
use super::state::{HazardCode, TurnCode};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::table::{FaultSignal, Role, SignalIndex, SignalTable};

/// Everything the profile binds for turn indicators and hazard lights.
#[derive(Debug, Clone)]
pub struct LightsBinding {
    /// The messages and signals it takes.
    pub table: SignalTable,
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

/// Where the turn state comes from.
#[derive(Debug, Clone)]
pub enum TurnBinding {
    /// The profile does not speak of them: never published, and no diagnostics.
    LeftOut,
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
    /// The profile does not speak of them: never published, and no diagnostics.
    LeftOut,
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
        max_gap: Duration,
        /// How long it must be watched before the state is known.
        startup_delay: Duration,
    },
}

/// Signals that report a broken sensor or lamp, and what that does to the report.
#[derive(Debug, Clone, Default)]
pub struct FaultBinding {
    /// `true` = fault; each with the text an operator reads.
    pub signals: Vec<FaultSignal>,
    /// What a fault does to a report whose state is still defined.
    pub on_fault: OnFault,
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
