//! Configuration: from TOML files to settings.
//!
//! [`load`] reads one gateway file and the vehicle profile and DBCs it names, checks everything, and returns
//! [`Settings`] or every problem.
//!
//! | room | contents |
//! |---|---|
//! | [`gateway`] | `gateway.toml`, a file for each section |
//! | `vehicle` | vehicle profiles, a file for each section, bound to the DBCs |
//! | [`scenario`] | scenarios of traffic lights: OpenSCENARIO and the bench form |
//! | [`drive`] | drives of the turn signal decider |
//! | `map` | the lanelet2 maps that sections and drives name |
//! | [`draft`] | new files: a configuration, the DBC and profile of a discovered vehicle |
//! | [`country`], `dimensions` | rules of countries, dimensions of vehicles |
//! | [`built_in`] | files in the binary by name |
//! | [`car_models`] | the list of makes, models and years with their profiles |
//! | [`fingerprints`] | the public lists of identifiers by which a bus shows its platform |
//! | `named_file` | files by path, or by the name of a built-in one |
//! | [`file_kind`] | kinds of files, recognised by their content |
//! | [`ros_names`], [`ros_parameters`] | names of ROS 2 and remapping, files of parameters |
//! | [`files`] | sources of files: the disk, or the binary itself |
//! | `reading` | TOML, YAML and XML as values with their locations, and the problems found in them |

pub mod built_in;
pub mod car_models;
pub mod country;
mod decider;
mod dimensions;
pub mod draft;
pub mod drive;
pub mod file_kind;
pub mod files;
pub mod fingerprints;
pub mod gateway;
pub mod map;
mod named_file;
mod reading;
pub mod ros_names;
pub mod ros_parameters;
pub mod scenario;
mod vehicle;

pub use gateway::{Overrides, Settings, interface_name, load, load_profile, load_profile_for_node};
pub use map::{MapLights, find_map, read_lane_network, read_lights};
pub use reading::key::{KeyEffect, KeyRow, ValueShape, description};
pub use reading::location::SourceLocation;
pub use reading::problem::{MissingTimeout, Position, Problem, Refusal, Refused};
