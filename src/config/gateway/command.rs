//! `[command]`: whose commands are carried out, when, and the reaction when they stop.

use std::time::Duration;

use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::core::command::arbitration::{Rules, ShutdownAction, TimeoutAction};
use crate::core::command::feedback_monitor::Limits;
use crate::core::command::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};

const SOURCES: Keywords<CommandSource> =
    &[("topic", CommandSource::Topic), ("decider", CommandSource::Decider)];
const TRANSMIT: Keywords<Transmit> = &[("off", Transmit::Off), ("on", Transmit::On)];
const ON_TIMEOUT: Keywords<TimeoutAction> =
    &[("off", TimeoutAction::Off), ("hold", TimeoutAction::Hold), ("hazard", TimeoutAction::Hazard)];
const ON_SHUTDOWN: Keywords<ShutdownAction> =
    &[("release", ShutdownAction::Release), ("off", ShutdownAction::Off), ("hazard", ShutdownAction::Hazard)];
/// Origins of the control mode; true for a signal.
const MODE_FROM_SIGNAL: Keywords<bool> = &[("topic", false), ("signal", true)];

/// The settings of commands to the vehicle.
#[derive(Debug, Clone)]
pub struct CommandConfig {
    /// Settings of the command machine.
    pub settings: CommandSettings,
    /// The binding of the vehicle profile; never empty.
    pub binding: CommandBinding,
    /// Topics of commands and control mode.
    pub topics: CommandTopics,
}

/// Topics that commands and the control mode are read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandTopics {
    /// `TurnIndicatorsCommand`; not read when the decider is the source.
    pub turn_indicators_cmd: String,
    /// `HazardLightsCommand`; always read.
    pub hazard_lights_cmd: String,
    /// `ControlModeReport`; not read when the mode comes from a signal.
    pub control_mode: String,
}

const TIMEOUT: Duration = Duration::from_secs(1);
/// Longer than the report of a flashing lamp takes.
const WARN_AFTER: Duration = Duration::from_millis(1500);
const ERROR_AFTER: Duration = Duration::from_secs(3);

/// Reads the section. `binding` is that of the vehicle profile, unless the profile was refused; `decides` is
/// true if the decider publishes commands.
pub(super) fn command(
    fields: Fields<'_>,
    binding: Option<&CommandBinding>,
    decides: bool,
) -> Option<CommandConfig> {
    let checker = fields.checker;
    if binding.is_some_and(CommandBinding::is_empty) {
        let reason = "the vehicle profile has no [command], so no message can be sent";
        checker.refuse(fields.location(), reason, "describe its command messages there");
    }
    let source = fields.keyword("source", SOURCES).unwrap_or_default();
    if source == CommandSource::Decider && !decides {
        let remedy = "add [turn_signal] enabled = true, or use \"topic\"";
        fields.refuse("source", "the decider does not publish commands", remedy);
    }
    let time = |key, default| fields.limit(key).unwrap_or(default);
    let warn = time("warn_after_ms", WARN_AFTER);
    let error = time("error_after_ms", ERROR_AFTER.max(warn));
    if error < warn {
        let reason = format!("{} ms is less than warn_after_ms", error.as_millis());
        fields.refuse("error_after_ms", reason, &format!("give at least {} ms", warn.as_millis()));
    }
    let settings = CommandSettings {
        source,
        transmit: fields.keyword("tx", TRANSMIT).unwrap_or_default(),
        mode_from: mode_from(&fields, binding),
        turn_timeout: time("turn_timeout_ms", TIMEOUT),
        hazard_timeout: time("hazard_timeout_ms", TIMEOUT),
        rules: Rules {
            on_turn_timeout: fields.keyword("on_turn_timeout", ON_TIMEOUT).unwrap_or(TimeoutAction::Off),
            // Lights that are on in an emergency stay on.
            on_hazard_timeout: fields.keyword("on_hazard_timeout", ON_TIMEOUT).unwrap_or(TimeoutAction::Hold),
            on_shutdown: fields.keyword("on_shutdown", ON_SHUTDOWN).unwrap_or_default(),
        },
        limits: Limits { warn, error },
    };
    let names = fields.section("topics");
    let topics = CommandTopics {
        turn_indicators_cmd: names.topic("turn_indicators_cmd", "/control/command/turn_indicators_cmd"),
        hazard_lights_cmd: names.topic("hazard_lights_cmd", "/control/command/hazard_lights_cmd"),
        control_mode: names.topic("control_mode", "/vehicle/status/control_mode"),
    };
    names.done();
    fields.done();
    Some(CommandConfig { settings, binding: binding?.clone(), topics })
}

/// Reads the origin of the control mode.
fn mode_from(fields: &Fields<'_>, binding: Option<&CommandBinding>) -> ModeFrom {
    let timeout = fields.limit("control_mode_timeout_ms").unwrap_or(TIMEOUT);
    if fields.keyword("control_mode", MODE_FROM_SIGNAL) != Some(true) {
        return ModeFrom::Topic { timeout };
    }
    if fields.has("control_mode_timeout_ms") {
        let remedy = "remove it, or use control_mode = \"topic\"";
        fields.refuse(
            "control_mode_timeout_ms",
            "a control mode from a signal has the timeout of its message",
            remedy,
        );
    }
    if binding.is_some_and(|binding| binding.control_mode.is_none()) {
        let reason = "the vehicle profile binds no signal for the control mode";
        fields.refuse("control_mode", reason, "add [command.control_mode] there, or use \"topic\"");
    }
    ModeFrom::Signal
}
