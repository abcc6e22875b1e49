//! Inputs of the traffic lights, beside the V2X unit on a CAN bus.

use super::engine::LightObservation;
use super::target::StoreId;
use crate::core::time::WallStamp;

/// One message to the traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightInput {
    /// States of lights for a store.
    States {
        /// The store that they are written to.
        store: StoreId,
        /// The sender's stamp, which has no effect.
        stamp: WallStamp,
        /// States by way or relation id; `None` removes one.
        states: Vec<(i64, Option<LightObservation>)>,
        /// Number of further states that could not be read.
        rejected: u32,
    },
    /// An action as text, see [`parse_command`](super::command::parse_command).
    Command(String),
}
