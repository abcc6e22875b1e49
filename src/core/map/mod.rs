//! The road as a lanelet2 map describes it; shared by the flows.

pub mod light_map;
