//! The road as a lanelet2 map describes it, and the geometry of the whole project; shared by the flows.
//!
//! [`osm`] reads primitives, [`points`] gives them coordinates, [`lane_network`] and [`light_map`] make lanelets and traffic
//! lights of them, [`tag_check`] finds what is wrong with the lanelets.

pub mod error;
pub mod fork;
pub mod geometry;
pub mod lane_network;
pub mod light_map;
pub mod osm;
pub mod points;
mod projection;
pub mod projector;
pub mod tag_check;
