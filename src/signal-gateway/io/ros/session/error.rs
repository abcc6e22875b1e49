//! Reasons why a session cannot start.

use std::io;

/// Highest domain for which UDP ports exist.
pub(super) const LAST_DOMAIN: u16 = 232;

/// Why a session cannot start.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // see the texts
pub enum RosError {
    #[error(
        "node `{node}` in namespace `{namespace}`: {why}; use letters, digits and `_`, and a namespace like `/` or `/vehicle`"
    )]
    Node {
        node: String,
        namespace: String,
        /// The rule that the name breaks, as text.
        why: String,
    },
    #[error("topic `{topic}`: {why}; use an absolute name like `/diagnostics`")]
    Topic {
        topic: String,
        /// The rule that the name breaks, as text.
        why: String,
    },
    #[error("topic `{topic}`: a depth of {depth} keeps no sample; use 1 or more")]
    Depth {
        topic: String,
        /// The configured depth, samples.
        depth: i32,
    },
    #[error("ROS_DOMAIN_ID {0} is out of range; use 0 to {LAST_DOMAIN}")]
    Domain(u16),
    #[error("DDS could not be set up: {0}; are the UDP ports of the domain free?")]
    Dds(String),
    #[error("Zenoh could not be set up: {0}; see the file of [ros.zenoh] config")]
    Zenoh(String),
    /// The thread or the process could not be started.
    #[error("no thread or process for ROS 2: {0}")]
    Start(#[from] io::Error),
}
