//! `rosgraph_msgs/msg/Clock`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;

/// `rosgraph_msgs/msg/Clock`: the time of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// The present time.
    pub clock: Time,
}
