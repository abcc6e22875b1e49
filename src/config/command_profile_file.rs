//! What a vehicle profile says of command messages: the shape of `[command]` there.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::integrity_file::{ChecksumFile, CounterFile, E2eFile};
use super::vehicle_file::RawValues;

/// `[command]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandProfileFile {
    /// The messages the gateway sends.
    #[serde(default)]
    pub message: Vec<Spanned<CommandMessageFile>>,
    /// The signal that tells the control mode.
    pub control_mode: Option<Spanned<ControlModeFile>>,
    /// Signals that tell that the driver has taken over.
    #[serde(default)]
    pub driver: Vec<DriverFile>,
}

/// `[[command.message]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandMessageFile {
    /// `MESSAGE` or `BUS:MESSAGE`
    pub name: Spanned<String>,
    /// From frame to frame, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// Frames in quick succession after a change.
    pub burst: Option<Spanned<u8>>,
    /// From frame to frame of them, ms.
    pub burst_gap_ms: Option<Spanned<u64>>,
    /// Least time between two frames, ms.
    pub least_gap_ms: Option<Spanned<u64>>,
    /// What goes out without authority.
    pub idle: Option<Spanned<IdleFile>>,
    /// What bits hold that no signal has, 0 or 1.
    pub unused_bits: Option<Spanned<u8>>,
    /// Signals that never change.
    pub constants: Option<StateFile>,
    /// The bits that give authority.
    pub enable: Option<Spanned<EnableFile>>,
    /// Turn-indicator part.
    pub turn: Option<Spanned<TurnPartFile>>,
    /// Hazard part.
    pub hazard: Option<Spanned<HazardPartFile>>,
    /// Its counter.
    pub counter: Option<Spanned<CounterFile>>,
    /// Its checksum.
    pub checksum: Option<Spanned<ChecksumFile>>,
    /// Its E2E protection, instead of the two.
    pub e2e: Option<Spanned<E2eFile>>,
}

/// Raw values by signal: `{ TURN = 1 }`.
pub type StateFile = Spanned<BTreeMap<Spanned<String>, Spanned<i64>>>;

/// `idle = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IdleFile {
    /// Frames that ask for nothing.
    Neutral,
    /// No frames.
    Silent,
}

/// `enable = { on = { … }, off = { … } }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnableFile {
    /// The message counts.
    pub on: StateFile,
    /// It does not.
    pub off: StateFile,
}

/// `[command.message.turn]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnPartFile {
    /// Neither side.
    pub off: StateFile,
    /// Left.
    pub left: StateFile,
    /// Right.
    pub right: StateFile,
    /// Both sides.
    pub hazard: Option<StateFile>,
    /// Nothing is asked for.
    pub none: Option<StateFile>,
}

/// `[command.message.hazard]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HazardPartFile {
    /// Off, or not pressed.
    pub off: StateFile,
    /// On, or pressed.
    pub on: StateFile,
    /// Nothing is asked for.
    pub none: Option<StateFile>,
    /// How to press a button that springs back.
    pub button: Option<Spanned<ButtonFile>>,
}

/// `button = { … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ButtonFile {
    /// How long it is held down, ms.
    pub press_ms: Option<Spanned<u64>>,
    /// How long to wait for the report afterwards, ms.
    pub wait_ms: Option<Spanned<u64>>,
    /// Presses for one wish.
    pub attempts: Option<Spanned<u8>>,
}

/// `[command.control_mode]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlModeFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for AUTONOMOUS.
    pub autonomous: RawValues,
    /// Values for `AUTONOMOUS_STEER_ONLY`.
    pub steer_only: Option<RawValues>,
    /// Values for `AUTONOMOUS_VELOCITY_ONLY`.
    pub velocity_only: Option<RawValues>,
    /// Values for MANUAL.
    pub manual: RawValues,
    /// Values for DISENGAGED.
    pub disengaged: Option<RawValues>,
    /// Values for `NOT_READY`.
    pub not_ready: Option<RawValues>,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
}

/// `[[command.driver]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriverFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "the driver has taken over".
    pub on: RawValues,
    /// Values for "he has not".
    pub off: RawValues,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
    /// What he has taken; both when not given.
    #[serde(default)]
    pub takes: TakesFile,
}

/// `takes = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TakesFile {
    /// Turn indicators and hazard lights.
    #[default]
    Both,
    /// Turn indicators.
    Turn,
    /// Hazard lights.
    Hazard,
}
