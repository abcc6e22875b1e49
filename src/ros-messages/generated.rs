//! Code that the build generates from `ros/msg`.

// Names and comments are taken from the definitions.
#![allow(missing_docs, unused_qualifications, clippy::pedantic, clippy::upper_case_acronyms)]

use crate::bounded::at_most;

include!(concat!(env!("OUT_DIR"), "/ros_messages.rs"));

/// A message type as `(package, name)`.
pub type TypeName = (&'static str, &'static str);

/// Returns the name of a message type in the notation of recordings: `can_msgs/msg/Frame`.
pub fn full_name((package, name): TypeName) -> String {
    format!("{package}/msg/{name}")
}

/// Returns the hash of a message or service type, defined in ROS 2 since Iron (REP-2016); `None` for a type
/// without a definition. `rmw_zenoh` includes the hash in its keys, so that nodes with different definitions
/// do not receive each other.
pub fn type_hash(package: &str, name: &str) -> Option<&'static str> {
    find(TYPE_HASHES, (package, name))
}

/// Returns the definition of a message and of all messages in it in the notation `ros2msg`; `None` for a type
/// without a definition.
pub fn schema(type_name: TypeName) -> Option<&'static str> {
    find(SCHEMAS, type_name)
}

fn find(table: &[(TypeName, &'static str)], type_name: (&str, &str)) -> Option<&'static str> {
    table.iter().find(|(known, _)| *known == type_name).map(|(_, text)| *text)
}
