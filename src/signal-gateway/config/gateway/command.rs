//! `[command]`: the source of the commands, the conditions for carrying them out, and the reaction when they
//! stop.

use std::time::Duration;

use super::topic_names::TopicNames;
use crate::config::reading::{ConfigKey, Fields, Keywords, key_rows, keyword, limit, text, topic};
use crate::config::vehicle::Vehicle;
use gateway_core::command::arbitration::{ArbitrationRules, ShutdownAction, TimeoutAction};
use gateway_core::command::feedback_monitor::FeedbackLimits;
use gateway_core::command::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};

const SOURCES: Keywords<CommandSource> =
    &[("topic", CommandSource::Topic), ("decider", CommandSource::Decider)];
const TRANSMIT: Keywords<Transmit> = &[("off", Transmit::Off), ("on", Transmit::On)];
const ON_TIMEOUT: Keywords<TimeoutAction> =
    &[("off", TimeoutAction::Off), ("hold", TimeoutAction::Hold), ("hazard", TimeoutAction::Hazard)];
const SHUTDOWN_ACTIONS: Keywords<ShutdownAction> =
    &[("release", ShutdownAction::Release), ("off", ShutdownAction::Off), ("hazard", ShutdownAction::Hazard)];
/// Origins of the control mode; true for signals.
const MODE_FROM_SIGNAL: Keywords<bool> = &[("topic", false), ("signal", true)];

/// The settings of commands to the vehicle.
#[derive(Debug, Clone)]
pub struct CommandConfig {
    /// Settings of the command machine.
    pub settings: CommandSettings,
    /// The binding of the vehicle profile; never empty.
    pub binding: CommandBinding,
    /// Topics of commands and control mode.
    pub topics: TopicNames,
}

const ERROR_AFTER: Duration = Duration::from_secs(3);

key_rows! {
    SOURCE: CommandSource = keyword("source", SOURCES).or_text("topic").restart()
        .doc("turn command: \"topic\", or \"decider\": this gateway's own; its request for hazard lights is added");
    TX: Transmit = keyword("tx", TRANSMIT).or_text("off").restart()
        .doc("\"off\": dry run, nothing is sent and everything is reported; \"on\": frames are sent");
    CONSENT: String = text("consent").or_text("").restart()
        .doc("`name` of the vehicle profile, where its [command] has needs_consent: tx = \"on\" is refused without it");
    CONTROL_MODE: bool = keyword("control_mode", MODE_FROM_SIGNAL).or_text("topic").restart()
        .doc("\"topic\", or \"signal\": [control_mode] of the vehicle profile");
    CONTROL_MODE_TIMEOUT_MS: Duration = limit("control_mode_timeout_ms").or(1000).restart()
        .doc("topic: longest valid time without a message");
    TURN_TIMEOUT_MS: Duration = limit("turn_timeout_ms").or(1000).restart()
        .doc("longest time without a turn command, {range}; then on_turn_timeout");
    ON_TURN_TIMEOUT: TimeoutAction = keyword("on_turn_timeout", ON_TIMEOUT).or_text("off").restart()
        .doc("\"off\", \"hold\": the last request, or \"hazard\": hazard lights on");
    HAZARD_TIMEOUT_MS: Duration = limit("hazard_timeout_ms").or(1000).restart()
        .doc("longest time without a hazard command, {range}; then on_hazard_timeout");
    // Lights that are on in an emergency stay on.
    ON_HAZARD_TIMEOUT: TimeoutAction = keyword("on_hazard_timeout", ON_TIMEOUT).or_text("hold").restart()
        .doc("\"off\", \"hold\" or \"hazard\"");
    ON_SHUTDOWN: ShutdownAction = keyword("on_shutdown", SHUTDOWN_ACTIONS).or_text("release").restart()
        .doc("last frames: \"release\": request nothing, \"off\": lights off, \"hazard\": hazard lights on");
    // The default is longer than the report of a flashing lamp takes.
    WARN_AFTER_MS: Duration = limit("warn_after_ms").or(1500).restart()
        .doc("the report differs from the command for longer: WARN");
    ERROR_AFTER_MS: Duration = limit("error_after_ms").or_time(ERROR_AFTER).restart().doc("the report differs for longer: ERROR; {range}, not less than warn_after_ms");
}

pub(super) static TOPICS: [ConfigKey<String>; 3] = [
    topic("turn_indicators_cmd", "/control/command/turn_indicators_cmd")
        .doc("TurnIndicatorsCommand; not read when the decider is the source"),
    topic("hazard_lights_cmd", "/control/command/hazard_lights_cmd").doc("HazardLightsCommand"),
    topic("control_mode", "/vehicle/status/control_mode")
        .doc("ControlModeReport; not read when the mode comes from signals"),
];

