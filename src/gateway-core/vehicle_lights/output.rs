//! Outputs of the vehicle lights.

use super::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::Step;

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VehicleLightsOutput {
    /// On the topic of `TurnIndicatorsReport`.
    TurnIndicators(Step<TurnIndicators>),
    /// On the topic of `HazardLightsReport`.
    HazardLights(Step<HazardLights>),
}

impl VehicleLightsOutput {
    /// Returns the name of the report and the name of its value; `None` when the report is withdrawn.
    pub fn named(self) -> (&'static str, Option<&'static str>) {
        match self {
            Self::TurnIndicators(step) => ("turn_indicators", step.value().map(TurnIndicators::name)),
            Self::HazardLights(step) => ("hazard_lights", step.value().map(HazardLights::name)),
        }
    }
}
