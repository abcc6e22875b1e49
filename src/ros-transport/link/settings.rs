//! The settings of the network side, which are the first message to it.

use std::net::IpAddr;

use serde::{Deserialize, Serialize};

use crate::parameters::{Parameters, ServiceContents};
use crate::qos::{Delivery, Durability, Reliability};
use crate::settings::{Recovery, Transport};

/// The node's name in the graph, its network, and the topics it writes and reads.
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
    /// Addresses of the interfaces to use; all of them if empty.
    pub only_networks: Vec<IpAddr>,
    /// The topics that are written; orders point here.
    pub written: Vec<WrittenTopic>,
    /// The topics that are read; samples point here.
    pub read: Vec<ReadTopic>,
    /// Intervals at which lost peers and new addresses are acted on.
    pub recovery: Recovery,
    /// True once a sample of our own has come back on this computer. Where none has, it is not a sign of
    /// life.
    pub echo_is_proven: bool,
    /// The most bytes of samples that may be kept until their readers have acknowledged them.
    pub history_bytes: usize,
    /// What the services of the node tell; `None` without services.
    pub services: Option<ServiceContents>,
    /// What carries the messages.
    pub transport: Transport,
}

impl NetworkSettings {
    /// True if each message of the written topic at this position counts, and not only the newest.
    pub fn counts_each(&self, topic: u16) -> bool {
        self.written.get(usize::from(topic)).is_some_and(|written| written.delivery.counts_each())
    }

    /// True if the newest message of the written topic at this position is published again by a successor.
    pub fn is_kept(&self, topic: u16) -> bool {
        self.written.get(usize::from(topic)).is_some_and(|written| written.delivery.is_kept())
    }

    /// Replaces the parameters, where the node has services.
    pub fn set_parameters(&mut self, parameters: Parameters) {
        if let Some(services) = &mut self.services {
            services.parameters = parameters;
        }
    }
}

/// A topic that is written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WrittenTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Package and name of its type.
    pub type_name: (String, String),
    /// Durability offered to readers.
    pub durability: Durability,
    /// Number of samples offered to readers.
    pub depth: i32,
    /// The delivery of its messages to readers.
    pub delivery: Delivery,
}

/// A topic that is read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReadTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Package and name of its type.
    pub type_name: (String, String),
    /// Reliability asked of writers.
    pub reliability: Reliability,
    /// Durability asked of writers.
    pub durability: Durability,
    /// Samples kept while the network side is busy.
    pub depth: i32,
}
