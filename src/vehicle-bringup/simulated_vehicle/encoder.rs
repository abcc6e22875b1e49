//! Raw values of the signals that the vehicle sends.

use super::measured::{Measured, MeasuredQuantity, QuantityPart};
use super::motion::{MotionState, Readings};
use can_signal::dbc::codec::SignalCodec;
use can_signal::validation::meaning::{Meaning, ValueMap};
use gateway_core::command::control_mode::Grants;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::binding::BothOn;
use gateway_core::vehicle_lights::stalk::StalkPosition;
use gateway_core::vehicle_lights::state::{Sides, TurnCode};
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::gear::{Gear, GearCode};
use gateway_core::vehicle_status::velocity::binding::Motion;

/// State of the vehicle that its signals report, at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReportedState {
    pub(super) code: TurnCode,
    pub(super) lit: Sides,
    pub(super) stalk: StalkPosition,
    pub(super) button: bool,
    /// Quality with which all of this is reported.
    pub(super) quality: Meaning<()>,
    /// Defective bulbs, which fault signals report.
    pub(super) broken: Sides,
    pub(super) mode: ControlMode,
    pub(super) driver: Grants,
    pub(super) readings: Readings,
    /// A bit for each door in the order of the profile, 1 = open.
    pub(super) open_doors: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SignalValue {
    Turn(TurnCode),
    On(bool),
    Stalk(StalkPosition),
    Mode(ControlMode),
    Gear(GearCode),
    Motion(Motion),
    Door(DoorState),
}

/// Part of the vehicle's state that a signal reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReportedSubject {
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
    /// Defective bulbs of these sides.
    Fault {
        sides: Sides,
    },
    Mode,
    Driver {
        overrides: Grants,
    },
    /// A switch that is on in some control modes.
    OnIn(&'static [ControlMode]),
    Gear,
    /// Direction of the motion.
    Direction,
    /// The sign of a quantity.
    Opposite {
        measured: Measured,
        is_magnitude_negative: bool,
    },
    /// A door, by its position in the profile.
    Door(usize),
}

impl ReportedSubject {
    /// Returns true if the quality of the reports applies to it.
    fn has_quality(self) -> bool {
        matches!(
            self,
            Self::Turn | Self::Side { .. } | Self::Lamp { .. } | Self::Stalk | Self::Hazard | Self::Button
        )
    }
}

/// One content of a signal: its subject with the values of the profile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SignalContent {
    pub(super) subject: ReportedSubject,
    pub(super) values: ValueMap<SignalValue>,
}

impl SignalContent {
    /// Returns true if `raw` reports the state with its quality.
    fn accepts(&self, raw: i128, state: &ReportedState) -> bool {
        let quality = if self.subject.has_quality() { state.quality } else { Meaning::Defined(()) };
        let meaning = self.values.meaning(raw);
        let is_right = if let Meaning::Defined(value) = meaning { value == self.value(state) } else { true };
        is_right && meaning.map(|_| ()) == quality
    }

    /// Returns the value that reports the state.
    fn value(&self, state: &ReportedState) -> SignalValue {
        let hazard = state.code == TurnCode::Both;
        match self.subject {
            // A signal without a value for hazard reports off while the hazard lights are on.
            ReportedSubject::Turn if hazard && !self.knows(SignalValue::Turn(TurnCode::Both)) => {
                SignalValue::Turn(TurnCode::Off)
            }
            ReportedSubject::Turn => SignalValue::Turn(state.code),
            ReportedSubject::Side { is_left, both } => SignalValue::On(match state.code {
                TurnCode::Off => false,
                TurnCode::Left => is_left,
                TurnCode::Right => !is_left,
                TurnCode::Both => both == BothOn::Hazard,
            }),
            ReportedSubject::Lamp { is_left } => {
                SignalValue::On(if is_left { state.lit.left } else { state.lit.right })
            }
            ReportedSubject::Stalk => SignalValue::Stalk(state.stalk),
            ReportedSubject::Hazard => SignalValue::On(hazard),
            ReportedSubject::Button => SignalValue::On(state.button),
            ReportedSubject::Condition => SignalValue::On(true),
            ReportedSubject::Fault { sides } => {
                SignalValue::On(sides.left && state.broken.left || sides.right && state.broken.right)
            }
            ReportedSubject::Mode => SignalValue::Mode(state.mode),
            ReportedSubject::Driver { overrides } => SignalValue::On(
                overrides.turn && state.driver.turn || overrides.hazard && state.driver.hazard,
            ),
            ReportedSubject::OnIn(modes) => SignalValue::On(modes.contains(&state.mode)),
            ReportedSubject::Gear => self.known(gear_codes(state.readings.motion.gear)),
            ReportedSubject::Direction => self.known(motions(state.readings.motion)),
            ReportedSubject::Opposite { measured, is_magnitude_negative } => {
                SignalValue::On(state.readings.is_opposite(measured, is_magnitude_negative))
            }
            ReportedSubject::Door(door) if state.open_doors & (1 << door) != 0 => {
                SignalValue::Door(DoorState::Opened)
            }
            ReportedSubject::Door(_) => SignalValue::Door(DoorState::Closed),
        }
    }

