//! Settings of a ROS 2 session.

use std::net::IpAddr;
use std::path::PathBuf;

use ros_transport::parameters::ServiceContents;
use ros_transport::settings::{Recovery, Transport};

use super::topics::{Durability, Subscription, Topics};

/// Name of the node, its network, and the topics that it publishes and subscribes to.
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
    /// Published topics.
    pub topics: Topics,
    /// Contents of the node's services; `None` without services.
    pub services: Option<ServiceContents>,
    /// Subscribed topics.
    pub subscriptions: Vec<Subscription>,
    /// `hardware_id` of every diagnostic status; `none` without a vehicle.
    pub hardware_id: String,
    /// Intervals for the recovery from lost peers and changed addresses.
    pub recovery: Recovery,
    /// Transport of the messages.
    pub transport: Transport,
    /// Where DDS or Zenoh runs.
    pub isolation: Isolation,
}

/// Where the network side of a session runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Isolation {
    /// In a thread of this process, for debuggers and tests: a crash of DDS ends the process, and a hanging
    /// DDS is not replaced.
    #[default]
    Thread,
    /// In a separate process, which is replaced if it dies.
    Process {
        /// Program that acts as the network side with the arguments `network LEVEL MEMORY`; `/proc/self/exe`
        /// is this one.
        program: PathBuf,
        /// Maximum private writable memory of the process, MB.
        memory_limit_mb: u32,
        /// Socket at which systemd starts the process as another user. If it cannot be reached, the process
        /// is started directly.
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
