//! `[command]`: whose commands are carried out, when, and what happens when they fall silent.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::command::arbitration::{Rules, ShutdownAction, TimeoutAction};
use crate::core::command::feedback_monitor::Limits;
use crate::core::command::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};

keywords!(CommandSource { "topic" => CommandSource::Topic, "decider" => CommandSource::Decider });
keywords!(Transmit { "off" => Transmit::Off, "on" => Transmit::On });
keywords!(TimeoutAction { "off" => TimeoutAction::Off, "hold" => TimeoutAction::Hold, "hazard" => TimeoutAction::Hazard });
keywords!(ShutdownAction { "release" => ShutdownAction::Release, "off" => ShutdownAction::Off, "hazard" => ShutdownAction::Hazard });

/// `[command]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandFile {
    /// Whose commands are carried out.
    pub source: Option<Spanned<Keyword<CommandSource>>>,
    /// Whether frames are sent.
    #[serde(default)]
    pub tx: Keyword<Transmit>,
    /// Where the control mode comes from.
    pub control_mode: Option<Spanned<ModeFromFile>>,
    /// Longest believed time without a control mode, ms.
    pub control_mode_timeout_ms: Option<Spanned<u64>>,
    /// Longest time without a turn command, ms.
    pub turn_timeout_ms: Option<Spanned<u64>>,
    /// Longest time without a hazard command, ms.
    pub hazard_timeout_ms: Option<Spanned<u64>>,
    /// What to do when the turn command falls silent.
    pub on_turn_timeout: Option<Keyword<TimeoutAction>>,
    /// What to do when the hazard command falls silent.
    pub on_hazard_timeout: Option<Keyword<TimeoutAction>>,
    /// What to ask for in the last frames.
    #[serde(default)]
    pub on_shutdown: Keyword<ShutdownAction>,
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

/// Everything for commands to the vehicle.
#[derive(Debug, Clone)]
pub struct CommandConfig {
    /// What the flow runs on.
    pub settings: CommandSettings,
    /// What the vehicle profile binds; never empty.
    pub binding: CommandBinding,
    /// Where commands and control mode come from.
    pub topics: CommandTopics,
}

/// Topics that are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandTopics {
    /// `TurnIndicatorsCommand`; not read when the decider is the source.
    pub turn_indicators_cmd: String,
    /// `HazardLightsCommand`
    pub hazard_lights_cmd: String,
    /// `ControlModeReport`; not read when the mode comes from a signal.
    pub control_mode: String,
}

const TIMEOUT: Duration = Duration::from_secs(1);
/// Longer than the report of a lamp that blinks takes.
const WARN_AFTER: Duration = Duration::from_millis(1500);
const ERROR_AFTER: Duration = Duration::from_secs(3);

/// Checks the section; every problem found is noted. `binding` = that of the vehicle profile, unless it
/// was refused.
pub(super) fn command(
    checker: &mut Checker<'_>,
    file: &Spanned<CommandFile>,
    binding: Option<&CommandBinding>,
) -> Option<CommandConfig> {
    let (span, file) = (file.span(), file.get_ref());
    let before = checker.problems.len();
    if binding.is_some_and(CommandBinding::is_empty) {
        let reason = "the vehicle profile has no [command]: nothing says how to ask the vehicle";
        checker.refuse_at(span, reason, "describe its command messages there");
    }
    let mut time = |given: &Option<_>, default| checker.limit(given.as_ref()).unwrap_or(default);
    let turn_timeout = time(&file.turn_timeout_ms, TIMEOUT);
    let hazard_timeout = time(&file.hazard_timeout_ms, TIMEOUT);
    let mode_timeout = time(&file.control_mode_timeout_ms, TIMEOUT);
    let warn = time(&file.warn_after_ms, WARN_AFTER);
    let error = time(&file.error_after_ms, ERROR_AFTER.max(warn));
    if let Some(given) = file.error_after_ms.as_ref().filter(|_| error < warn) {
        let reason = format!("an error after {} ms comes before its warning", given.get_ref());
        checker.refuse(given, reason, &format!("give at least {} ms", warn.as_millis()));
    }
    let mode_from = mode_from(checker, file, mode_timeout, binding);
    let mut topic = |given: &Option<_>, default| checker.topic(given.as_ref(), default);
    let topics = CommandTopics {
        turn_indicators_cmd: topic(&file.topics.turn_indicators_cmd, "/control/command/turn_indicators_cmd"),
        hazard_lights_cmd: topic(&file.topics.hazard_lights_cmd, "/control/command/hazard_lights_cmd"),
        control_mode: topic(&file.topics.control_mode, "/vehicle/status/control_mode"),
    };
    let settings = CommandSettings {
        source: file.source.as_ref().map(|source| source.get_ref().0).unwrap_or_default(),
        transmit: file.tx.0,
        mode_from,
        turn_timeout,
        hazard_timeout,
        rules: Rules {
            on_turn_timeout: file.on_turn_timeout.map_or(TimeoutAction::Off, |given| given.0),
            // What was on in an emergency stays on.
            on_hazard_timeout: file.on_hazard_timeout.map_or(TimeoutAction::Hold, |given| given.0),
            on_shutdown: file.on_shutdown.0,
        },
        limits: Limits { warn, error },
    };
    let binding = binding.filter(|_| checker.problems.len() == before)?.clone();
    Some(CommandConfig { settings, binding, topics })
}

/// Where the control mode comes from.
fn mode_from(
    checker: &mut Checker<'_>,
    file: &CommandFile,
    timeout: Duration,
    binding: Option<&CommandBinding>,
) -> ModeFrom {
    let given = file.control_mode.as_ref();
    let Some(given) = given.filter(|given| *given.get_ref() == ModeFromFile::Signal) else {
        return ModeFrom::Topic { timeout };
    };
    if let Some(timeout) = &file.control_mode_timeout_ms {
        let reason = "a signal has the timeout of its message";
        checker.refuse(timeout, reason, "remove it, or use control_mode = \"topic\"");
    }
    if binding.is_some_and(|binding| binding.control_mode.is_none()) {
        let reason = "the vehicle profile binds no signal for the control mode";
        checker.refuse(given, reason, "add [command.control_mode] there, or use \"topic\"");
    }
    ModeFrom::Signal
}
