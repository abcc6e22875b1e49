//! Brings the gateway to an unknown car: finds its signals, tells which profile fits it, and simulates one.
//!
//! - [`discovery`]: the signals of turn indicators and hazard lights of a vehicle that no DBC describes;
//! - [`plausibility`]: whether frames fit a profile;
//! - [`simulated_vehicle`]: a vehicle at the other end of the bus, for tests of the gateway;
//! - [`car_model`]: the car that a name in words means.
//!
//! ```
//! use vehicle_bringup::car_model::{CarModel, ModelProfile, ModelVerdict, find};
//!
//! let profile = ModelProfile::Shipped { profile: "vw_mqb".to_owned(), plug: None };
//! let golf = CarModel {
//!     make: "Volkswagen".to_owned(),
//!     model: "Golf".to_owned(),
//!     years: vec![(2015, 2020)],
//!     profile,
//!     note: None,
//!     unproven_dimensions: None,
//! };
//! let models = [golf];
//! let found = find(&models, "vw gulf 2018");
//! assert_eq!((found.verdict, found.profiles()), (ModelVerdict::Supported, vec!["vw_mqb"]));
//! ```
//!
//! It stands on `gateway_core`, whose loop cannot name it.

pub mod car_model;
pub mod discovery;
pub mod plausibility;
pub mod simulated_vehicle;
