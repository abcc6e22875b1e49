//! What a ROS 2 session needs to know.

use std::net::IpAddr;
use std::time::Duration;

use super::topics::{Durability, Subscription, Topics};

/// Who we are in the graph, on which network, what we publish there and what we read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosSettings {
    /// Node name: letters, digits and `_`, not starting with a digit.
    pub node: String,
    /// Namespace, absolute: `/` or `/a/b`.
    pub namespace: String,
    /// `ROS_DOMAIN_ID`, 0 to 232.
    pub domain_id: u16,
    /// Addresses of the interfaces to use; empty = all.
    pub only_networks: Vec<IpAddr>,
    /// Of both reports.
    pub durability: Durability,
    /// The topics we write.
    pub topics: Topics,
    /// The topics we read.
    pub subscriptions: Vec<Subscription>,
    /// `hardware_id` of every diagnostic status; `none` when there is no hardware to name.
    pub hardware_id: String,
    /// How soon lost peers and new addresses are acted on.
    pub recovery: Recovery,
}

/// Intervals of a session that watches its network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recovery {
    /// How often interfaces, missing peers and acknowledgements are looked at; 1 s by default.
    pub check_interval: Duration,
    /// The shortest time between two participants of ours, the first included; 3 s by default.
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
            domain_id: 0,
            only_networks: Vec::new(),
            durability: Durability::default(),
            topics: Topics::default(),
            subscriptions: Vec::new(),
            hardware_id: "none".to_owned(),
            recovery: Recovery::default(),
        }
    }
}
