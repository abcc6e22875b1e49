//! What a vehicle profile says: the shape of `config/vehicles/*.toml`.
//!
//! Every key is explained in `config/gateway.toml`. Spans are kept so that a value which cannot
//! be used is refused with its line and column.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::{Unexpected, Visitor};
use toml::Spanned;

use super::command_profile_file::CommandProfileFile;
use super::integrity_file::{ChecksumFile, CounterFile, E2eFile, WindowFile};
use super::v2i_file::V2iFile;
use crate::core::trust::meaning::RawRange;
use crate::core::vehicle_lights::binding::{BothOn, OnFault, TurnWhileHazard};
use crate::core::vehicle_lights::stalk::{OppositePress, RepeatedPress};

/// A whole profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// For people.
    pub name: String,
    /// Buses by name.
    #[serde(default)]
    pub bus: BTreeMap<Spanned<String>, BusFile>,
    /// Timing of bound messages by DBC name.
    #[serde(default)]
    pub message: BTreeMap<Spanned<String>, MessageFile>,
    /// Turn indicators; may be left out beside `v2i`.
    pub turn: Option<Spanned<TurnFile>>,
    /// Hazard lights; may be left out beside `v2i`.
    pub hazard: Option<Spanned<HazardFile>>,
    /// Traffic-light states from the network.
    #[serde(default)]
    pub v2i: Vec<Spanned<V2iFile>>,
    /// Commands to the vehicle.
    pub command: Option<Spanned<CommandProfileFile>>,
}

/// `[bus.<name>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusFile {
    /// Path of the DBC, relative to the profile.
    pub dbc: Spanned<String>,
    /// Further messages that prove the bus alive.
    #[serde(default)]
    pub alive_by: Vec<Spanned<String>>,
    /// Longest silence of a bus that is awake, ms.
    pub alive_timeout_ms: Option<Spanned<u64>>,
    /// Whether the whole bus may fall asleep.
    #[serde(default)]
    pub may_sleep: bool,
}

/// `[message.<NAME>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MessageFile {
    /// The bus, when several have a message of this name.
    pub bus: Option<Spanned<String>>,
    /// How it is sent.
    #[serde(default)]
    pub timing: TimingFile,
    /// Longest believed silence, ms.
    pub timeout_ms: Option<Spanned<u64>>,
    /// The only right length, bytes.
    pub length: Option<Spanned<usize>>,
    /// Its checksum.
    pub checksum: Option<Spanned<ChecksumFile>>,
    /// Its counter.
    pub counter: Option<Spanned<CounterFile>>,
    /// Its E2E protection, instead of the two.
    pub e2e: Option<Spanned<E2eFile>>,
    /// What its latest frames together must show.
    pub window: Option<Spanned<WindowFile>>,
}

/// `timing = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimingFile {
    /// Again and again.
    #[default]
    Cyclic,
    /// On change only.
    Event,
    /// On change, and slowly repeated.
    EventCyclic,
}

/// `[turn]` and `[[turn.source]]`: one enumerated signal, a left and a right one, lamps, a stalk, or,
/// in `[turn]` alone, sources or none fitted.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnFile {
    /// What diagnostics call a source.
    pub name: Option<Spanned<String>>,
    /// Whether a source may stand in for one above it.
    pub fallback: Option<Spanned<bool>>,
    /// What the signals show, unless the state itself.
    pub kind: Option<Spanned<TurnKind>>,
    /// `false`: the vehicle has no indicators.
    pub fitted: Option<Spanned<bool>>,
    /// The enumerated signal.
    pub signal: Option<Spanned<String>>,
    /// Its values for "none on".
    pub off: Option<RawValues>,
    /// Its values for "left on".
    pub left: Option<RawValues>,
    /// Its values for "right on".
    pub right: Option<RawValues>,
    /// Its values for "both on".
    pub both: Option<RawValues>,
    /// Its values for "not available".
    pub not_available: Option<RawValues>,
    /// Its values for "fault".
    pub fault: Option<RawValues>,
    /// Left signal of a pair.
    pub left_signal: Option<Spanned<SwitchFile>>,
    /// Right signal of a pair.
    pub right_signal: Option<Spanned<SwitchFile>>,
    /// What both sides of a pair mean.
    pub both_on: Option<Spanned<BothOnFile>>,
    /// Times of lamps.
    pub lamp: Option<Spanned<LampFile>>,
    /// Values of a stalk in the middle.
    pub idle: Option<RawValues>,
    /// Values of the first detent to the left.
    pub left_half: Option<RawValues>,
    /// Values of the second detent to the left.
    pub left_full: Option<RawValues>,
    /// Values of the first detent to the right.
    pub right_half: Option<RawValues>,
    /// Values of the second detent to the right.
    pub right_full: Option<RawValues>,
    /// Rules and times of a stalk.
    pub stalk: Option<Spanned<StalkFile>>,
    /// Several sources, the most trusted first.
    #[serde(default)]
    pub source: Vec<Spanned<TurnFile>>,
    /// How long sources may contradict each other, ms.
    pub disagreement_ms: Option<Spanned<u64>>,
    /// What is reported while the hazard lights are on.
    pub while_hazard: Option<Spanned<WhileHazardFile>>,
    /// What a reported fault does.
    pub on_fault: Option<Spanned<OnFaultFile>>,
    /// Signals that report a fault.
    #[serde(default)]
    pub fault_signal: Vec<FaultSignalFile>,
}

