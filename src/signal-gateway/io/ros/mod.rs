//! ROS 2: the topics, and the session that sends and receives their messages over `ros_transport`.

mod duplicate_filter;
pub mod inbox;
pub mod messages;
pub(crate) mod outgoing;
pub mod own_topics;
pub mod reading;
pub mod reception;
pub mod session;
pub mod settings;
pub mod topics;
