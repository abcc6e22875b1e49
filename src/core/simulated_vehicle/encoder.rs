//! What a signal of the vehicle is to say, and the raw value that says it.

use crate::core::command::Turn;
use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::dbc::codec::SignalCodec;
use crate::core::validation::meaning::{Meaning, ValueMap};
use crate::core::vehicle_lights::binding::BothOn;
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::stalk::StalkPosition;
use crate::core::vehicle_lights::state::{HazardCode, TurnCode};

/// What the vehicle's signals are about, at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct VehicleState {
    /// Which lights flash, as the vehicle reports it.
    pub(super) code: TurnCode,
    /// Which lamps are lit, as the vehicle reports it.
    pub(super) lit: Sides,
    /// Where the driver's stalk is.
    pub(super) stalk: StalkPosition,
    /// Whether the hazard button is pressed.
    pub(super) button: bool,
    /// What becomes of the reports of all this.
    pub(super) quality: ReportQuality,
    /// Broken bulbs, which fault signals tell.
    pub(super) broken: Sides,
    /// What the control mode is.
    pub(super) mode: ControlMode,
    /// What the driver does at this moment in the place of the commands.
    pub(super) driver: Grants,
}

/// What becomes of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ReportQuality {
    /// It says what is so.
    #[default]
    Valid,
    /// "Not available."
    NotAvailable,
    /// "Fault."
    Fault,
    /// A value without a meaning.
    Undefined,
}

/// One thing that a signal says, by the profile's values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum SignalContent {
    Turn(ValueMap<TurnCode>),
    Side {
        is_left: bool,
        both: BothOn,
        values: ValueMap<bool>,
    },
    Lamp {
        is_left: bool,
        values: ValueMap<bool>,
    },
    Stalk(ValueMap<StalkPosition>),
    Hazard(ValueMap<HazardCode>),
    Button(ValueMap<bool>),
    /// A fault signal, of the sides that its name or text speaks of.
    Fault {
        of: Sides,
        values: ValueMap<bool>,
    },
    Mode(ValueMap<ControlMode>),
    Driver {
        overrides: Grants,
        values: ValueMap<bool>,
    },
}

impl SignalContent {
    /// Whether `raw` says what is so. What a signal has no words for, it need not say.
    fn accepts(&self, raw: i128, state: &VehicleState) -> bool {
        let quality = state.quality;
        match self {
            Self::Turn(values) => {
                content(values, raw, quality, |code| code == turn_command_value(values, state.code))
            }
            Self::Side { is_left, both, values } => {
                content(values, raw, quality, |on| on == side_word(*is_left, *both, state.code))
            }
            Self::Lamp { is_left, values } => {
                let lit = if *is_left { state.lit.left } else { state.lit.right };
                content(values, raw, quality, |said| said == lit)
            }
            Self::Stalk(values) => content(values, raw, quality, |position| position == state.stalk),
            Self::Hazard(values) => {
                content(values, raw, quality, |code| code.active == (state.code == TurnCode::Both))
            }
            Self::Button(values) => content(values, raw, quality, |pressed| pressed == state.button),
            Self::Fault { of, values } => {
                let broken = of.left && state.broken.left || of.right && state.broken.right;
                content(values, raw, ReportQuality::Valid, |said| said == broken)
            }
            Self::Mode(values) => content(values, raw, ReportQuality::Valid, |mode| mode == state.mode),
            Self::Driver { overrides, values } => {
                let acts = overrides.turn && state.driver.turn || overrides.hazard && state.driver.hazard;
                content(values, raw, ReportQuality::Valid, |said| said == acts)
            }
        }
    }

    /// The lowest raw value of each meaning.
    fn candidates(&self) -> Vec<i128> {
        match self {
            Self::Turn(values) => firsts(values),
            Self::Side { values, .. }
            | Self::Lamp { values, .. }
            | Self::Button(values)
            | Self::Fault { values, .. }
            | Self::Driver { values, .. } => firsts(values),
            Self::Stalk(values) => firsts(values),
            Self::Hazard(values) => firsts(values),
            Self::Mode(values) => firsts(values),
        }
    }

    /// Whether the profile gives `raw` that fate.
    fn has_quality(&self, raw: i128, quality: ReportQuality) -> bool {
        match self {
            Self::Turn(values) => content(values, raw, quality, |_| true),
            Self::Side { values, .. }
            | Self::Lamp { values, .. }
            | Self::Button(values)
            | Self::Fault { values, .. }
            | Self::Driver { values, .. } => content(values, raw, quality, |_| true),
            Self::Stalk(values) => content(values, raw, quality, |_| true),
            Self::Hazard(values) => content(values, raw, quality, |_| true),
            Self::Mode(values) => content(values, raw, quality, |_| true),
        }
    }
}

