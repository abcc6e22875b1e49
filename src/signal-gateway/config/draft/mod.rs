//! New configuration files as text: a commented `gateway.toml`, and the DBC and profile of a discovered
//! vehicle.

mod dbc;
mod files;
mod gateway;
mod profile;
mod vehicle;

pub use files::VehicleFiles;
pub(crate) use gateway::key as toml_key;
pub use gateway::{BusInterface, DimensionsDraft, DraftCar, gateway_toml};
pub use vehicle::VehicleDraft;
