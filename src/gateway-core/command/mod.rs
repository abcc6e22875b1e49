//! Commands to the vehicle: from Autoware or the decider, through arbitration into frames, and compared with
//! the vehicle's report (docs/spec/vehicle-interface.md, "Arbitration of commands").
//!
//! Vocabulary: a *command* is one message of a sender; its *command state* combines all its messages; a
//! *grant* is a function that the control mode allows; a *request* goes to the vehicle with authority;
//! *compliance* is the result of comparing the vehicle's report with the request.
//!
//! Without a control mode nothing is granted:

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::names::named_by_variant;

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

named_by_variant!(Turn);

/// State of the vehicle's lights as reported by the gateway; `None` while a report is withheld.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct Reported {
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}
