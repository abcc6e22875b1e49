//! The road as a lanelet2 map describes it; shared by the flows.
//!
//! [`osm`] reads primitives, [`points`] places them, [`road_map`] makes a map of them.

pub mod error;
mod index;
pub mod lanelet;
pub mod light_map;
pub mod light_roads;
pub mod osm;
pub mod points;
pub mod polyline;
mod projection;
pub mod projector;
pub mod road_map;
mod topology;
