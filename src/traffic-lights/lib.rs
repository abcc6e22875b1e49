//! Traffic lights: ground truth and detections over two channels, merged and sent
//! (docs/spec/traffic-lights.md).
//!
//! Vocabulary: a *bulb* is the colour, status and shape of one lamp; a *head* is a physical light, with the
//! id of its way; a *group* is a regulatory element that refers to heads, with the id of its relation; a
//! *channel* is the equipment over which a state is received; each channel has a *ground truth* and a
//! *detected* store.
//!
//! ```
//! use std::sync::Arc;
//!
//! use gateway_base::time::{MonoTime, Now, WallStamp};
//! use lanelet2_map::light_map::{GroupEntry, LightMap};
//! use traffic_lights::command::parse_command;
//! use traffic_lights::compat::Compat;
//! use traffic_lights::engine::{LightsSettings, TrafficLights};
//! use traffic_lights::scenario::Scenario;
//! use traffic_lights::target::StoreId;
//!
//! let map = Arc::new(LightMap::new([], &[GroupEntry::new(100, [11, 12])]));
//! let now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
//! let settings = LightsSettings::new(map, Scenario::default(), Compat::Improved);
//! let mut lights = TrafficLights::new(settings, now);
//! let action = parse_command("TrafficSignalStateAction(100, red)", lights.controllers(), Compat::Improved)?;
//! lights.apply(&action, now)?;
//! assert_eq!(lights.states(StoreId::CONVENTIONAL)[&11].bulbs.to_string(), "red solidOn circle");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `lanelet2_map` reads the lights of a map. This crate knows neither CAN nor the vehicle and its turn
//! signals: `gateway_core` runs it next to them, and passes it the states of a V2X unit.

pub mod arbiter;
pub mod architecture;
pub mod bulb;
mod bulb_counts;
pub mod catalogue;
mod change_log;
pub mod command;
pub mod compat;
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
pub mod variable;
