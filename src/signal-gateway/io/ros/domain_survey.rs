//! Who is in a ROS 2 domain, and who writes and reads which topics: what DDS discovery tells within a few
//! seconds.

#[cfg(feature = "ros")]
use std::net::IpAddr;
#[cfg(feature = "ros")]
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::outgoing;
use super::settings::RosSettings;
use super::topics::{Durability, Reliability};
use ros_messages::TypeName;

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

/// A topic of this node.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OwnTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Type as ROS 2 writes it.
    pub type_name: String,
    /// Reliability that is offered or requested.
    pub reliability: Reliability,
    /// Durability that is offered or requested.
    pub durability: Durability,
    /// True for a topic that many nodes write, such as `/diagnostics`.
    #[serde(default)]
    pub is_shared: bool,
}

/// Returns the topics that a session with these settings writes, and those that it reads.
pub fn own_topics(settings: &RosSettings) -> (Vec<OwnTopic>, Vec<OwnTopic>) {
    let type_name = |(package, name): TypeName| format!("{package}/msg/{name}");
    let written = outgoing::table(&settings.topics, settings.durability).into_iter().map(|topic| OwnTopic {
        is_shared: topic.is_shared(),
        name: topic.name,
        type_name: type_name(topic.type_name),
        reliability: Reliability::Reliable,
        durability: topic.durability,
    });
    let read = settings.subscriptions.iter().map(|topic| OwnTopic {
        name: topic.name.clone(),
        type_name: type_name(topic.kind.row().type_name),
        reliability: topic.reliability,
        durability: topic.durability,
        is_shared: false,
    });
    (written.collect(), read.collect())
}

/// Joins a domain without readers and writers for `time`, and returns what discovery told.
///
/// # Errors
/// The reason why the domain cannot be joined, as text.
#[cfg(feature = "ros")]
pub fn survey(
    domain_id: u16,
    only_networks: &[IpAddr],
    topics: &[String],
    time: Duration,
) -> Result<DomainSurvey, String> {
    super::network::survey(domain_id, only_networks, topics, time)
}
