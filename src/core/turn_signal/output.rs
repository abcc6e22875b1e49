//! What the decider gives out.

use std::sync::Arc;

use super::decision::Decision;
use super::signal::{Hazard, Signal};
use crate::core::time::WallStamp;

/// One thing to publish, or to read along.
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
    /// The turn signal was decided otherwise than before, or for another reason. Not published: for
    /// those who read along.
    Decision(Arc<Decision>),
}
