//! Simulated vehicle for tests of the gateway. It sends the messages that a vehicle profile binds and
//! obeys the commands that the profile describes. Driver actions and faults are requested.
//!
//! It is the other end of the bus and uses the profile in the opposite direction: it encodes meanings as
//! raw values and decodes command frames. Nothing here evaluates a real vehicle.

mod driver;
mod encoder;
mod faults;
mod flasher;
mod measured;
mod missing_signal;
pub mod motion;
mod output;
pub mod plan;
mod receiver;
pub mod request;
mod status_plan;
mod transmission;
mod vehicle;

pub use output::{VehicleEvent, VehicleOutput, Who};
pub use vehicle::{SimulatedVehicle, SimulationSettings};
