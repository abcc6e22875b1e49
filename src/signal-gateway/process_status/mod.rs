//! Statuses of the process, its configuration, files, log and network side, and what a snapshot has of them.
//! The gateway learns of none of them, and a replay has none.

pub mod catalogue;
pub mod configuration;
pub mod confinement;
pub mod log;
pub mod network;
pub mod recordings;
pub mod snapshot;

/// Tasks of the statuses of the process, which the daemon adds to the statuses of the gateway.
pub const PROCESS_TASKS: [&str; 5] = ["black_box", "configuration", "mcap", "log", "ros"];
