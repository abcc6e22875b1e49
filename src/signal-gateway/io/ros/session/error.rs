//! Reasons why a session cannot start.

use std::io;

/// Highest domain for which UDP ports exist.
pub(super) const LAST_DOMAIN: u16 = 232;

/// Why a session cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// The node name or namespace is not allowed by ROS 2.
    #[error(
        "node `{node}` in namespace `{namespace}`: {why}; use letters, digits and `_`, and a namespace like `/` or `/vehicle`"
    )]
    Node {
        /// The configured node name.
        node: String,
        /// The namespace as configured.
        namespace: String,
        /// The rule that the name breaks, as text.
        why: String,
    },
    /// The topic name is not allowed by ROS 2.
    #[error("topic `{topic}`: {why}; use an absolute name like `/diagnostics`")]
    Topic {
        /// The configured topic name.
        topic: String,
        /// The rule that the name breaks, as text.
        why: String,
    },
    /// The subscription would keep no sample.
    #[error("topic `{topic}`: a depth of {depth} keeps no sample; use 1 or more")]
    Depth {
        /// Absolute name of the topic.
        topic: String,
        /// The configured depth, samples.
        depth: i32,
    },
    /// The domain has no UDP ports.
    #[error("ROS_DOMAIN_ID {0} is out of range; use 0 to {LAST_DOMAIN}")]
    Domain(u16),
    /// DDS could not be set up.
    #[error("DDS could not be set up: {0}; are the UDP ports of the domain free?")]
    Dds(String),
    /// Zenoh could not be set up.
    #[error("Zenoh could not be set up: {0}; see the file of [ros.zenoh] config")]
    Zenoh(String),
    /// The thread or the process could not be started.
    #[error("no thread or process for ROS 2: {0}")]
    Start(#[from] io::Error),
}
