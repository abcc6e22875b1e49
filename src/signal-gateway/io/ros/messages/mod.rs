//! Conversion between ROS 2 messages and the gateway's inputs and outputs. The message types are in
//! [`ros_messages`].

mod array_element;
mod diagnostics;
mod element;
mod gateway_call;
mod geometry;
mod lights;
mod lights_encoder;
mod marker_array;
pub mod planner_inputs;
mod planning_factor_array;
mod section_markers;
mod traffic_light_array_v1;
mod traffic_light_group_array;
mod vehicle;

pub use diagnostics::{diagnostic_array, diagnostic_status};
pub use gateway_call::{call_message, timed_call};
pub use lights::{LightsMessage, LightsType};
pub use lights_encoder::LightsEncoder;
pub use planning_factor_array::{factors_input, factors_of_decision};
pub use section_markers::section_markers;
pub use traffic_light_group_array::{groups_for_arbiter, groups_for_store};
pub use vehicle::ToRos;

#[cfg(test)]
mod autoware_tests;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod lights_tests;
#[cfg(test)]
mod vehicle_tests;
