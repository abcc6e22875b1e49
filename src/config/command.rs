//! From `[command]` of the gateway's file to what the command flow runs on.

use std::time::Duration;

use toml::Spanned;

use super::command_file::{CommandFile, ModeFromFile};
use super::problem::{Document, Problem};
use super::sections::is_topic;
use super::vehicle::{LONGEST_TIMEOUT_MS, is_timeout};
use crate::core::command::accord::Limits;
use crate::core::command::arbitration::{Rules, WhenSilent};
use crate::core::command::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom};

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

const TIMEOUT_MS: u64 = 1000;
/// Longer than the report of a lamp that blinks takes.
const WARN_AFTER_MS: u64 = 1500;
const ERROR_AFTER_MS: u64 = 3000;

/// Checks the section; every problem found is added. `binding` = that of the vehicle profile, unless it
/// was refused.
pub(super) fn command(
    document: &Document,
    file: &Spanned<CommandFile>,
    binding: Option<&CommandBinding>,
    problems: &mut Vec<Problem>,
) -> Option<CommandConfig> {
    let (span, file) = (file.span(), file.get_ref());
    let before = problems.len();
    if binding.is_some_and(CommandBinding::is_empty) {
        let reason = "the vehicle profile has no [command]: nothing says how to ask the vehicle";
        problems.push(document.problem(span, reason, "describe its command messages there"));
    }
    let mut time = |given: &Option<Spanned<u64>>, default: u64| {
        if let Some(limit) = given.as_ref().filter(|limit| !is_timeout(*limit.get_ref())) {
            let reason = format!("{} ms is no usable limit", limit.get_ref());
            let remedy = format!("give 1 to {LONGEST_TIMEOUT_MS} ms");
            problems.push(document.problem(limit.span(), reason, remedy));
        }
        Duration::from_millis(given.as_ref().map_or(default, |limit| *limit.get_ref()))
    };
    let turn_timeout = time(&file.turn_timeout_ms, TIMEOUT_MS);
    let hazard_timeout = time(&file.hazard_timeout_ms, TIMEOUT_MS);
    let mode_timeout = time(&file.control_mode_timeout_ms, TIMEOUT_MS);
    let warn = time(&file.warn_after_ms, WARN_AFTER_MS);
    let error = time(&file.error_after_ms, ERROR_AFTER_MS.max(millis(warn)));
    if let Some(given) = file.error_after_ms.as_ref().filter(|_| error < warn) {
        let reason = format!("an error after {} ms comes before its warning", given.get_ref());
        let remedy = format!("give at least {} ms", millis(warn));
        problems.push(document.problem(given.span(), reason, remedy));
    }
    let from = file.control_mode.as_ref().map_or(ModeFromFile::Topic, |from| *from.get_ref());
    let mode_from = match from {
        ModeFromFile::Topic => ModeFrom::Topic { timeout: mode_timeout },
        ModeFromFile::Signal => ModeFrom::Signal,
    };
    if let Some(given) = &file.control_mode_timeout_ms
        && from == ModeFromFile::Signal
    {
        let reason = "a signal has the timeout of its message";
        problems.push(document.problem(given.span(), reason, "remove it, or use control_mode = \"topic\""));
    }
    if let Some(given) = file.control_mode.as_ref().filter(|_| from == ModeFromFile::Signal)
        && binding.is_some_and(|binding| binding.control_mode.is_none())
    {
        let reason = "the vehicle profile binds no signal for the control mode";
        let remedy = "add [command.control_mode] there, or use \"topic\"";
        problems.push(document.problem(given.span(), reason, remedy));
    }
    let mut topic = |given: &Option<Spanned<String>>, default: &str| {
        if let Some(topic) = given.as_ref().filter(|topic| !is_topic(topic.get_ref())) {
            let reason = format!("{:?} is no absolute topic", topic.get_ref());
            problems.push(document.problem(topic.span(), reason, "write it as /a/b"));
        }
        given.as_ref().map_or(default.to_owned(), |topic| topic.get_ref().clone())
    };
    let topics = CommandTopics {
        turn_indicators_cmd: topic(&file.topics.turn_indicators_cmd, "/control/command/turn_indicators_cmd"),
        hazard_lights_cmd: topic(&file.topics.hazard_lights_cmd, "/control/command/hazard_lights_cmd"),
        control_mode: topic(&file.topics.control_mode, "/vehicle/status/control_mode"),
    };
    let settings = CommandSettings {
        source: file.source.as_ref().map_or_else(CommandSource::default, |source| (*source.get_ref()).into()),
        transmit: file.tx.into(),
        mode_from,
        turn_timeout,
        hazard_timeout,
        rules: Rules {
            turn_silent: file.turn_silent.map_or(WhenSilent::Off, Into::into),
            // What was on in an emergency stays on.
            hazard_silent: file.hazard_silent.map_or(WhenSilent::Hold, Into::into),
            at_stop: file.at_stop.into(),
        },
        limits: Limits { warn, error },
    };
    let binding = binding.filter(|_| problems.len() == before)?.clone();
    Some(CommandConfig { settings, binding, topics })
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}
