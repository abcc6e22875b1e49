//! What others tell the traffic lights, beside the V2X unit on a CAN bus.

use super::engine::LightObservation;
use super::target::StoreId;
use crate::core::time::WallStamp;

/// One message for the traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightInput {
    /// States of traffic lights, for a store.
    States {
        /// Which store.
        store: StoreId,
        /// The sender's; it decides nothing.
        stamp: WallStamp,
        /// By way or relation id; `None` = there is none any more.
        states: Vec<(i64, Option<LightObservation>)>,
        /// How many more could not be read.
        rejected: u32,
    },
    /// An action to do, as text, see [`parse_command`](super::command::parse_command).
    Command(String),
}
