//! What a signal of the vehicle is to say, and the raw value that says it.

use crate::core::command::Turn;
use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::dbc::codec::SignalCodec;
use crate::core::trust::meaning::{Meaning, ValueMap};
use crate::core::vehicle_lights::binding::{BothOn, HazardCode, TurnCode};
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::stalk::StalkPosition;

/// What the vehicle's signals are about, at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Picture {
    /// Which lights flash, as the vehicle reports it.
    pub(super) code: TurnCode,
    /// Which lamps are lit, as the vehicle reports it.
    pub(super) lit: Sides,
    /// Where the driver's stalk is.
    pub(super) stalk: StalkPosition,
    /// Whether the hazard button is pressed.
    pub(super) button: bool,
    /// What becomes of the reports of all this.
    pub(super) fate: Fate,
    /// Broken bulbs, which fault signals tell.
    pub(super) broken: Sides,
    /// What the control mode is.
    pub(super) mode: ControlMode,
    /// What the driver does at this moment in the place of the commands.
    pub(super) driver: Grants,
}

/// What becomes of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Fate {
    /// It says what is so.
    #[default]
    Told,
    /// "Not available."
    NotAvailable,
    /// "Fault."
    Fault,
    /// A value without a meaning.
    Undefined,
}

/// One thing that a signal says, by the profile's values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Says {
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
        takes: Grants,
        values: ValueMap<bool>,
    },
}

impl Says {
    /// Whether `raw` says what is so. What a signal has no words for, it need not say.
    fn accepts(&self, raw: i128, picture: &Picture) -> bool {
        let fate = picture.fate;
        match self {
            Self::Turn(values) => says(values, raw, fate, |code| code == turn_word(values, picture.code)),
            Self::Side { is_left, both, values } => {
                says(values, raw, fate, |on| on == side_word(*is_left, *both, picture.code))
            }
            Self::Lamp { is_left, values } => {
                let lit = if *is_left { picture.lit.left } else { picture.lit.right };
                says(values, raw, fate, |said| said == lit)
            }
            Self::Stalk(values) => says(values, raw, fate, |position| position == picture.stalk),
            Self::Hazard(values) => {
                says(values, raw, fate, |code| code.active == (picture.code == TurnCode::Both))
            }
            Self::Button(values) => says(values, raw, fate, |pressed| pressed == picture.button),
            Self::Fault { of, values } => {
                let broken = of.left && picture.broken.left || of.right && picture.broken.right;
                says(values, raw, Fate::Told, |said| said == broken)
            }
            Self::Mode(values) => says(values, raw, Fate::Told, |mode| mode == picture.mode),
            Self::Driver { takes, values } => {
                let acts = takes.turn && picture.driver.turn || takes.hazard && picture.driver.hazard;
                says(values, raw, Fate::Told, |said| said == acts)
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
    fn has_fate(&self, raw: i128, fate: Fate) -> bool {
        match self {
            Self::Turn(values) => says(values, raw, fate, |_| true),
            Self::Side { values, .. }
            | Self::Lamp { values, .. }
            | Self::Button(values)
            | Self::Fault { values, .. }
            | Self::Driver { values, .. } => says(values, raw, fate, |_| true),
            Self::Stalk(values) => says(values, raw, fate, |_| true),
            Self::Hazard(values) => says(values, raw, fate, |_| true),
            Self::Mode(values) => says(values, raw, fate, |_| true),
        }
    }
}

/// Whether `raw` has the fate that is asked for; [`Fate::Told`] with the right value.
fn says<T: Copy>(values: &ValueMap<T>, raw: i128, fate: Fate, is_right: impl Fn(T) -> bool) -> bool {
    match (fate, values.meaning(raw)) {
        (Fate::Told, Meaning::Defined(value)) => is_right(value),
        (Fate::NotAvailable, Meaning::NotAvailable)
        | (Fate::Fault, Meaning::Fault)
        | (Fate::Undefined, Meaning::Undefined) => true,
        (
            Fate::Told | Fate::NotAvailable | Fate::Fault | Fate::Undefined,
            Meaning::Defined(_) | Meaning::NotAvailable | Meaning::Fault | Meaning::Undefined,
        ) => false,
    }
}

fn firsts<T: Copy>(values: &ValueMap<T>) -> Vec<i128> {
    values.entries().iter().map(|(range, _)| range.first).collect()
}

/// A signal that knows no hazard says off meanwhile.
fn turn_word(values: &ValueMap<TurnCode>, code: TurnCode) -> TurnCode {
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
pub(super) struct Speaker {
    pub(super) codec: SignalCodec,
    says: Vec<Says>,
    /// Raw values that mean something, and the first few that do not.
    candidates: Vec<i128>,
}

/// Raw values looked at for one without a meaning.
const SEARCHED: i128 = 256;

impl Speaker {
    pub(super) fn new(codec: SignalCodec) -> Self {
        Self { codec, says: Vec::new(), candidates: Vec::new() }
    }

    /// Has it say one thing more.
    pub(super) fn add(&mut self, says: Says) {
        self.candidates.extend(says.candidates());
        self.says.push(says);
        let (lowest, highest) = self.codec.range();
        self.candidates.retain(|raw| (lowest..=highest).contains(raw));
        let mut searched = lowest..=highest.min(lowest.saturating_add(SEARCHED));
        let undefined =
            searched.find(|raw| self.says.iter().all(|says| says.has_fate(*raw, Fate::Undefined)));
        self.candidates.extend(undefined);
    }

    /// Whether it says something of a kind.
    pub(super) fn says_any(&self, of: &dyn Fn(&Says) -> bool) -> bool {
        self.says.iter().any(of)
    }

    /// Whether one of its raw values has that fate, whatever else it says.
    pub(super) fn has_value_of(&self, says: &Says, fate: Fate) -> bool {
        self.candidates.iter().any(|raw| says.has_fate(*raw, fate))
    }

    /// The raw value that says what is so: all of it if there is one, else the first thing that can be
    /// said.
    pub(super) fn raw(&self, picture: &Picture) -> Option<i128> {
        let mut candidates = self.candidates.iter().copied();
        let all = candidates.find(|raw| self.says.iter().all(|says| says.accepts(*raw, picture)));
        let first = || {
            let one = |says: &Says| self.candidates.iter().copied().find(|raw| says.accepts(*raw, picture));
            self.says.iter().find_map(one)
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
