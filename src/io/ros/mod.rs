//! ROS 2: the messages, the topics, and the session that publishes them over DDS.

pub mod messages;
pub mod settings;
pub mod topics;
