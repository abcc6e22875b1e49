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
mod gateway_call;
mod generated;
mod geometry;
mod lights;
mod lights_encoder;
mod marker_array;
mod planner_inputs;
mod planning_factor_array;
mod section_markers;
mod stamp;
mod traffic_light_array_v1;
mod traffic_light_group_array;
mod vehicle;

pub use cdr_bytes::CdrBytes;
pub use generated::*;
pub use lights::{LightsMessage, LightsType};
pub use lights_encoder::LightsEncoder;

#[cfg(test)]
mod autoware_tests;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod lights_tests;
#[cfg(test)]
mod vehicle_tests;
