//! Reasons why the network side cannot do something.

use thiserror::Error;

#[cfg(feature = "ros")]
use ros_messages::cdr::CdrBytes;

/// Reason why a network cannot be joined, or a message is not sent.
#[derive(Debug, Error)]
pub enum TransportError {
    /// This build has no network side.
    #[error("this build has no ROS 2")]
    NotBuiltIn,
    /// The rules of ROS 2 do not allow the name of a node or topic.
    #[cfg(feature = "ros")]
    #[error(transparent)]
    Name(#[from] ros2_client::names::NameError),
    /// The rules of ROS 2 do not allow the name of a configured topic.
    #[cfg(feature = "ros")]
    #[error("topic `{topic}`: {why}")]
    Topic {
        /// The configured name.
        topic: String,
        /// The violated rule.
        why: ros2_client::names::NameError,
    },
    /// The name of a topic is not absolute.
    #[error("does not start with `/`")]
    NotAbsolute,
    /// RustDDS cannot create a participant or one of its parts.
    #[cfg(feature = "ros")]
    #[error(transparent)]
    Create(#[from] rustdds::dds::result::CreateError),
    /// RustDDS does not take a sample.
    #[cfg(feature = "ros")]
    #[error(transparent)]
    Write(#[from] rustdds::dds::result::WriteError<CdrBytes>),
    /// A message cannot be encoded.
    #[error(transparent)]
    Encode(#[from] cdr_encoding::Error),
    /// The operating system refuses a thread.
    #[error(transparent)]
    Thread(#[from] std::io::Error),
    /// The settings have no configuration for this engine.
    #[error("not configured")]
    NotConfigured,
    /// The configuration of Zenoh cannot be used.
    #[error(transparent)]
    ZenohConfig(#[from] crate::zenoh_config::ZenohConfigError),
    /// A type has no known hash, which Zenoh's keys need.
    #[error("the hash of {0} is not known")]
    NoHash(String),
    /// Zenoh refuses a session or one of its parts.
    #[cfg(feature = "zenoh")]
    #[error("{0}")]
    Zenoh(#[from] zenoh::Error),
}

/// Reason why a received sample is not read, or a request is not answered.
#[cfg(feature = "ros")]
#[derive(Debug, Error)]
pub(crate) enum SampleError {
    #[error("it is cut off")]
    CutOff,
    #[error(transparent)]
    Unreadable(#[from] ros_messages::cdr::Unreadable),
    #[cfg(feature = "zenoh")]
    #[error("it is empty")]
    Empty,
    #[cfg(feature = "zenoh")]
    #[error("{0} bytes are too many")]
    TooLong(usize),
    #[cfg(feature = "zenoh")]
    #[error("{0} bytes are no message")]
    TooShort(usize),
    #[cfg(feature = "zenoh")]
    #[error("its encoding {0:02x?} is not CDR")]
    NotCdr([u8; 4]),
    #[cfg(feature = "zenoh")]
    #[error("it has no number and no {0} attached, as rmw_zenoh attaches them")]
    NotAttached(&'static str),
    #[cfg(feature = "zenoh")]
    #[error("{0}")]
    Zenoh(#[from] zenoh::Error),
}
