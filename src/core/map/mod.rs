//! The road as a lanelet2 map describes it; shared by the flows.

pub mod error;
pub mod light_map;
pub mod light_roads;
pub mod osm;
pub mod points;
