//! Configuration: what the TOML files say, and what that means.
//!
//! [`load`] reads one gateway file and the vehicle profile and DBCs it names, checks all of it,
//! and gives [`Settings`] or every reason why not.
//!
//! | room | what it reads |
//! |---|---|
//! | [`gateway`] | `gateway.toml`: a file for each section with its shape, its check and its settings |
//! | `vehicle` | a vehicle profile: likewise, bound to the DBCs |
//! | [`scenario`] | scenarios of traffic lights: OpenSCENARIO and the bench form |
//! | [`drive`] | drives of the turn signal decider |
//! | `map` | the lanelet2 maps that sections and drives name |
//! | [`country`] | rules of countries |
//! | [`files`] | where files come from: the disk, or the binary itself |
//! | `reading` | TOML, YAML and XML with the place of everything, and the problems found in them |

pub mod country;
pub mod drive;
pub mod files;
pub mod gateway;
mod map;
mod reading;
pub mod scenario;
mod vehicle;

pub use gateway::{Overrides, Settings, load, load_profile};
pub use map::read_lights;
pub use reading::problem::{Problem, Refused};
