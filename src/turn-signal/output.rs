//! Outputs of the decider.

use std::sync::Arc;

use super::decision::Decision;
use crate::light_command::{HazardCommand, TurnCommand};
use gateway_base::time::WallStamp;

/// A command to publish, or a decision to report. Each stamp is the time of the decision.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum TurnSignalOutput {
    /// A `TurnIndicatorsCommand` to publish.
    TurnCommand { command: TurnCommand, stamp: WallStamp },
    /// A `HazardLightsCommand` to publish.
    HazardCommand { command: HazardCommand, stamp: WallStamp },
    /// The sections of a cycle to publish, for a viewer and for the planner, on the configured topics.
    Sections { decision: Arc<Decision>, stamp: WallStamp },
    /// A decision whose command or reason differs from the previous one; for reports, not published.
    Decision(Arc<Decision>),
}
