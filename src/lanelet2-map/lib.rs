//! The road as described by a lanelet2 map, and the geometry of the whole project.
//!
//! [`osm`] reads primitives, [`points`] adds coordinates, [`lane_network`] and [`light_map`] build lanelets
//! and traffic lights from them, and [`tag_check`] finds faulty tags of lanelets.
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
//! It uses `gateway_base`; `turn_signal` and `traffic_lights` use it.

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
