//! Vehicle-signal gateway for Autoware: velocity, steering, gear, control mode, doors and lights of the
//! vehicle, from CAN to ROS 2, with diagnostics; commands for the lights, from ROS 2 to CAN.
//!
//! `ARCHITECTURE.md` has the map of the modules; `tests/pure/layering.rs` keeps the imports running downhill.

pub mod check;
pub mod cli;
pub mod config;
pub mod daemon;
pub mod desk;
pub mod io;
pub mod process_status;
pub mod replay;
pub mod report;

#[cfg(test)]
#[allow(dead_code)] // the tests of the programs use more of it
#[path = "../../tests/support/waiting.rs"]
mod waiting;
