//! The pure core: frames and times in, reports and findings out.
//!
//! Nothing here opens, reads, waits, logs or looks at a clock. Time is an argument, the next
//! deadline is a value, and the same inputs give the same outputs byte for byte.

pub mod can;
pub mod car_model;
pub mod command;
pub mod compat;
pub mod control_mode;
pub mod dbc;
pub mod diagnostics;
pub mod discovery;
pub mod gateway;
pub mod light_command;
pub mod map;
pub mod names;
pub mod near_miss;
pub mod plausibility;
pub mod provenance;
pub mod simulated_vehicle;
pub mod time;
pub mod traffic_light;
pub mod turn_signal;
pub mod validation;
pub mod vehicle_lights;
pub mod vehicle_report;
pub mod vehicle_status;
