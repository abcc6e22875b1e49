//! Binding of a vehicle's lights to signals, compiled from its profile.
//!
//! Built once at start-up by `config`, which has checked it against the DBC. Everything is addressed by
//! index, so no name is looked up per frame.

use std::time::Duration;

use super::lamp::LampSettings;
use super::lamp::timing::Resolution;
use super::stalk::{StalkPosition, StalkSettings};
use super::state::{HazardCode, Sides, TurnCode};
use can_signal::validation::meaning::Meaning;
use can_signal::validation::requirement::Requirement;
use can_signal::validation::table::{Role, SignalIndex, SignalTable};

/// Binding of turn indicators and hazard lights.
#[derive(Debug, Clone, PartialEq, Default)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct LightsBinding {
    pub table: SignalTable,
    /// Observations required before anything is reported.
    pub requirements: Vec<Requirement>,
    pub turn: TurnBinding,
    pub turn_faults: FaultBinding,
    pub hazard: HazardBinding,
    pub hazard_faults: FaultBinding,
    /// Content of the turn report while the hazard lights are on.
    pub turn_while_hazard: TurnWhileHazard,
}

/// Binding of one state.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StateBinding<S> {
    /// The profile does not mention the lights: no reports and no diagnostics.
    #[default]
    LeftOut,
    /// The vehicle does not have the lights: DISABLE is reported.
    NotFitted,
    /// The vehicle has the lights, but no signal shows them: nothing is reported.
    NotVisible {
        /// True if the configuration accepts the missing report.
        is_acknowledged: bool,
    },
    /// The vehicle sends the state from these sources.
    From(Sources<S>),
}

/// Binding of the turn indicators, never [`StateBinding::NotVisible`].
pub type TurnBinding = StateBinding<TurnSource>;

/// Binding of the hazard lights.
pub type HazardBinding = StateBinding<HazardSource>;

impl<S> StateBinding<S> {
    /// Returns the sources of the state, most trusted first; empty if there are none.
    pub fn sources(&self) -> &[NamedSource<S>] {
        match self {
            Self::LeftOut | Self::NotFitted | Self::NotVisible { .. } => &[],
            Self::From(sources) => &sources.list,
        }
    }
}

impl LightsBinding {
    /// Returns true if the configuration accepts that the hazard lights are not visible.
    pub fn is_acknowledged(&self) -> bool {
        matches!(self.hazard, HazardBinding::NotVisible { is_acknowledged: true })
    }
}

/// Sources of one state.
#[derive(Debug, Clone, PartialEq)]
pub struct Sources<S> {
    /// At least one source, most trusted first.
    pub list: Vec<NamedSource<S>>,
    /// Time for which a source may contradict the deciding one before diagnostics show a warning.
    pub disagreement: Duration,
}

/// One of several sources of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSource<S> {
    /// Name in diagnostics; empty for the only source.
    pub name: String,
    /// True if the source may replace an unavailable source above it.
    pub is_fallback: bool,
    /// Signal that must be on for the source to apply, e.g. the flag of a lamp group; `None` = the source
    /// always applies.
    pub condition: Option<Role<bool>>,
    /// Signals of the source.
    pub source: S,
}

impl<S> NamedSource<S> {
    /// Returns the signal of its condition; `None` if it has none.
    pub fn condition_signal(&self) -> Option<SignalIndex> {
        self.condition.as_ref().map(|role| role.signal)
    }
}

impl<S> Sources<S> {
    /// Creates a state with one source.
    pub fn only(source: S) -> Self {
        Self {
            list: vec![NamedSource { name: String::new(), is_fallback: false, condition: None, source }],
            disagreement: Duration::ZERO,
        }
    }
}

