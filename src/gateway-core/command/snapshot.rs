//! Current state of commands to the vehicle, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::arbitration::DecisionReason;
use super::control_mode::ModeState;
use super::feedback_monitor::{Compliance, Lights};
use super::flow::CommandFlow;
use super::intake::LatestCommand;
use super::sender::SendCounts;
use super::settings::CommandSource;
use super::status::FunctionView;
use crate::control_mode::ControlMode;
use can_signal::can::Bus;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use gateway_base::diagnostics::{Level, MessagePart};
use gateway_base::names::{display_by_name, variant};
use gateway_base::time::{MonoTime, millis};

/// Commands to the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct CommandSnapshot {
    /// True if frames are sent; false in a dry run.
    pub is_transmitting: bool,
    /// Origin of the turn command.
    pub source: CommandSource,
    /// Control mode; `None` while it is unknown or undefined.
    pub control_mode: Option<ControlMode>,
    /// Number that stands for no control mode; `None` for a defined or unknown one.
    pub undefined_control_mode: Option<i128>,
    /// Turn indicators; the values are `off`, `left` and `right`.
    pub turn_indicators: FunctionSnapshot,
    /// Hazard lights; the values are `off` and `on`.
    pub hazard_lights: FunctionSnapshot,
    /// The messages that are sent, in the order of the profile.
    pub messages: Vec<SentMessageSnapshot>,
}

/// One function that can be commanded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FunctionSnapshot {
    /// The command received.
    pub command: LatestCommand,
    /// Time since the last command that was used, ms; `None` before the first.
    pub command_age_ms: Option<u64>,
    /// Value to be requested, were there no driver; `None` where the vehicle is left alone.
    pub commanded: Option<LightsValue>,
    /// Value that is requested of the vehicle; `None` where it is left alone.
    pub requested: Option<LightsValue>,
    /// Why this is requested.
    pub reason: DecisionReason,
    /// Value that the vehicle reports; `None` while it is unknown.
    pub reported: Option<LightsValue>,
    /// Result of comparing the report with the command.
    pub compliance: Compliance,
    /// Level of its diagnostic status.
    pub level: Level,
    /// Message of its diagnostic status.
    pub message: String,
    /// Commands received since start.
    pub commands: u64,
    /// Times since start that the driver did something else.
    pub driver_overrides: u64,
    /// Times since start that the report differed for too long.
    pub feedback_mismatches: u64,
}

/// A value of the turn indicators or of the hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum LightsValue {
    Off,
    Left,
    Right,
    On,
}

display_by_name!(LightsValue);

/// Frames of one message to the vehicle, since start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SentMessageSnapshot {
    /// Name in the DBC.
    pub name: String,
    /// Bus that carries it, by its name in the vehicle profile.
    pub bus: String,
    /// Number of its frames, by outcome.
    #[serde(flatten)]
    pub counts: SendCounts,
}

impl CommandFlow {
    /// Returns the signals and messages received for commands.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let (table, observations) = (&self.binding.table, &self.observations);
        let received = Received { used_by: UsedBy::Command, table, observations, buses };
        received.snapshot(now, |_, _| Vec::new())
    }

    /// Returns the current state.
    pub fn snapshot(&self, buses: &[Bus], now: MonoTime) -> CommandSnapshot {
        let (turn, hazard) = self.views();
        let messages = self.send_counts().zip(&self.binding.messages).map(|((name, counts), message)| {
            let bus = buses.get(usize::from(message.permission.bus().0));
            SentMessageSnapshot {
                name: name.to_owned(),
                bus: bus.map_or_else(String::new, |bus| bus.settings().name.clone()),
                counts,
            }
        });
        let mode = self.finding.mode;
        let control_mode = if let ModeState::Known(mode) = mode { Some(mode) } else { None };
        CommandSnapshot {
            is_transmitting: self.is_live(),
            source: self.settings.source,
            control_mode,
            undefined_control_mode: mode.undefined(),
            turn_indicators: function_snapshot(&turn, turn.message(), now),
            hazard_lights: function_snapshot(&hazard, self.hazard_message(&hazard), now),
            messages: messages.collect(),
        }
    }
}

fn function_snapshot<T: Lights>(
    view: &FunctionView<'_, T>,
    message: MessagePart,
    now: MonoTime,
) -> FunctionSnapshot {
    let value = |value: Option<T>| variant(value?.name());
    FunctionSnapshot {
        command: view.latest_command(),
        command_age_ms: view.intake.age(now).map(millis),
        commanded: value(view.commanded),
        requested: value(view.request),
        reason: view.reason,
        reported: value(view.finding.reported),
        compliance: view.finding.compliance,
        level: message.level(),
        message: message.text,
        commands: view.intake.counts.received,
        driver_overrides: view.feedback.driver_overrides,
        feedback_mismatches: view.feedback.mismatches,
    }
}
