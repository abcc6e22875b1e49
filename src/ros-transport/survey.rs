//! The participants of a ROS 2 domain, and the writers and readers of given topics, as announced by DDS
//! discovery within a few seconds.

use serde::{Deserialize, Serialize};

use crate::qos::{Durability, Reliability};

/// Maximum number of recorded endpoints on the given topics.
pub const MAX_ENDPOINTS: usize = 1000;

/// Result of discovery in a domain.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct DomainSurvey {
    /// Number of the domain, `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// Number of other participants.
    pub participants: usize,
    /// Writers on the given topics.
    pub writers: Vec<DdsEndpoint>,
    /// Readers of these topics.
    pub readers: Vec<DdsEndpoint>,
}

/// A writer or a reader of another process.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DdsEndpoint {
    /// Absolute name of the topic.
    pub topic: String,
    /// Type in ROS 2 notation, e.g. `std_msgs/msg/String`.
    pub type_name: String,
    /// Reliability that it offers or requests.
    pub reliability: Reliability,
    /// Durability that it offers or requests; stronger levels count as transient local.
    pub durability: Durability,
    /// The implementation of DDS that it uses, e.g. `Cyclone DDS`.
    pub implementation: String,
}
