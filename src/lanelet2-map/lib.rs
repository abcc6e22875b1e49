//! The road as a lanelet2 map describes it, and the geometry of the whole project.
//!
//! [`osm`] reads primitives, [`points`] gives them coordinates, [`lane_network`] and [`light_map`] make
//! lanelets and traffic lights of them, [`tag_check`] finds what is wrong with the lanelets.
//!
//! ```
//! use lanelet2_map::geometry::{Point, Pose};
//! use lanelet2_map::lane_network::{LaneNetwork, Lanelet};
//!
//! let lane = |id, x_m, followers| {
//!     let centerline = vec![Point::new(x_m, 0.0), Point::new(x_m + 50.0, 0.0)];
//!     Lanelet { id, centerline, followers, ..Lanelet::default() }
//! };
//! let road = LaneNetwork::new([lane(1, 0.0, vec![2]), lane(2, 50.0, vec![])], Vec::new());
//! assert_eq!(road.shortest_way(1, 2), Some(vec![1, 2]));
//! assert_eq!(road.closest([1, 2], Pose::new(80.0, 1.0, 0.0)).unwrap().id, 2);
//! ```
//!
//! It stands on `gateway_base`; `turn_signal` and `traffic_lights` stand on it.

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
