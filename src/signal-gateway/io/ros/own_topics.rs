//! The topics of this node, for comparison with the topics of a domain.

use serde::{Deserialize, Serialize};

use super::outgoing;
use super::settings::RosSettings;
use super::topics::{Durability, Reliability};

/// A topic of this node.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OwnTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Type in ROS 2 notation.
    pub type_name: String,
    /// Reliability that is offered or requested.
    pub reliability: Reliability,
    /// Durability that is offered or requested.
    pub durability: Durability,
    /// True for a topic that many nodes publish, such as `/diagnostics`.
    #[serde(default)]
    pub is_shared: bool,
}

/// Returns the topics that a session with these settings publishes, and the topics that it subscribes to.
pub fn own_topics(settings: &RosSettings) -> (Vec<OwnTopic>, Vec<OwnTopic>) {
    let written = outgoing::table(&settings.topics, settings.durability).into_iter().map(|topic| OwnTopic {
        is_shared: topic.is_shared(),
        name: topic.name,
        type_name: topic.type_name.to_owned(),
        reliability: Reliability::Reliable,
        durability: topic.durability,
    });
    let read = settings.subscriptions.iter().map(|topic| OwnTopic {
        name: topic.name.clone(),
        type_name: topic.kind.row().type_name.to_owned(),
        reliability: topic.reliability,
        durability: topic.durability,
        is_shared: false,
    });
    (written.collect(), read.collect())
}