/// `kind = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TurnKind {
    /// Lamps, which blink.
    Lamp,
    /// A stalk that springs back.
    Stalk,
}

/// `lamp = { … }`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LampFile {
    /// When the message shows the lamps.
    #[serde(default)]
    pub sent: SentFile,
    /// Time from frame to frame, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// By how much more frames may be apart, ms.
    pub jitter_ms: Option<Spanned<u64>>,
    /// Longest time from a change to its frame, ms.
    pub latency_ms: Option<Spanned<u64>>,
    /// How long a side stays on after it was last seen lit, ms.
    pub hold_ms: Option<Spanned<u64>>,
    /// How long both lamps must be lit together to mean hazard, ms.
    pub confirm_ms: Option<Spanned<u64>>,
    /// Longest time a lamp may be lit without a dark frame, ms.
    pub steady_limit_ms: Option<Spanned<u64>>,
    /// A mean flash cycle below this is too fast, ms.
    pub fast_period_ms: Option<Spanned<u64>>,
}

/// `sent = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SentFile {
    /// Again and again.
    #[default]
    Cyclic,
    /// At each change of a lamp.
    OnChange,
}

/// `stalk = { … }`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StalkFile {
    /// Flashes after a tap.
    pub comfort_flashes: Option<Spanned<u8>>,
    /// Blinking after a tap, ms.
    pub comfort_ms: Option<Spanned<u64>>,
    /// What a tap against the side that is on does.
    pub opposite_half: Option<OppositeFile>,
    /// What a full press against the side that is on does.
    pub opposite_full: Option<OppositeFile>,
    /// What a press to the side that is latched does.
    pub repeat: Option<RepeatFile>,
    /// Longest time a full press is believed to last, ms.
    pub max_on_ms: Option<Spanned<u64>>,
    /// Longest time of unknown positions that cannot hide a press, ms.
    pub blind_ms: Option<Spanned<u64>>,
    /// How long the stalk is watched before its state is known, ms.
    pub settle_ms: Option<Spanned<u64>>,
}

/// `opposite_half = …`, `opposite_full = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OppositeFile {
    /// Ends what is on.
    Cancels,
    /// Asks for the other side.
    Switches,
}

impl From<OppositeFile> for OppositePress {
    fn from(file: OppositeFile) -> Self {
        match file {
            OppositeFile::Cancels => Self::Cancels,
            OppositeFile::Switches => Self::Switches,
        }
    }
}

/// `repeat = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RepeatFile {
    /// Ends what is on.
    Cancels,
    /// Changes nothing.
    Keeps,
}

impl From<RepeatFile> for RepeatedPress {
    fn from(file: RepeatFile) -> Self {
        match file {
            RepeatFile::Cancels => Self::Cancels,
            RepeatFile::Keeps => Self::Keeps,
        }
    }
}

