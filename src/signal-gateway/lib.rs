//! Vehicle-signal gateway for Autoware: CAN turn-signal and hazard frames in, ROS 2 status and
//! diagnostics out.
//!
//! The map of the crate, downhill (a module imports only from those below it):
//!
//! | module | what it is |
//! |---|---|
//! | [`cli`] | the command line: one definition makes help, man page and completions |
//! | [`daemon`] | `run` and `demo`: the gateway between its edges, in one loop |
//! | [`check`] | checks a configuration, frames and recordings |
//! | [`replay`] | the gateway over a recording, on virtual time |
//! | [`desk`] | scenarios, drives and simulated vehicles, on virtual time |
//! | [`report`] | results as text, JSON and charts |
//! | [`config`] | the TOML files, checked against the DBCs |
//! | [`io`] | edges; each file touches one outside thing |
//! | [`process_status`] | statuses of the process, and what a snapshot has of it |
//!
//! `ARCHITECTURE.md` tells the story; `tests/pure/layering.rs` keeps the imports running downhill.

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
