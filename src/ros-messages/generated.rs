//! Code that the build generates from `ros/msg`.

// Names and comments are taken from the definitions.
#![allow(missing_docs, unused_qualifications, clippy::pedantic, clippy::upper_case_acronyms)]

use crate::bounded::at_most;

include!(concat!(env!("OUT_DIR"), "/ros_messages.rs"));

/// Full name of a message type in the notation of recordings, such as `can_msgs/msg/Frame`.
pub type TypeName = &'static str;

/// Returns a full name in DDS notation: `can_msgs::msg::dds_::Frame_`.
pub fn dds_type(full_name: &str) -> String {
    let (folder, name) = full_name.rsplit_once('/').unwrap_or_default();
    format!("{}::dds_::{name}_", folder.replace('/', "::"))
}

/// Returns the hash of a message or service type, defined in ROS 2 since Iron (REP-2016); `None` for a type
/// without a definition. `rmw_zenoh` includes the hash in its keys, so that nodes with different definitions
/// do not receive each other.
pub fn type_hash(full_name: &str) -> Option<&'static str> {
    find(TYPE_HASHES, full_name)
}

/// Returns the definition of a message and of all messages in it in the notation `ros2msg`; `None` for a type
/// without a definition.
pub fn schema(full_name: &str) -> Option<&'static str> {
    find(SCHEMAS, full_name)
}

fn find(table: &[(TypeName, &'static str)], full_name: &str) -> Option<&'static str> {
    table.iter().find(|(known, _)| *known == full_name).map(|(_, text)| *text)
}