/// A source of the turn state.
#[derive(Debug, Clone, PartialEq)]
pub enum TurnSource {
    /// One enumerated signal for both sides.
    Enumerated {
        /// State of the turn indicators.
        role: Role<TurnCode>,
        /// Minimum time for which a side is on after its press; `None` = as long as the signal shows it.
        tap_hold: Option<Duration>,
    },
    /// One steady signal per side.
    Pair {
        /// Signals of the sides.
        pair: SidePair,
        /// Like `tap_hold` of [`Self::Enumerated`].
        tap_hold: Option<Duration>,
    },
    /// One flashing lamp signal per side.
    Lamps {
        /// Lamps, where `true` = lit, both in the same message.
        pair: SidePair,
        /// Times for the evaluation of flashes.
        settings: LampSettings,
        /// True if the message shows every flash.
        resolution: Resolution,
    },
    /// A momentary stalk, which returns to its middle position.
    Stalk {
        /// Position of the stalk.
        role: Role<StalkPosition>,
        /// Rules and times of the stalk.
        settings: StalkSettings,
    },
}

impl TurnSource {
    /// Returns true if the source can report that both sides are on.
    pub fn shows_both(&self) -> bool {
        match self {
            Self::Enumerated { role, .. } => {
                role.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(TurnCode::Both))
            }
            Self::Pair { pair, .. } | Self::Lamps { pair, .. } => pair.both == BothOn::Hazard,
            Self::Stalk { .. } => false,
        }
    }

    /// Returns the signals of the source.
    pub fn signals(&self) -> impl Iterator<Item = SignalIndex> {
        let (first, second) = match self {
            Self::Enumerated { role, .. } => (role.signal, None),
            Self::Pair { pair, .. } | Self::Lamps { pair, .. } => (pair.left.signal, Some(pair.right.signal)),
            Self::Stalk { role, .. } => (role.signal, None),
        };
        std::iter::once(first).chain(second)
    }
}

/// One signal per side, `true` = on.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub struct SidePair {
    pub left: Role<bool>,
    pub right: Role<bool>,
    /// Meaning of both sides being on at once.
    pub both: BothOn,
}

/// Meaning of both sides of a pair being on at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BothOn {
    /// The hazard lights are on.
    Hazard,
    /// The vehicle never sends this, so it counts as an undefined value.
    Undefined,
}

/// A source of the hazard state.
#[derive(Debug, Clone, PartialEq)]
pub enum HazardSource {
    /// Both turn sides on at once, from the turn sources that can report it.
    BothSides,
    /// A separate signal.
    Signal {
        /// Signal of the hazard lights.
        role: Role<HazardCode>,
        /// Names of the reasons, indexed by [`HazardCode::reason`].
        reasons: Vec<String>,
    },
    /// A momentary button; each press switches the lights on or off.
    Button {
        /// Position of the button, `true` = pressed.
        role: Role<bool>,
        /// Longest gap in the positions that cannot hide a press.
        max_gap: Duration,
        /// Time for which the button must be observed before the state is known.
        startup_delay: Duration,
    },
}

impl HazardSource {
    /// Returns the signal of the source; `None` for a source that follows the turn sources.
    pub fn signal(&self) -> Option<SignalIndex> {
        match self {
            Self::BothSides => None,
            Self::Signal { role, .. } => Some(role.signal),
            Self::Button { role, .. } => Some(role.signal),
        }
    }
}

/// Signals that report a defective sensor or lamp, and the effect of a fault on the report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaultBinding {
    /// Fault signals, each with a text for diagnostics.
    pub signals: Vec<FaultSignal>,
    /// Effect of a fault on a report whose state is still defined.
    pub on_fault: OnFault,
}

/// A signal that reports a defective part.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultSignal {
    /// Signal, where `true` = defective.
    pub role: Role<bool>,
    /// Sides whose lamps the part concerns.
    pub sides: Sides,
    /// Name of the part in diagnostics, e.g. `left front lamp`.
    pub text: String,
}

/// Effect of a reported fault on a report whose state is still defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum OnFault {
    /// Publishing continues, with ERROR in diagnostics.
    #[default]
    Report,
    /// The report is no longer published.
    Withhold,
}

/// Content of the turn report while the hazard lights are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TurnWhileHazard {
    /// DISABLE, as in every known vehicle interface.
    #[default]
    Disable,
    /// The state of the turn signals themselves.
    Keep,
}
