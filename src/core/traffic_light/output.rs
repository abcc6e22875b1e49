//! What the traffic lights give out.

use super::command::CommandError;
use super::emission::Emission;

/// One thing to do, or to tell.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightOutput {
    /// Publish a message.
    Publish(Emission),
    /// A command was not understood. Diagnostics count it; this says what is wrong with it.
    CommandRefused(CommandError),
}
