//! Settings of the network side that are not about a topic.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// What carries the messages.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Transport {
    /// The data distribution service of the OMG.
    #[default]
    Dds,
    /// Zenoh, in the conventions of `rmw_zenoh`.
    Zenoh(ZenohSettings),
}

/// Settings of the Zenoh session.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ZenohSettings {
    /// The configuration of Zenoh in JSON5; `None` for a client of a router on the same computer.
    pub config: Option<String>,
    /// What stands for the hash of a type in keys.
    pub type_hashes: TypeHashes,
}

/// What stands for the hash of a type in the keys of `rmw_zenoh`. Nodes of which it differs do not hear each
/// other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TypeHashes {
    /// The hash itself, `RIHS01_…`: Jazzy and later.
    #[default]
    Rihs01,
    /// The word `TypeHashNotSupported`: Humble.
    NotSupported,
}

/// Intervals of a session that watches its network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovery {
    /// Time between two checks of interfaces, missing peers and acknowledgements; 1 s by default.
    pub check_interval: Duration,
    /// Shortest time between the making of two participants, the first included; 3 s by default.
    pub min_rebuild_interval: Duration,
}

impl Default for Recovery {
    fn default() -> Self {
        Self { check_interval: Duration::from_secs(1), min_rebuild_interval: Duration::from_secs(3) }
    }
}
