//! The outcome of each manoeuvre, for the explanation of a decision.

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shift::ShiftVerdict;
use crate::subject::ManoeuvreKind;

/// The outcome of one manoeuvre, for the explanation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Display)]
#[display("{kind}: {why}")]
pub struct ManoeuvreOutcome {
    /// The kind of the manoeuvre.
    pub kind: ManoeuvreKind,
    /// The reason for its record.
    pub why: SignalReason,
}

/// The reason for the record of a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Display)]
#[serde(rename_all = "snake_case")]
pub enum SignalReason {
    /// The shift rule decided.
    Shift(ShiftVerdict),
    /// It was decided before that it is not signalled.
    #[display("decided before")]
    Ignored,
    /// Nothing to signal: no path, no shift left, too far beside it, not approved.
    #[display("nothing to signal")]
    Idle,
    /// It is signalled by a rule of its own.
    #[display("signalled")]
    OwnRule,
    /// It is known, but too far ahead.
    #[display("too far ahead")]
    TooEarly,
}
