//! Outputs of the decider.

use std::sync::Arc;

use super::decision::Decision;
use crate::light_command::{HazardCommand, TurnCommand};
use gateway_base::time::WallStamp;

/// A command to publish, or a decision to report.
#[derive(Debug, Clone, PartialEq)]
pub enum TurnSignalOutput {
    /// A `TurnIndicatorsCommand` to publish.
    TurnCommand {
        /// The command of the turn indicators.
        command: TurnCommand,
        /// Time of the decision.
        stamp: WallStamp,
    },
    /// A `HazardLightsCommand` to publish.
    HazardCommand {
        /// The command of the hazard lights.
        command: HazardCommand,
        /// Time of the decision.
        stamp: WallStamp,
    },
    /// The sections of a cycle to publish, for a viewer and for the planner, on the configured topics.
    Sections {
        /// The decision of the cycle, with its sections.
        decision: Arc<Decision>,
        /// Time of the decision.
        stamp: WallStamp,
    },
    /// A decision whose command or reason differs from the previous one; for reports, not published.
    Decision(Arc<Decision>),
}
