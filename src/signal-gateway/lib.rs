//! Vehicle-signal gateway for Autoware: CAN turn-signal and hazard frames in, ROS 2 status and
//! diagnostics out.
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
