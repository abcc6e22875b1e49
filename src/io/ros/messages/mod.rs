//! The ROS 2 messages that this gateway sends and receives.
//!
//! The build generates the types from the definitions in `ros/msg`, in a module for each package, with their type hashes
//! and the texts for recordings (`build/ros_messages.rs`). The files here convert from and to the core's types. One
//! `Serialize` serves two readers: CDR on the wire has the fields in order, JSON has them by name.

mod array_element;
mod bounded;
mod cdr_bytes;
mod diagnostics;
mod element;
mod geometry;
mod lanelet_route;
mod lights;
mod lights_encoder;
mod marker_array;
mod planner_inputs;
mod planning_factor_array;
mod section_markers;
mod stamp;
mod traffic_light_array_v1;
mod traffic_light_group_array;
mod traffic_signal_array;
mod vehicle;

pub use cdr_bytes::CdrBytes;
pub use generated::*;
pub use lights::{LightsMessage, LightsType};
pub use lights_encoder::LightsEncoder;

/// A message type as `(package, name)`.
pub type TypeName = (&'static str, &'static str);

// Names and comments are the definitions' own.
#[allow(missing_docs, unused_qualifications, clippy::pedantic, clippy::upper_case_acronyms)]
mod generated {
    use super::TypeName;
    use super::bounded::at_most;

    include!(concat!(env!("OUT_DIR"), "/ros_messages.rs"));
}

/// Returns the hash of a message or service type as ROS 2 has it since Iron (REP-2016); `None` for a type without a
/// definition. `rmw_zenoh` has the hash in its keys, so that nodes whose definitions differ do not receive each other.
pub fn type_hash(package: &str, name: &str) -> Option<&'static str> {
    find(TYPE_HASHES, (package, name))
}

/// Returns the definition of a message and of all messages in it in the notation `ros2msg`; `None` for a type without a
/// definition.
pub(in crate::io) fn schema(type_name: TypeName) -> Option<&'static str> {
    find(SCHEMAS, type_name)
}

fn find(table: &[(TypeName, &'static str)], type_name: (&str, &str)) -> Option<&'static str> {
    table.iter().find(|(known, _)| *known == type_name).map(|(_, text)| *text)
}

#[cfg(test)]
mod autoware_tests;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod lights_tests;
#[cfg(test)]
mod vehicle_tests;
