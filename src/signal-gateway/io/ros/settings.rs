//! Settings of a ROS 2 session.

use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::parameters::ServiceContents;
use super::topics::{Durability, Subscription, Topics};

/// The node's name in the graph, its network, and the topics it writes and reads.
#[derive(Debug, Clone, PartialEq)]
pub struct RosSettings {
    /// Node name: letters, digits and `_`, not starting with a digit.
    pub node: String,
    /// Namespace, absolute: `/` or `/a/b`.
    pub namespace: String,
    /// True if the graph lists the node with its writers and readers; data does not depend on it.
    pub graph: bool,
    /// `ROS_DOMAIN_ID`, 0 to 232.
    pub domain_id: u16,
    /// Addresses of the interfaces to use; all of them if empty.
    pub only_networks: Vec<IpAddr>,
    /// Durability of both reports.
    pub durability: Durability,
    /// The topics that are written.
    pub topics: Topics,
    /// What the services of the node tell; `None` without services.
    pub services: Option<ServiceContents>,
    /// The topics that are read.
    pub subscriptions: Vec<Subscription>,
    /// `hardware_id` of every diagnostic status; `none` without a vehicle.
    pub hardware_id: String,
    /// Intervals at which lost peers and new addresses are acted on.
    pub recovery: Recovery,
    /// What carries the messages.
    pub transport: Transport,
    /// Where DDS or Zenoh runs.
    pub isolation: Isolation,
}

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

/// Where the network side of a session runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Isolation {
    /// In a thread of this process, for debuggers and tests: what brings DDS down brings the process down,
    /// and a DDS that hangs stays.
    #[default]
    Thread,
    /// In a process of its own, which may die and is replaced.
    Process {
        /// The program, which serves with the arguments `network LEVEL MEMORY`; this one is `/proc/self/exe`.
        program: PathBuf,
        /// The most private writable memory of the process, MB.
        memory_limit_mb: u32,
        /// The socket at which systemd starts it as another user; one that cannot be reached is done without.
        supervisor: Option<PathBuf>,
    },
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

impl Default for RosSettings {
    fn default() -> Self {
        Self {
            node: "signal_gateway".to_owned(),
            namespace: "/".to_owned(),
            graph: true,
            domain_id: 0,
            only_networks: Vec::new(),
            durability: Durability::default(),
            topics: Topics::default(),
            services: None,
            subscriptions: Vec::new(),
            hardware_id: "none".to_owned(),
            recovery: Recovery::default(),
            transport: Transport::default(),
            isolation: Isolation::default(),
        }
    }
}
