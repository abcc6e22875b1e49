//! Configuration: what the TOML files say, and what that means.
//!
//! [`load`] reads one gateway file and the vehicle profile and DBCs it names, checks all of it,
//! and gives [`Settings`] or every reason why not.

pub mod command;
pub mod command_file;
mod command_message;
mod command_profile;
pub mod command_profile_file;
pub mod country;
pub mod drive;
pub mod file;
pub mod files;
mod hazard;
mod integrity;
pub mod integrity_file;
mod lights;
mod messages;
pub mod problem;
mod roles;
pub mod scenario;
mod sections;
pub mod settings;
pub mod traffic_lights;
pub mod traffic_lights_file;
mod turn;
pub mod turn_signal;
pub mod turn_signal_file;
mod v2i;
pub mod v2i_file;
mod values;
pub mod vehicle;
pub mod vehicle_file;

pub use settings::{Overrides, Settings, load, load_profile};
