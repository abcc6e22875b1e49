//! What the gateway's TOML file says of commands: the shape of `[command]` there.

use serde::Deserialize;
use toml::Spanned;

use crate::core::command::arbitration::{AtStop, WhenSilent};
use crate::core::command::settings::{CommandSource, Transmit};

/// `[command]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandFile {
    /// Whose commands are carried out.
    pub source: Option<Spanned<SourceFile>>,
    /// Whether frames are sent.
    #[serde(default)]
    pub tx: TxFile,
    /// Where the control mode comes from.
    pub control_mode: Option<Spanned<ModeFromFile>>,
    /// Longest believed time without a control mode, ms.
    pub control_mode_timeout_ms: Option<Spanned<u64>>,
    /// Longest time without a turn command, ms.
    pub turn_timeout_ms: Option<Spanned<u64>>,
    /// Longest time without a hazard command, ms.
    pub hazard_timeout_ms: Option<Spanned<u64>>,
    /// What to do when the turn command falls silent.
    pub turn_silent: Option<SilentFile>,
    /// What to do when the hazard command falls silent.
    pub hazard_silent: Option<SilentFile>,
    /// What to ask for in the last frames.
    #[serde(default)]
    pub at_stop: AtStopFile,
    /// Until a difference between command and report is a WARN, ms.
    pub warn_after_ms: Option<Spanned<u64>>,
    /// Until it is an ERROR, ms.
    pub error_after_ms: Option<Spanned<u64>>,
    /// Topic names.
    #[serde(default)]
    pub topics: CommandTopicsFile,
}

/// `[command.topics]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandTopicsFile {
    /// `TurnIndicatorsCommand`
    pub turn_indicators_cmd: Option<Spanned<String>>,
    /// `HazardLightsCommand`
    pub hazard_lights_cmd: Option<Spanned<String>>,
    /// `ControlModeReport`
    pub control_mode: Option<Spanned<String>>,
}

/// `source = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceFile {
    /// Autoware's command topics.
    #[default]
    Topic,
    /// This gateway's decider.
    Decider,
}

impl From<SourceFile> for CommandSource {
    fn from(file: SourceFile) -> Self {
        match file {
            SourceFile::Topic => Self::Topic,
            SourceFile::Decider => Self::Decider,
        }
    }
}

/// `tx = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TxFile {
    /// Dry run.
    #[default]
    Off,
    /// Frames are sent.
    On,
}

impl From<TxFile> for Transmit {
    fn from(file: TxFile) -> Self {
        match file {
            TxFile::Off => Self::Off,
            TxFile::On => Self::On,
        }
    }
}

/// `control_mode = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeFromFile {
    /// The topic.
    #[default]
    Topic,
    /// The signal of the vehicle profile.
    Signal,
}

/// `turn_silent = …`, `hazard_silent = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SilentFile {
    /// Its lights off.
    Off,
    /// What was wanted last.
    Hold,
    /// Hazard lights on.
    Hazard,
}

impl From<SilentFile> for WhenSilent {
    fn from(file: SilentFile) -> Self {
        match file {
            SilentFile::Off => Self::Off,
            SilentFile::Hold => Self::Hold,
            SilentFile::Hazard => Self::Hazard,
        }
    }
}

/// `at_stop = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AtStopFile {
    /// Nothing.
    #[default]
    Release,
    /// Lights off.
    Off,
    /// Hazard lights on.
    Hazard,
}

impl From<AtStopFile> for AtStop {
    fn from(file: AtStopFile) -> Self {
        match file {
            AtStopFile::Release => Self::Release,
            AtStopFile::Off => Self::Off,
            AtStopFile::Hazard => Self::Hazard,
        }
    }
}
