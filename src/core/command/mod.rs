//! Commands to the vehicle: from Autoware or the decider, through arbitration into frames, and compared with
//! the vehicle's report (docs/spec/vehicle-interface.md, "Arbitration of commands").
//!
//! Vocabulary: a *command* is one message of a sender; its *command state* combines all its messages; a
//! *grant* is what the control mode allows; a *request* goes to the vehicle with authority; *compliance* is
//! the result of comparing the vehicle's report with the request.
//!
//! Without a control mode no command is granted:
//!
//! ```
//! use std::time::Duration;
//!
//! use signal_gateway::core::command::arbitration::{ArbitrationRules, DecisionReason};
//! use signal_gateway::core::command::feedback_monitor::FeedbackLimits;
//! use signal_gateway::core::command::flow::CommandFlow;
//! use signal_gateway::core::command::input::CommandInput;
//! use signal_gateway::core::command::origin::{CommandOrigin, SampleId};
//! use signal_gateway::core::command::settings::{
//!     CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit,
//! };
//! use signal_gateway::core::light_command::{EnumOrUnknown, TurnCommand};
//! use signal_gateway::core::time::{MonoTime, Now, WallStamp};
//!
//! let second = Duration::from_secs(1);
//! let settings = CommandSettings {
//!     source: CommandSource::Topic,
//!     transmit: Transmit::On,
//!     mode_from: ModeFrom::Topic { timeout: second },
//!     turn_timeout: second,
//!     hazard_timeout: second,
//!     rules: ArbitrationRules::default(),
//!     limits: FeedbackLimits { warn: second, error: second },
//! };
//! let stamp = WallStamp::from_nanos(1);
//! let now = Now { mono: MonoTime::ZERO, wall: stamp };
//! let mut flow = CommandFlow::new(settings, CommandBinding::default(), now);
//! let origin = CommandOrigin::Topic(SampleId::default());
//! let command = EnumOrUnknown::Known(TurnCommand::Left);
//! flow.handle_input(CommandInput::Turn { origin, command, stamp }, now);
//! flow.settle(&[], now);
//! assert_eq!(flow.decision().turn, DecisionReason::NotGranted);
//! assert_eq!(flow.poll_output(), None);
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::names::variant_name;

pub mod allow_list;
pub mod arbitration;
pub mod catalogue;
pub mod control_mode;
pub mod feedback_monitor;
pub mod flow;
pub mod input;
pub mod intake;
pub mod message;
pub mod origin;
pub mod output;
pub mod patch;
pub mod push_button;
pub mod sender;
pub mod settings;
pub mod snapshot;
mod stale_message_filter;
mod status;

/// A request to the turn indicators.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Turn {
    /// Neither side is on.
    #[default]
    Off,
    /// The left side is on.
    Left,
    /// The right side is on.
    Right,
}

impl Turn {
    /// Returns the name in texts.
    pub fn name(self) -> &'static str {
        variant_name(&self)
    }
}

/// The state of the vehicle's lights as the gateway reports it; `None` while a report is withheld.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Reported {
    /// Reported state of the turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}
