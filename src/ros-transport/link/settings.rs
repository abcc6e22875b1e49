//! The settings of the network side, sent as the first message.

use std::net::IpAddr;

use serde::{Deserialize, Serialize};

use crate::parameters::{Parameters, ServiceContents};
use crate::qos::{Delivery, Durability, Reliability};
use crate::settings::{Recovery, Transport};

/// The node's name in the graph, its network, and its written and read topics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NetworkSettings {
    /// Name of the node.
    pub node: String,
    /// Namespace of the node, absolute.
    pub namespace: String,
    /// True if the graph lists the node.
    pub graph: bool,
    /// `ROS_DOMAIN_ID`, 0 to 232.
    pub domain_id: u16,
    /// Addresses of the interfaces to use; all interfaces if empty.
    pub only_networks: Vec<IpAddr>,
    /// The written topics; orders contain positions in this list.
    pub written: Vec<WrittenTopic>,
    /// The read topics; samples contain positions in this list.
    pub read: Vec<ReadTopic>,
    /// Intervals for reacting to lost peers and new addresses.
    pub recovery: Recovery,
    /// True once a sample of our own has returned on this computer. Otherwise a missing echo is not a
    /// failure.
    pub echo_is_proven: bool,
    /// Maximum number of bytes of samples kept until their readers have acknowledged them.
    pub history_bytes: usize,
    /// Content of the node's services; `None` without services.
    pub services: Option<ServiceContents>,
    /// The middleware that carries the messages.
    pub transport: Transport,
}

impl NetworkSettings {
    /// Returns true if every message of the written topic at this position counts, not only the newest.
    pub fn counts_each(&self, topic: u16) -> bool {
        self.written.get(usize::from(topic)).is_some_and(|written| written.delivery.counts_each())
    }

    /// Returns true if a successor publishes the newest message of the written topic at this position again.
    pub fn is_kept(&self, topic: u16) -> bool {
        self.written.get(usize::from(topic)).is_some_and(|written| written.delivery.is_kept())
    }

    /// Replaces the parameters, if the node has services.
    pub fn set_parameters(&mut self, parameters: Parameters) {
        if let Some(services) = &mut self.services {
            services.parameters = parameters;
        }
    }
}

/// A written topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WrittenTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Full name of its type.
    pub type_name: String,
    /// Durability offered to readers.
    pub durability: Durability,
    /// Number of samples offered to readers.
    pub depth: i32,
    /// The delivery of its messages to readers.
    pub delivery: Delivery,
}

/// A read topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReadTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Full name of its type.
    pub type_name: String,
    /// Reliability requested from writers.
    pub reliability: Reliability,
    /// Durability requested from writers.
    pub durability: Durability,
    /// Number of samples kept while the network side is busy.
    pub depth: i32,
}
