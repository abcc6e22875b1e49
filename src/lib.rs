//! Vehicle-signal gateway for Autoware: CAN turn-signal and hazard frames in, ROS 2 status and
//! diagnostics out.
//!
//! The map of the crate, downhill (a module imports only from those below it):
//!
//! | module | what it is |
//! |---|---|
//! | [`core`] | decides; touches no socket, file, clock or log |
//! | [`io`] | edges; each file touches one outside thing |
//!
//! `ARCHITECTURE.md` tells the story; `tests/layering.rs` keeps the imports running downhill.

pub mod core;
pub mod io;
