//! Statuses of the process (configuration, files, log and network side), and their part of a snapshot. They
//! are unknown to the gateway, and absent in a replay.

pub mod catalogue;
pub mod configuration;
pub mod confinement;
pub mod log;
pub mod network;
pub mod recordings;
pub mod snapshot;

/// Tasks of the statuses of the process, which the daemon adds to the statuses of the gateway.
pub const PROCESS_TASKS: [&str; 5] = ["black_box", "configuration", "mcap", "log", "ros"];
