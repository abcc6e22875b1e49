//! Adapts the gateway to an unknown car: finds its signals, checks which profile fits it, and simulates a
//! vehicle.
//!
//! - [`discovery`]: finds the signals of turn indicators and hazard lights of a vehicle that no DBC
//!   describes;
//! - [`plausibility`]: checks whether frames fit a profile;
//! - [`simulated_vehicle`]: simulates a vehicle at the other end of the bus, for tests of the gateway;
//! - [`car_model`]: finds the car that a name refers to.
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
//! It depends on `gateway_core`, which does not depend on it.

pub mod car_model;
pub mod discovery;
pub mod plausibility;
pub mod simulated_vehicle;