/// Whether `raw` has the fate that is asked for; [`ReportQuality::Valid`] with the right value.
fn content<T: Copy>(
    values: &ValueMap<T>,
    raw: i128,
    quality: ReportQuality,
    is_right: impl Fn(T) -> bool,
) -> bool {
    match (quality, values.meaning(raw)) {
        (ReportQuality::Valid, Meaning::Defined(value)) => is_right(value),
        (ReportQuality::NotAvailable, Meaning::NotAvailable)
        | (ReportQuality::Fault, Meaning::Fault)
        | (ReportQuality::Undefined, Meaning::Undefined) => true,
        (
            ReportQuality::Valid
            | ReportQuality::NotAvailable
            | ReportQuality::Fault
            | ReportQuality::Undefined,
            Meaning::Defined(_) | Meaning::NotAvailable | Meaning::Fault | Meaning::Undefined,
        ) => false,
    }
}

fn firsts<T: Copy>(values: &ValueMap<T>) -> Vec<i128> {
    values.entries().iter().map(|(range, _)| range.first).collect()
}

/// A signal that knows no hazard says off meanwhile.
fn turn_command_value(values: &ValueMap<TurnCode>, code: TurnCode) -> TurnCode {
    let knows_both = values.entries().iter().any(|(_, known)| *known == Meaning::Defined(TurnCode::Both));
    if code == TurnCode::Both && !knows_both { TurnCode::Off } else { code }
}

fn side_word(is_left: bool, both: BothOn, code: TurnCode) -> bool {
    match code {
        TurnCode::Off => false,
        TurnCode::Left => is_left,
        TurnCode::Right => !is_left,
        TurnCode::Both => both == BothOn::Hazard,
    }
}

/// A signal the vehicle sends, with all that it says.
#[derive(Debug, Clone)]
pub(super) struct SignalEncoder {
    pub(super) codec: SignalCodec,
    content: Vec<SignalContent>,
    /// Raw values that mean something, and the first few that do not.
    candidates: Vec<i128>,
}

/// Raw values looked at for one without a meaning.
const SEARCHED: i128 = 256;

impl SignalEncoder {
    pub(super) fn new(codec: SignalCodec) -> Self {
        Self { codec, content: Vec::new(), candidates: Vec::new() }
    }

    /// Has it say one thing more.
    pub(super) fn add(&mut self, content: SignalContent) {
        self.candidates.extend(content.candidates());
        self.content.push(content);
        let (lowest, highest) = self.codec.range();
        self.candidates.retain(|raw| (lowest..=highest).contains(raw));
        let mut searched = lowest..=highest.min(lowest.saturating_add(SEARCHED));
        let undefined = searched.find(|raw| {
            self.content.iter().all(|content| content.has_quality(*raw, ReportQuality::Undefined))
        });
        self.candidates.extend(undefined);
    }

    /// Whether it says something of a kind.
    pub(super) fn encodes_any(&self, of: &dyn Fn(&SignalContent) -> bool) -> bool {
        self.content.iter().any(of)
    }

    /// Whether one of its raw values has that fate, whatever else it says.
    pub(super) fn has_value_of(&self, content: &SignalContent, quality: ReportQuality) -> bool {
        self.candidates.iter().any(|raw| content.has_quality(*raw, quality))
    }

    /// The raw value that says what is so: all of it if there is one, else the first thing that can be
    /// said.
    pub(super) fn raw(&self, state: &VehicleState) -> Option<i128> {
        let mut candidates = self.candidates.iter().copied();
        let all = candidates.find(|raw| self.content.iter().all(|content| content.accepts(*raw, state)));
        let first = || {
            let one = |content: &SignalContent| {
                self.candidates.iter().copied().find(|raw| content.accepts(*raw, state))
            };
            self.content.iter().find_map(one)
        };
        all.or_else(first)
    }
}

/// The sides that a text speaks of; both if it names none.
pub(super) fn sides_named(text: &str) -> Sides {
    let text = text.to_ascii_lowercase();
    let (left, right) = (text.contains("left"), text.contains("right"));
    if left || right { Sides { left, right } } else { Sides { left: true, right: true } }
}

/// What a driver's hand does with the stalk for a turn: all the way.
pub(super) fn full(turn: Turn) -> StalkPosition {
    match turn {
        Turn::Off => StalkPosition::Idle,
        Turn::Left => StalkPosition::LeftFull,
        Turn::Right => StalkPosition::RightFull,
    }
}

/// Likewise, to the first detent.
pub(super) fn half(turn: Turn) -> StalkPosition {
    match turn {
        Turn::Off => StalkPosition::Idle,
        Turn::Left => StalkPosition::LeftHalf,
        Turn::Right => StalkPosition::RightHalf,
    }
}
