//! Outputs of the vehicle lights.

use super::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::Step;
use gateway_base::names::state_word;

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VehicleLightsOutput {
    /// On the topic of `TurnIndicatorsReport`.
    TurnIndicators(Step<TurnIndicators>),
    /// On the topic of `HazardLightsReport`.
    HazardLights(Step<HazardLights>),
}

impl VehicleLightsOutput {
    /// Returns the name of the report and the word for its value; `None` when the report is withdrawn.
    pub fn named(self) -> (&'static str, Option<String>) {
        match self {
            Self::TurnIndicators(step) => ("turn_indicators", step.value().map(|value| state_word(&value))),
            Self::HazardLights(step) => ("hazard_lights", step.value().map(|value| state_word(&value))),
        }
    }
}
