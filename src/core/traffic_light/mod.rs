//! Traffic lights: ground truth and detections over two channels, merged and sent
//! (docs/spec/traffic-lights.md).
//!
//! Vocabulary: a *bulb* is one lamp as it looks; a *head* is a physical light, known by its way id;
//! a *group* is a regulatory element that refers to heads, known by its relation id; a *channel* is
//! the equipment a state comes over; each channel has a *ground truth* and a *detected* store.

pub mod arbiter;
pub mod architecture;
pub mod bulb;
mod bulb_counts;
mod change_log;
pub mod command;
mod controller;
pub mod emission;
pub mod engine;
pub mod event_log;
mod expiry;
pub mod faults;
pub mod flow;
mod incremental_update;
pub mod input;
mod message_builder;
mod outbox;
pub mod output;
pub mod periodic_timer;
mod prediction;
pub mod quirks;
pub mod refusal;
pub mod scenario;
mod scenario_state;
pub mod signal_id;
pub mod state_check;
mod status;
pub mod store;
mod storyboard;
mod sync;
pub mod target;
pub mod text;
mod trigger;
pub mod v2i_reception;
