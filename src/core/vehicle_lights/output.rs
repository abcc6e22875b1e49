//! Outputs of the vehicle lights.

use super::report::Step;
use super::verdict::{HazardLights, TurnIndicators};

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VehicleLightsOutput {
    /// For the topic of `TurnIndicatorsReport`.
    TurnIndicators(Step<TurnIndicators>),
    /// For the topic of `HazardLightsReport`.
    HazardLights(Step<HazardLights>),
}
