//! Settings of the command machine, compiled and checked by `config`.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::allow_list::AllowList;
use super::arbitration::ArbitrationRules;
use super::control_mode::Grants;
use super::feedback_monitor::FeedbackLimits;
use super::message::CommandMessage;
use can_signal::validation::table::{Role, SignalTable};

/// The `[command]` section of the gateway's configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandSettings {
    /// Source of the accepted commands.
    pub source: CommandSource,
    /// Sending of frames, or a dry run.
    pub transmit: Transmit,
    /// Source of the control mode.
    pub mode_from: ModeFrom,
    /// Longest time without a turn command before the sender times out.
    pub turn_timeout: Duration,
    /// Longest time without a hazard command before the sender times out.
    pub hazard_timeout: Duration,
    /// Requests after a timeout and at shutdown.
    pub rules: ArbitrationRules,
    /// Time that the vehicle may take to show a request.
    pub limits: FeedbackLimits,
}

/// Source of the commands that are obeyed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CommandSource {
    /// Autoware's two command topics.
    #[default]
    Topic,
    /// The gateway's decider for turn commands. Hazard lights are on when the topic or the decider commands
    /// it.
    Decider,
}

/// Sending of frames to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Transmit {
    /// Dry run: frames are built and shown, but not sent.
    #[default]
    Off,
    /// Frames are sent to the vehicle.
    On,
}

/// Source of the control mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModeFrom {
    /// The topic `/vehicle/status/control_mode` carries it.
    Topic {
        /// Time for which the last mode remains valid without a message.
        timeout: Duration,
    },
    /// The signals of `[control_mode]` in the profile carry it.
    Signal,
}

/// Binding of the vehicle profile for commands; empty by default.
#[derive(Debug, Clone, Default)]
pub struct CommandBinding {
    /// Messages that can be sent.
    pub allowed: AllowList,
    /// Descriptions of the messages in `allowed`, in the order of the profile.
    pub messages: Vec<CommandMessage>,
    /// Messages and signals that are received for commands.
    pub table: SignalTable,
    /// Signals of a driver override.
    pub driver: Vec<DriverSign>,
    /// What a user must know before frames are sent, and consent to by giving the vehicle's name; `None` if
    /// no consent is needed.
    pub needs_consent: Option<String>,
}

/// A signal that reports a driver override.
#[derive(Debug, Clone)]
pub struct DriverSign {
    /// Signal whose value `true` means that the driver has taken over.
    pub role: Role<bool>,
    /// Functions that the driver has then taken over.
    pub overrides: Grants,
}

impl CommandSettings {
    /// Returns the longest time for which a control mode from the topic remains valid; `None` if it comes
    /// from signals.
    pub fn mode_timeout(&self) -> Option<Duration> {
        if let ModeFrom::Topic { timeout } = self.mode_from { Some(timeout) } else { None }
    }
}

impl CommandBinding {
    /// Returns true if the profile has no command messages.
    pub fn is_empty(&self) -> bool {
        self.messages.is_empty()
    }

    /// Returns true if the same signal requests turn indicators and hazard lights.
    pub fn shares_signal(&self) -> bool {
        self.messages.iter().filter_map(|message| message.turn.as_ref()).any(|turn| turn.hazard.is_some())
    }
}
