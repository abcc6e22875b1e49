//! Traffic lights: what is true and what is seen, over two channels, merged and sent
//! (specification: traffic-lights).
//!
//! Vocabulary: a *bulb* is one lamp as it looks; a *head* is a physical light, known by its way id;
//! a *group* is a regulatory element that refers to heads, known by its relation id; a *channel* is
//! the equipment a state comes over; each channel has a *ground truth* and a *detected* store.

pub mod arbiter;
pub mod architecture;
pub mod bulb;
pub mod cadence;
pub mod command;
pub mod compat;
mod controller;
pub mod emission;
pub mod engine;
mod expiry;
pub mod faults;
pub mod flow;
mod journal;
mod merge;
pub mod note;
mod outbox;
mod prediction;
pub mod refusal;
mod renewal;
pub mod scenario;
pub mod signal_id;
mod stage;
pub mod state_check;
mod status;
pub mod store;
mod storyboard;
mod sync;
mod tally;
pub mod target;
pub mod text;
mod trigger;
pub mod unknown_ids;
pub mod v2i_reception;