    /// Returns the first value that the signal supports, or the last one if it supports none.
    fn known(&self, values: impl Iterator<Item = SignalValue> + Clone) -> SignalValue {
        let known = values.clone().find(|value| self.knows(*value));
        known.or_else(|| values.last()).unwrap_or(SignalValue::On(false))
    }

    fn knows(&self, value: SignalValue) -> bool {
        self.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(value))
    }

    /// Returns true if the profile gives `raw` a meaning of this quality.
    fn has_quality(&self, raw: i128, quality: Meaning<()>) -> bool {
        self.values.meaning(raw).map(|_| ()) == quality
    }
}

/// Returns the values that a signal may report for a gear, best first: a gearbox may have no park, and a
/// signal only some of the gears.
fn gear_codes(gear: Gear) -> impl Iterator<Item = SignalValue> + Clone {
    let neutral = (gear == Gear::Park).then_some(Gear::Neutral);
    let forward = Gear::all().filter(|gear| gear.direction() == Some(1.0));
    let taken = if gear == Gear::Reverse { 0 } else { usize::MAX };
    let others = neutral.map(GearCode::Engaged).into_iter().chain([GearCode::NotReverse]);
    let others = others.chain(forward.map(GearCode::Engaged)).take(taken);
    std::iter::once(GearCode::Engaged(gear)).chain(others).map(SignalValue::Gear)
}

/// Returns the values that a signal may report for a motion, best first.
fn motions(motion: MotionState) -> impl Iterator<Item = SignalValue> + Clone {
    let is_backward = motion.speed_mps < 0.0 || motion.speed_mps == 0.0 && motion.gear == Gear::Reverse;
    let direction = if is_backward { Motion::Backward } else { Motion::Forward };
    let standstill = (motion.speed_mps == 0.0).then_some(Motion::Standstill);
    standstill.into_iter().chain([direction]).map(SignalValue::Motion)
}

/// A signal that the vehicle sends, with all its contents.
#[derive(Debug, Clone)]
pub(super) struct SignalEncoder {
    pub(super) codec: SignalCodec,
    contents: Vec<SignalContent>,
    /// The quantity that it carries, whose value takes precedence.
    quantity: Option<(MeasuredQuantity, QuantityPart)>,
    /// Raw values with a meaning, and the first few without.
    candidates: Vec<i128>,
}

const SEARCHED: i128 = 256;

impl SignalEncoder {
    pub(super) fn new(codec: SignalCodec) -> Self {
        Self { codec, contents: Vec::new(), quantity: None, candidates: Vec::new() }
    }

    pub(super) fn add(&mut self, content: SignalContent) {
        self.candidates.extend(content.values.entries().iter().map(|(range, _)| range.first));
        self.contents.push(content);
        let (lowest, highest) = self.codec.range();
        self.candidates.retain(|raw| (lowest..=highest).contains(raw));
        let mut searched = lowest..=highest.min(lowest.saturating_add(SEARCHED));
        let undefined = |content: &SignalContent, raw| content.has_quality(raw, Meaning::Undefined);
        let undefined = searched.find(|raw| self.contents.iter().all(|content| undefined(content, *raw)));
        self.candidates.extend(undefined);
    }

    /// Adds a quantity. A signal with several quantities carries the first.
    pub(super) fn measure(&mut self, quantity: &MeasuredQuantity, part: QuantityPart) {
        self.quantity.get_or_insert_with(|| (quantity.clone(), part));
    }

    /// Returns true if it carries a quantity for which `is_wanted` holds.
    pub(super) fn measures_any(&self, is_wanted: fn(Measured) -> bool) -> bool {
        self.quantity.as_ref().is_some_and(|(quantity, _)| is_wanted(quantity.measured))
    }

    /// Returns true if it reports a subject for which `is_wanted` holds.
    pub(super) fn encodes_any(&self, is_wanted: fn(ReportedSubject) -> bool) -> bool {
        self.contents.iter().any(|content| is_wanted(content.subject))
    }

    /// Returns true if it reports the lights and has a raw value of this quality.
    pub(super) fn can_have(&self, quality: Meaning<()>) -> bool {
        let has_value =
            |content: &SignalContent| self.candidates.iter().any(|raw| content.has_quality(*raw, quality));
        self.contents.iter().any(|content| content.subject.has_quality() && has_value(content))
    }

    /// Returns the raw value that reports the state for all contents or, failing that, for the first content
    /// that has one; `None` if no content has one.
    pub(super) fn raw(&self, state: &ReportedState) -> Option<i128> {
        if let Some((quantity, part)) = &self.quantity {
            return Some(quantity.raw(&state.readings, *part));
        }
        let mut candidates = self.candidates.iter().copied();
        let all = candidates.find(|raw| self.contents.iter().all(|content| content.accepts(*raw, state)));
        let one = |content: &SignalContent| {
            self.candidates.iter().copied().find(|raw| content.accepts(*raw, state))
        };
        all.or_else(|| self.contents.iter().find_map(one))
    }
}
