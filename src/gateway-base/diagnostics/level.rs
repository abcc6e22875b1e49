//! Severity of a status.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::names::display_by_name;

/// Severity of a status, `DiagnosticStatus.level` of ROS.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "UPPERCASE")]
#[repr(u8)]
pub enum Level {
    /// Works without a problem (0).
    #[default]
    Ok = 0,
    /// Works with a problem (1).
    Warn = 1,
    /// Does not work at all (2).
    Error = 2,
    /// Not refreshed (3); set by aggregators, never by this gateway.
    Stale = 3,
}

display_by_name!(Level);
