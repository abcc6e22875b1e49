//! Traffic lights: ground truth and detections over two channels, merged and sent
//! (docs/spec/traffic-lights.md).
//!
//! Vocabulary: a *bulb* is the colour, status and shape of one lamp; a *head* is a physical light, with the id of
//! its way; a *group* is a regulatory element that refers to heads, with the id of its relation; a *channel* is
//! the equipment over which a state is received; each channel has a *ground truth* and a *detected* store.

pub mod arbiter;
pub mod architecture;
pub mod bulb;
mod bulb_counts;
pub mod catalogue;
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
pub mod received;
pub mod refusal;
pub mod scenario;
mod scenario_state;
pub mod signal_id;
mod simulated_clock;
pub mod snapshot;
pub mod state_check;
mod state_inputs;
mod status;
pub mod store;
mod storyboard;
mod sync;
pub mod target;
pub mod text;
mod trigger;
pub mod v2i_reception;
mod v2i_status;
pub mod variable;
