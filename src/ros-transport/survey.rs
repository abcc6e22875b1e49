//! Who is in a ROS 2 domain, and who writes and reads which topics: what DDS discovery tells within a few
//! seconds.

use serde::{Deserialize, Serialize};

use crate::qos::{Durability, Reliability};

/// Endpoints on the topics that were asked for; further ones are not noted.
pub const MAX_ENDPOINTS: usize = 1000;

/// What discovery told of a domain.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct DomainSurvey {
    /// Number of the domain, `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// Participants of others.
    pub participants: usize,
    /// Writers on the topics that were asked for.
    pub writers: Vec<DdsEndpoint>,
    /// Readers of these topics.
    pub readers: Vec<DdsEndpoint>,
}

/// A writer or a reader of another process.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DdsEndpoint {
    /// Absolute name of the topic.
    pub topic: String,
    /// Type as ROS 2 writes it, e.g. `std_msgs/msg/String`.
    pub type_name: String,
    /// Reliability that it offers or requests.
    pub reliability: Reliability,
    /// Durability that it offers or requests; what is more than transient local counts as that.
    pub durability: Durability,
    /// The implementation of DDS that it uses, e.g. `Cyclone DDS`.
    pub implementation: String,
}