/// `[hazard]` and `[[hazard.source]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HazardFile {
    /// What diagnostics call a source.
    pub name: Option<Spanned<String>>,
    /// Whether a source may stand in for one above it.
    pub fallback: Option<Spanned<bool>>,
    /// Where the state comes from.
    pub from: Option<Spanned<HazardFrom>>,
    /// The signal.
    pub signal: Option<Spanned<String>>,
    /// Its values for "on".
    pub on: Option<RawValues>,
    /// Its values for "off".
    pub off: Option<RawValues>,
    /// Its values for "not available".
    pub not_available: Option<RawValues>,
    /// Its values for "fault".
    pub fault: Option<RawValues>,
    /// Values by reason; each means "on".
    pub reasons: Option<Spanned<BTreeMap<String, RawValues>>>,
    /// Longest time of unknown positions of a button that cannot hide a press, ms.
    pub blind_ms: Option<Spanned<u64>>,
    /// How long a button is watched before the state is known, ms.
    pub settle_ms: Option<Spanned<u64>>,
    /// Several sources, the most trusted first.
    #[serde(default)]
    pub source: Vec<Spanned<HazardFile>>,
    /// How long sources may contradict each other, ms.
    pub disagreement_ms: Option<Spanned<u64>>,
    /// What a reported fault does.
    pub on_fault: Option<Spanned<OnFaultFile>>,
    /// Signals that report a fault.
    #[serde(default)]
    pub fault_signal: Vec<FaultSignalFile>,
}

/// `from = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HazardFrom {
    /// A signal of its own.
    Signal,
    /// A signal that says why.
    Reason,
    /// Both turn sides on.
    BothSides,
    /// A button that springs back.
    Button,
    /// No hazard lights.
    NotFitted,
    /// Not visible on the bus.
    Unbound,
}

/// An on/off signal with its values.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwitchFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "on".
    pub on: RawValues,
    /// Values for "off".
    pub off: RawValues,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
    /// Values for "fault".
    pub fault: Option<RawValues>,
}

/// `[[turn.fault_signal]]`, `[[hazard.fault_signal]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultSignalFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "broken".
    pub on: RawValues,
    /// Values for "sound".
    pub off: RawValues,
    /// What is broken, for an operator.
    pub text: String,
}

/// `both_on = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BothOnFile {
    /// Hazard.
    Hazard,
    /// Never sent.
    Undefined,
}

impl From<BothOnFile> for BothOn {
    fn from(file: BothOnFile) -> Self {
        match file {
            BothOnFile::Hazard => Self::Hazard,
            BothOnFile::Undefined => Self::Undefined,
        }
    }
}

/// `while_hazard = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhileHazardFile {
    /// DISABLE.
    Disable,
    /// The turn signal's own state.
    Keep,
}

impl From<WhileHazardFile> for TurnWhileHazard {
    fn from(file: WhileHazardFile) -> Self {
        match file {
            WhileHazardFile::Disable => Self::Disable,
            WhileHazardFile::Keep => Self::Keep,
        }
    }
}

/// `on_fault = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnFaultFile {
    /// Keep publishing.
    #[default]
    Report,
    /// Stop publishing.
    Withhold,
}

impl From<OnFaultFile> for OnFault {
    fn from(file: OnFaultFile) -> Self {
        match file {
            OnFaultFile::Report => Self::Report,
            OnFaultFile::Withhold => Self::Withhold,
        }
    }
}

/// A list of raw values and ranges, e.g. `[0, "4..=7"]`.
pub type RawValues = Spanned<Vec<Spanned<RawValue>>>;

/// One entry of such a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawValue(pub RawRange);

impl<'de> Deserialize<'de> for RawValue {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawValueVisitor)
    }
}

struct RawValueVisitor;

impl Visitor<'_> for RawValueVisitor {
    type Value = RawValue;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a raw value such as 3, or a range such as \"4..=7\"")
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<RawValue, E> {
        Ok(RawValue(RawRange::single(value.into())))
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<RawValue, E> {
        Ok(RawValue(RawRange::single(value.into())))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<RawValue, E> {
        raw_range(text).map(RawValue).ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }
}

/// `"4..=7"`, `"0x96"`, `"-1"`.
fn raw_range(text: &str) -> Option<RawRange> {
    let number = |text: &str| match text.trim().strip_prefix("0x") {
        Some(hex) => i128::from_str_radix(hex, 16).ok(),
        None => text.trim().parse().ok(),
    };
    let (first, last) = match text.split_once("..=") {
        Some((first, last)) => (number(first)?, number(last)?),
        None => (number(text)?, number(text)?),
    };
    (first <= last).then_some(RawRange { first, last })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_numbers_or_ranges() {
        assert_eq!(raw_range("4..=7"), Some(RawRange { first: 4, last: 7 }));
        assert_eq!(raw_range("0x96"), Some(RawRange::single(0x96)));
        assert_eq!(raw_range("-2 ..= -1"), Some(RawRange { first: -2, last: -1 }));
        for wrong in ["", "7..=4", "1..2", "x", "1..=", "0x"] {
            assert_eq!(raw_range(wrong), None, "{wrong}");
        }
    }
}
