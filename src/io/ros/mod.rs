//! ROS 2: the messages, the topics, and the session that sends and receives them over DDS.

pub mod inbox;
pub mod messages;
pub mod reading;
#[cfg(feature = "ros")]
pub mod session;
pub mod settings;
pub mod topics;
