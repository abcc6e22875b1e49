//! Checks the names of nodes and topics by the rules of ROS 2. Builds without a network side use no names,
//! and accept all.
#![cfg_attr(not(feature = "ros"), expect(unused_variables))]

#[cfg(feature = "ros")]
use ros2_client::names::{Name, NodeName};

use crate::error::TransportError;

/// Checks the name of a node in its namespace.
///
/// # Errors
/// Returns the violated rule.
pub fn check_node(namespace: &str, node: &str) -> Result<(), TransportError> {
    #[cfg(feature = "ros")]
    NodeName::new(namespace, node)?;
    Ok(())
}

/// Checks the absolute name of a topic.
///
/// # Errors
/// Returns the violated rule.
pub fn check_topic(name: &str) -> Result<(), TransportError> {
    #[cfg(feature = "ros")]
    if !Name::parse(name)?.is_absolute() {
        return Err(TransportError::NotAbsolute);
    }
    Ok(())
}
