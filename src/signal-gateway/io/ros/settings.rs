//! Settings of a ROS 2 session.

use std::net::IpAddr;
use std::path::PathBuf;

use ros_transport::parameters::ServiceContents;
use ros_transport::settings::{Recovery, Transport};

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
