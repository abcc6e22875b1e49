//! The pure core: frames and times in, reports and findings out.
//!
//! Nothing here opens, reads, waits, logs or looks at a clock. Time is an argument, the next
//! deadline is a value, and the same inputs give the same outputs byte for byte.

pub mod black_box;
pub mod bus;
mod bus_status;
pub mod command;
pub mod controller;
pub mod dbc;
pub mod diagnostics;
pub mod error_frame;
pub mod event;
pub mod frame;
pub mod gateway;
pub mod live_time;
pub mod map;
pub mod note;
pub mod simulated_vehicle;
pub mod time;
pub mod traffic_light;
pub mod trust;
pub mod turn_signal;
pub mod vehicle_lights;
