//! A drive scenario on virtual time: what a vehicle and its planner would say at each cycle, what the
//! decider makes of it, and whether that is what was expected.
//!
//! | file | what it is |
//! |---|---|
//! | [`course`] | the drive cycle by cycle: pose, speed, path, manoeuvres, clock |
//! | [`route_path`] | positions along the middle of the lanelets, to places on the map |
//! | `motion` | speed and stops: where the vehicle is next |
//! | `planner` | the manoeuvres as the planner tells them |
//! | [`run`] | the decider in one behaviour, cycle by cycle |
//! | [`verdict`] | expectations met and failed |
//! | [`text`] | lines for people |
//! | [`json`] | lines for programs |
//! | [`chart`] | the drive as a picture: sections and signals over the way |

pub mod chart;
pub mod course;
mod display;
pub mod json;
mod motion;
mod planner;
pub mod route_path;
pub mod run;
pub mod text;
pub mod verdict;
