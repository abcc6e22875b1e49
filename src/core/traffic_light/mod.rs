//! Traffic lights: what is true and what is seen, over two channels, merged and sent
//! (specification: traffic-lights).
//!
//! Vocabulary: a *bulb* is one lamp as it looks; a *head* is a physical light, known by its way id;
//! a *group* is a regulatory element that refers to heads, known by its relation id; a *channel* is
//! the equipment a state comes over; each channel has a *ground truth* and a *detected* store.

pub mod bulb;
pub mod command;
pub mod compat;
pub mod emission;
pub mod scenario;
pub mod signal_id;
pub mod state_check;
pub mod target;
pub mod text;
pub mod v2i_reception;
