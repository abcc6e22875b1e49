//! Outputs of the decider.

use std::sync::Arc;

use super::decision::Decision;
use super::signal::{Hazard, Signal};
use crate::core::time::WallStamp;

/// A command to publish, or a decision to report.
#[derive(Debug, Clone, PartialEq)]
pub enum TurnSignalOutput {
    /// Publish `TurnIndicatorsCommand`.
    TurnCommand {
        /// The command.
        command: Signal,
        /// Now.
        stamp: WallStamp,
    },
    /// Publish `HazardLightsCommand`.
    HazardCommand {
        /// The command.
        command: Hazard,
        /// Now.
        stamp: WallStamp,
    },
    /// A decision that differs from the one before in its command or its reason; for reports, not published.
    Decision(Arc<Decision>),
}
