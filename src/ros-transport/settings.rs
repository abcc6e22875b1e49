//! Settings of the network side that do not concern topics.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The middleware that carries the messages.
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
    /// Replacement for type hashes in keys.
    pub type_hashes: TypeHashes,
}

/// Form of the type hash in the keys of `rmw_zenoh`. Nodes with different forms do not receive each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TypeHashes {
    /// The hash itself, `RIHS01_…`: Jazzy and later.
    #[default]
    Rihs01,
    /// The word `TypeHashNotSupported`: Humble.
    NotSupported,
}

/// Intervals at which a session checks its network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovery {
    /// Time between two checks of interfaces, missing peers and acknowledgements; 1 s by default.
    pub check_interval: Duration,
    /// Minimum time between the creation of two participants, including the first; 3 s by default.
    pub min_rebuild_interval: Duration,
}

impl Default for Recovery {
    fn default() -> Self {
        Self { check_interval: Duration::from_secs(1), min_rebuild_interval: Duration::from_secs(3) }
    }
}
