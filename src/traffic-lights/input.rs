//! Inputs of the traffic lights, except the states of a V2X unit.

use super::emission::Groups;
use super::received::ReceivedState;
use super::target::StoreId;
use gateway_base::time::WallStamp;

/// One message to the traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum TrafficLightInput {
    /// States of lights for a store.
    States {
        /// The store to which they are written.
        store: StoreId,
        /// The sender's stamp, which has no effect.
        stamp: WallStamp,
        /// States by way or relation id; `None` removes one.
        states: Vec<(i64, Option<ReceivedState>)>,
        /// Number of further states and predictions that were unreadable.
        rejected: u32,
    },
    /// Groups of a camera pipeline, for the arbiter.
    Camera {
        /// The sender's stamp, which the arbiter compares with the stamps of the network.
        stamp: WallStamp,
        /// The groups of the message.
        groups: Groups,
        /// Number of further groups that were unreadable.
        rejected: u32,
    },
    /// The time of a simulator.
    Clock(WallStamp),
    /// An action as text, see [`parse_command`](super::command::parse_command).
    Command(String),
}
