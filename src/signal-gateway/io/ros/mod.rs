//! ROS 2: the messages, the topics, and the session that sends and receives them over DDS.

pub mod domain_survey;
mod duplicate_filter;
pub mod inbox;
pub mod link;
pub mod messages;
#[cfg(feature = "ros")]
pub mod network;
pub(crate) mod outgoing;
pub mod parameters;
pub mod reading;
pub mod reception;
#[cfg(feature = "ros")]
pub mod session;
pub mod settings;
pub mod topics;
pub mod zenoh_config;
