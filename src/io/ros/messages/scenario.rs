//! `autoware_internal_planning_msgs/msg/Scenario`.

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use crate::core::turn_signal::planner_input::PlannerInput;

/// Most active scenarios of a message.
pub(super) const MAX_SCENARIOS: usize = 100;

/// `autoware_internal_planning_msgs/msg/Scenario`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Scenario {
    /// `Empty`, `LaneDriving` or `Parking`.
    pub current_scenario: String,
    /// All scenarios that are active.
    #[serde(deserialize_with = "at_most::<_, _, MAX_SCENARIOS>")]
    pub activating_scenarios: Vec<String>,
}

impl From<Scenario> for PlannerInput {
    fn from(message: Scenario) -> Self {
        Self::LaneDriving(message.current_scenario == "LaneDriving")
    }
}
