//! Outputs of the traffic lights.

use super::command::CommandError;
use super::emission::Emission;

/// One output of the traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightOutput {
    /// Publish a message.
    Publish(Emission),
    /// A command was not understood. Diagnostics count it; the error is for the log.
    CommandRefused(CommandError),
}
