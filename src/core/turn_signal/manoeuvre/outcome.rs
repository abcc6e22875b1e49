//! The outcome of each manoeuvre, for the explanation of a decision.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::turn_signal::shift::ShiftVerdict;
use crate::core::turn_signal::subject::ManoeuvreKind;

/// The outcome of one manoeuvre, for the explanation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ManoeuvreOutcome {
    /// The kind of the manoeuvre.
    pub kind: ManoeuvreKind,
    /// The reason for its record.
    pub why: SignalReason,
}

/// The reason for the record of a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SignalReason {
    /// The shift rule decided.
    Shift(ShiftVerdict),
    /// It was decided before that it is not signalled.
    Ignored,
    /// Nothing to signal: no path, no shift left, too far beside it, not approved.
    Idle,
    /// It is signalled by a rule of its own.
    OwnRule,
    /// It is known, but too far ahead.
    TooEarly,
}

impl fmt::Display for ManoeuvreOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind, self.why)
    }
}

impl fmt::Display for SignalReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shift(verdict) => write!(f, "{verdict}"),
            Self::Ignored => f.write_str("decided before"),
            Self::Idle => f.write_str("nothing to signal"),
            Self::OwnRule => f.write_str("signalled"),
            Self::TooEarly => f.write_str("too far ahead"),
        }
    }
}
