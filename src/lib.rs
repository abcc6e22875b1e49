//! Vehicle-signal gateway for Autoware: CAN turn-signal and hazard frames in, ROS 2 status and
//! diagnostics out.
//!
//! The map of the crate, downhill (a module imports only from those below it):
//!
//! | module | what it is |
//! |---|---|
//! | [`cli`] | the command line: one definition makes help, man page and completions |
//! | [`daemon`] | `run` and `demo`: the gateway between its edges, in one loop |
//! | [`check`], [`decode`] | the two other desk tools |
//! | [`live`] | the gateway on live inputs, step by step as a replay of them would go |
//! | [`replay`] | the gateway over a recording, on virtual time |
//! | [`view`], [`timeline`] | what comes out, for people and programs |
//! | [`vehicle_timeline`] | what a simulated vehicle does, for people and programs |
//! | [`explanation`] | a turn-signal decision as JSON |
//! | [`publisher`] | the way to ROS 2, if there is one |
//! | [`config`] | what the TOML files say, checked against the DBCs |
//! | [`io`] | edges; each file touches one outside thing |
//! | [`core`] | decides; touches no socket, file, clock or log |
//!
//! `ARCHITECTURE.md` tells the story; `tests/pure/layering.rs` keeps the imports running downhill.

pub mod check;
pub mod cli;
pub mod config;
pub mod core;
pub mod daemon;
pub mod decode;
pub mod drive;
pub mod explanation;
pub mod io;
pub mod lights_timeline;
pub mod live;
pub mod picture;
pub mod publisher;
pub mod replay;
pub mod timeline;
pub mod vehicle_timeline;
pub mod view;
