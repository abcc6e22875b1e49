//! Checks the names of nodes and topics by the rules of ROS 2.

use ros2_client::names::{Name, NodeName};

/// Checks the name of a node in its namespace.
///
/// # Errors
/// Returns the violated rule, as text.
pub fn check_node(namespace: &str, node: &str) -> Result<(), String> {
    NodeName::new(namespace, node).map(drop).map_err(|why| why.to_string())
}

/// Checks the absolute name of a topic.
///
/// # Errors
/// Returns the violated rule, as text.
pub fn check_topic(name: &str) -> Result<(), String> {
    let parsed = Name::parse(name).map_err(|why| why.to_string())?;
    if parsed.is_absolute() { Ok(()) } else { Err("does not start with `/`".to_owned()) }
}
