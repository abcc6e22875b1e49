//! Raw values of the signals that the vehicle sends.

use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::dbc::codec::SignalCodec;
use crate::core::validation::meaning::{Meaning, ValueMap};
use crate::core::vehicle_lights::binding::BothOn;
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::stalk::StalkPosition;
use crate::core::vehicle_lights::state::TurnCode;

/// State of the vehicle that its signals report, at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct VehicleState {
    /// Lights that flash, as the vehicle reports them.
    pub(super) code: TurnCode,
    /// Lamps that are lit, as the vehicle reports them.
    pub(super) lit: Sides,
    /// Position of the driver's stalk.
    pub(super) stalk: StalkPosition,
    /// True if the hazard button is pressed.
    pub(super) button: bool,
    /// Quality of the reports of all this.
    pub(super) quality: ReportQuality,
    /// Defective bulbs, which fault signals report.
    pub(super) broken: Sides,
    /// Current control mode.
    pub(super) mode: ControlMode,
    /// Functions that the driver uses in place of the commands.
    pub(super) driver: Grants,
}

/// Quality of the reports of the lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ReportQuality {
    /// The reports show the state.
    #[default]
    Valid,
    /// The reports show "not available".
    NotAvailable,
    /// The reports show "fault".
    Fault,
    /// The reports have a raw value without a meaning.
    Undefined,
}

impl<T> From<Meaning<T>> for ReportQuality {
    fn from(meaning: Meaning<T>) -> Self {
        match meaning {
            Meaning::Defined(_) => Self::Valid,
            Meaning::NotAvailable => Self::NotAvailable,
            Meaning::Fault => Self::Fault,
            Meaning::Undefined => Self::Undefined,
        }
    }
}

/// A value of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SignalValue {
    Turn(TurnCode),
    On(bool),
    Stalk(StalkPosition),
    Mode(ControlMode),
}

/// Part of the vehicle's state that a signal reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Subject {
    Turn,
    Side {
        is_left: bool,
        both: BothOn,
    },
    Lamp {
        is_left: bool,
    },
    Stalk,
    Hazard,
    Button,
    /// Condition under which a source applies, which is always on.
    Condition,
    /// Defective bulbs of the sides that the name or text of the signal mentions.
    Fault {
        of: Sides,
    },
    Mode,
    Driver {
        overrides: Grants,
    },
}

impl Subject {
    /// True if the quality of the reports applies to it.
    fn has_quality(self) -> bool {
        match self {
            Self::Condition | Self::Fault { .. } | Self::Mode | Self::Driver { .. } => false,
            Self::Turn
            | Self::Side { .. }
            | Self::Lamp { .. }
            | Self::Stalk
            | Self::Hazard
            | Self::Button => true,
        }
    }
}

/// One content of a signal: its subject with the values of the profile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SignalContent {
    pub(super) subject: Subject,
    pub(super) values: ValueMap<SignalValue>,
}

impl SignalContent {
    /// True if `raw` reports the state with its quality.
    fn accepts(&self, raw: i128, state: &VehicleState) -> bool {
        let quality = if self.subject.has_quality() { state.quality } else { ReportQuality::Valid };
        let meaning = self.values.meaning(raw);
        let is_right = if let Meaning::Defined(value) = meaning { value == self.value(state) } else { true };
        is_right && ReportQuality::from(meaning) == quality
    }

    /// The value that reports the state.
    fn value(&self, state: &VehicleState) -> SignalValue {
        let hazard = state.code == TurnCode::Both;
        match self.subject {
            // A signal without a value for hazard reports off meanwhile.
            Subject::Turn if hazard && !self.knows(SignalValue::Turn(TurnCode::Both)) => {
                SignalValue::Turn(TurnCode::Off)
            }
            Subject::Turn => SignalValue::Turn(state.code),
            Subject::Side { is_left, both } => SignalValue::On(match state.code {
                TurnCode::Off => false,
                TurnCode::Left => is_left,
                TurnCode::Right => !is_left,
                TurnCode::Both => both == BothOn::Hazard,
            }),
            Subject::Lamp { is_left } => {
                SignalValue::On(if is_left { state.lit.left } else { state.lit.right })
            }
            Subject::Stalk => SignalValue::Stalk(state.stalk),
            Subject::Hazard => SignalValue::On(hazard),
            Subject::Button => SignalValue::On(state.button),
            Subject::Condition => SignalValue::On(true),
            Subject::Fault { of } => {
                SignalValue::On(of.left && state.broken.left || of.right && state.broken.right)
            }
            Subject::Mode => SignalValue::Mode(state.mode),
            Subject::Driver { overrides } => SignalValue::On(
                overrides.turn && state.driver.turn || overrides.hazard && state.driver.hazard,
            ),
        }
    }

    fn knows(&self, value: SignalValue) -> bool {
        self.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(value))
    }

    /// True if the profile gives `raw` a meaning of this quality.
    fn has_quality(&self, raw: i128, quality: ReportQuality) -> bool {
        ReportQuality::from(self.values.meaning(raw)) == quality
    }
}

/// A signal that the vehicle sends, with all its contents.
#[derive(Debug, Clone)]
pub(super) struct SignalEncoder {
    pub(super) codec: SignalCodec,
    contents: Vec<SignalContent>,
    /// Raw values with a meaning, and the first ones without.
    candidates: Vec<i128>,
}

/// Number of raw values searched for one without a meaning.
const SEARCHED: i128 = 256;

impl SignalEncoder {
    pub(super) fn new(codec: SignalCodec) -> Self {
        Self { codec, contents: Vec::new(), candidates: Vec::new() }
    }

    /// Adds a content.
    pub(super) fn add(&mut self, content: SignalContent) {
        self.candidates.extend(content.values.entries().iter().map(|(range, _)| range.first));
        self.contents.push(content);
        let (lowest, highest) = self.codec.range();
        self.candidates.retain(|raw| (lowest..=highest).contains(raw));
        let mut searched = lowest..=highest.min(lowest.saturating_add(SEARCHED));
        let undefined = |content: &SignalContent, raw| content.has_quality(raw, ReportQuality::Undefined);
        let undefined = searched.find(|raw| self.contents.iter().all(|content| undefined(content, *raw)));
        self.candidates.extend(undefined);
    }

    /// True if it reports a subject for which `is_wanted` holds.
    pub(super) fn encodes_any(&self, is_wanted: fn(Subject) -> bool) -> bool {
        self.contents.iter().any(|content| is_wanted(content.subject))
    }

    /// True if it reports the lights and has a raw value of this quality.
    pub(super) fn can_have(&self, quality: ReportQuality) -> bool {
        let has_value =
            |content: &SignalContent| self.candidates.iter().any(|raw| content.has_quality(*raw, quality));
        self.contents.iter().any(|content| content.subject.has_quality() && has_value(content))
    }

    /// The raw value that reports the state: of all contents if there is one, else of the first content
    /// that has one; `None` when no content has one.
    pub(super) fn raw(&self, state: &VehicleState) -> Option<i128> {
        let mut candidates = self.candidates.iter().copied();
        let all = candidates.find(|raw| self.contents.iter().all(|content| content.accepts(*raw, state)));
        let one = |content: &SignalContent| {
            self.candidates.iter().copied().find(|raw| content.accepts(*raw, state))
        };
        all.or_else(|| self.contents.iter().find_map(one))
    }
}