/// Reads the section. `vehicle` is `None` if its profile was refused; `decides` is true if the decider
/// publishes commands; `written_mode` is the topic on which the gateway itself would report the control mode.
pub(super) fn command(
    fields: &Fields<'_>,
    vehicle: Option<&Vehicle>,
    decides: bool,
    written_mode: &str,
) -> Option<CommandConfig> {
    let checker = fields.checker;
    let binding = vehicle.map(|vehicle| &vehicle.command);
    if let Some(vehicle) = vehicle.filter(|vehicle| vehicle.command.is_empty()) {
        let reason = "the vehicle profile has no [command], so no message can be sent";
        let place = vehicle.place_of("[command]");
        let remedy = format!("describe the command messages in {place}, or remove this section");
        checker.refuse(fields.location(), reason, &remedy);
    }
    let source = fields.read(&SOURCE);
    if source == CommandSource::Decider && !decides {
        let remedy = "add [turn_signal] enabled = true, or use \"topic\"";
        fields.refuse("source", "the decider does not publish commands", remedy);
    }
    let warn = fields.read(&WARN_AFTER_MS);
    let error = fields.given(&ERROR_AFTER_MS).unwrap_or(ERROR_AFTER.max(warn));
    fields.record(&ERROR_AFTER_MS, error.as_millis().to_string());
    if error < warn {
        let reason = format!("{} ms is less than warn_after_ms", error.as_millis());
        fields.refuse("error_after_ms", reason, &format!("give at least {} ms", warn.as_millis()));
    }
    let transmit = fields.read(&TX);
    let consent = fields.read(&CONSENT);
    if let Some(vehicle) = vehicle {
        check_consent(fields, vehicle, transmit, &consent);
    }
    let reports_mode = vehicle.map(|vehicle| vehicle.status.control_mode.is_some());
    let settings = CommandSettings {
        source,
        transmit,
        mode_from: mode_from(fields, vehicle),
        turn_timeout: fields.read(&TURN_TIMEOUT_MS),
        hazard_timeout: fields.read(&HAZARD_TIMEOUT_MS),
        rules: ArbitrationRules {
            on_turn_timeout: fields.read(&ON_TURN_TIMEOUT),
            on_hazard_timeout: fields.read(&ON_HAZARD_TIMEOUT),
            on_shutdown: fields.read(&ON_SHUTDOWN),
        },
        limits: FeedbackLimits { warn, error },
    };
    let topics = fields.section("topics").read_all(|section| TopicNames::read(section, &TOPICS));
    let reads_mode = matches!(settings.mode_from, ModeFrom::Topic { .. });
    if reports_mode == Some(true) && reads_mode && topics.name("control_mode") == written_mode {
        let reason = format!(
            "the control mode would be read from {written_mode}, on which [control_mode] of the vehicle profile is published"
        );
        let remedy = "use \"signal\", or [ros.topics] control_mode_status = \"\" if another node publishes the control mode";
        fields.refuse("control_mode", reason, remedy);
    }
    Some(CommandConfig { settings, binding: binding?.clone(), topics })
}

/// Refuses a consent for another vehicle, and sending without a consent that the profile requires. An empty
/// text is not a consent.
fn check_consent(fields: &Fields<'_>, vehicle: &Vehicle, transmit: Transmit, consent: &str) {
    if !consent.is_empty() && consent != vehicle.name {
        let reason = format!("this is the consent for {consent:?}, but the vehicle is {:?}", vehicle.name);
        let remedy = "remove it, or read what the profile of this vehicle says and give its name";
        fields.refuse("consent", reason, remedy);
    }
    let needed = vehicle.command.needs_consent.as_ref();
    if let Some(needed) = needed.filter(|_| transmit == Transmit::On && consent.is_empty()) {
        let reason = format!("the vehicle profile asks for your consent before anything is sent: {needed}");
        let remedy =
            format!("add consent = {:?} if you accept this, or use \"off\", a dry run", vehicle.name);
        fields.refuse("tx", reason, &remedy);
    }
}

/// Reads the origin of the control mode. `vehicle` is `None` if the profile was refused.
fn mode_from(fields: &Fields<'_>, vehicle: Option<&Vehicle>) -> ModeFrom {
    let timeout = fields.read(&CONTROL_MODE_TIMEOUT_MS);
    if !fields.read(&CONTROL_MODE) {
        return ModeFrom::Topic { timeout };
    }
    if fields.has("control_mode_timeout_ms") {
        let reason = "a control mode from signals has the timeouts of their messages";
        let remedy = "remove it, or use control_mode = \"topic\"";
        fields.refuse("control_mode_timeout_ms", reason, remedy);
    }
    if let Some(vehicle) = vehicle.filter(|vehicle| vehicle.status.control_mode.is_none()) {
        let reason = "the vehicle profile binds no signal for the control mode";
        let remedy = format!("add {}, or use \"topic\"", vehicle.place_of("[control_mode]"));
        fields.refuse("control_mode", reason, &remedy);
    }
    ModeFrom::Signal
}
