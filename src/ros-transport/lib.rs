//! The network side of a ROS 2 node: joins DDS or Zenoh on behalf of the gateway, to which it is connected by
//! a link.
//!
//! It is vulnerable to the network, since RustDDS trusts what it receives: a single packet can make it
//! allocate without bound, or hang. So it runs in a separate process ([`process`]), confined by the kernel,
//! which has no access to CAN and may die at any time; its gateway replaces it. It may also run in a thread
//! of the gateway, for debuggers and tests.
//!
//! The [`link`] is its only interface. The first message contains the settings, including the topics;
//! after that, orders go one way, and samples and statuses the other.
//!
//! ```
//! use ros_transport::link::FromNetwork;
//!
//! let pong = FromNetwork::Pong { number: 7, has_echo: true, is_heard: false };
//! let mut bytes = Vec::new();
//! pong.encode(&mut bytes);
//! assert_eq!(FromNetwork::decode(&bytes), Ok(pong));
//! assert!(FromNetwork::decode(&bytes[1..]).is_err());
//! ```
//!
//! Cargo features choose the engines: DDS with the graph of `jazzy` or `humble`, and additionally `zenoh`.
//! Without any of them the interface remains, and joining a network fails ([`IS_BUILT_IN`]).
//!
//! It uses `gateway_base` for stamps and `ros_messages` for the services of the node. The session that
//! starts, monitors and replaces it is in the program (`io::ros::session`).

#[cfg(not(feature = "ros"))]
mod absent;
#[cfg(feature = "ros")]
mod confinement;
#[cfg(feature = "ros")]
mod dds;
mod distribution;
mod error;
pub mod link;
pub mod names;
#[cfg(feature = "ros")]
mod orders;
pub mod parameters;
#[cfg(feature = "ros")]
pub mod process;
#[cfg(feature = "ros")]
mod processor_wait;
pub mod qos;
pub mod rebuild_cause;
#[cfg(feature = "ros")]
mod serving;
pub mod settings;
pub mod survey;
#[cfg(feature = "ros")]
mod wakeup;
#[cfg(feature = "ros")]
mod wall_clock;
#[cfg(feature = "zenoh")]
mod zenoh;
pub mod zenoh_config;

#[cfg(not(feature = "ros"))]
pub use absent::{process, serve, survey as survey_domain, system_call_name};
#[cfg(feature = "ros")]
pub use confinement::system_call_name;
#[cfg(feature = "ros")]
pub use dds::survey as survey_domain;
pub use distribution::{DISTRO, identifier_length};
pub use error::TransportError;
#[cfg(feature = "ros")]
pub use serving::serve;

/// True if a network side is built in.
pub const IS_BUILT_IN: bool = cfg!(feature = "ros");
/// Exit code of a network process that had a panic in one of its threads.
pub const PANICKED: i32 = 101;

#[cfg(test)]
#[allow(dead_code)] // the tests of the programs use more of it
#[path = "../../tests/support/waiting.rs"]
mod waiting;
