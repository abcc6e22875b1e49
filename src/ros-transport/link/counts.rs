//! Counts of the network side, apart from its samples.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The connections of a network side that speaks Zenoh.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ZenohLinks {
    /// Routers that it is connected with.
    pub routers: u32,
    /// Other sessions that it is connected with.
    pub peers: u32,
    /// Connections lost since it joined the network.
    pub lost: u64,
    /// Nodes that a router knows of and whose connection is lost, until they are connected again.
    pub unreachable: Vec<String>,
}

/// Number of log lines that were not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LostLines {
    /// Lines left out because their kind came too often.
    pub suppressed: u64,
    /// Lines lost because standard error did not take them.
    pub dropped: u64,
}

impl LostLines {
    /// Returns the sum of both counts.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            suppressed: self.suppressed.saturating_add(other.suppressed),
            dropped: self.dropped.saturating_add(other.dropped),
        }
    }
}
