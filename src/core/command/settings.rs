//! The settings of the command machine, compiled and checked by `config`.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::allow_list::AllowList;
use super::arbitration::Rules;
use super::control_mode::{ControlMode, Grants};
use super::feedback_monitor::Limits;
use super::message::CommandMessage;
use super::origin::CommandOrigin;
use crate::core::validation::table::{Role, SignalTable};

/// The `[command]` section of the gateway's configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandSettings {
    /// Whose commands are carried out.
    pub source: CommandSource,
    /// Frames are sent, or this is a dry run.
    pub transmit: Transmit,
    /// Where the control mode comes from.
    pub mode_from: ModeFrom,
    /// The longest time without a turn command.
    pub turn_timeout: Duration,
    /// The longest time without a hazard command.
    pub hazard_timeout: Duration,
    /// The requests after a timeout and at the end.
    pub rules: Rules,
    /// The time the vehicle may take to show a request.
    pub limits: Limits,
}

/// Whose commands are carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CommandSource {
    /// Those of Autoware's two command topics.
    #[default]
    Topic,
    /// The turn command of this gateway's own decider; the hazard command of its topic, or on when the
    /// decider commands on.
    Decider,
}

impl From<CommandOrigin> for CommandSource {
    fn from(origin: CommandOrigin) -> Self {
        match origin {
            CommandOrigin::Topic(_) => Self::Topic,
            CommandOrigin::Decider => Self::Decider,
        }
    }
}

/// True if frames are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Transmit {
    /// Dry run: everything is decided and shown, nothing is sent.
    #[default]
    Off,
    /// Frames are sent.
    On,
}

/// Where the control mode comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModeFrom {
    /// `/vehicle/status/control_mode`.
    Topic {
        /// The longest time without a message for which the last mode holds.
        timeout: Duration,
    },
    /// The signal that the profile names.
    Signal,
}

/// The binding of the vehicle profile for commands; empty by default.
#[derive(Debug, Clone, Default)]
pub struct CommandBinding {
    /// The only messages that can be sent.
    pub allowed: AllowList,
    /// These messages, in the order of the profile.
    pub messages: Vec<CommandMessage>,
    /// The messages and signals that are received for commands.
    pub table: SignalTable,
    /// The control mode, where a signal carries it.
    pub control_mode: Option<Role<ControlMode>>,
    /// Signals that show whether the driver has taken over.
    pub driver: Vec<DriverSign>,
}

/// A signal that shows whether the driver has taken over.
#[derive(Debug, Clone)]
pub struct DriverSign {
    /// `true` = the driver has taken over …
    pub role: Role<bool>,
    /// … these functions.
    pub overrides: Grants,
}

impl CommandSettings {
    /// The longest time for which a control mode of the topic holds; `None` if it comes from a signal.
    pub fn mode_timeout(&self) -> Option<Duration> {
        match self.mode_from {
            ModeFrom::Topic { timeout } => Some(timeout),
            ModeFrom::Signal => None,
        }
    }
}

impl CommandBinding {
    /// True if the profile has no command messages.
    pub fn is_empty(&self) -> bool {
        self.messages.is_empty()
    }

    /// True if one signal requests turn indicators and hazard lights.
    pub fn shares_signal(&self) -> bool {
        self.messages.iter().filter_map(|message| message.turn.as_ref()).any(|turn| turn.hazard.is_some())
    }
}
