//! Outputs of the traffic lights.

use super::command::CommandError;
use super::emission::Emission;

/// One output of the traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightOutput {
    /// A message to publish.
    Publish(Emission),
    /// A command that was invalid. Diagnostics count it; the error is for the log.
    CommandRefused(CommandError),
}
