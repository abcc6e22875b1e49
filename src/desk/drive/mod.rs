//! A drive scenario on virtual time: the inputs of a vehicle and its planner at each cycle, what the
//! decider makes of them, and whether that is what was expected.
//!
//! | file | what it is |
//! |---|---|
//! | [`course`] | the drive cycle by cycle: pose, speed, path, manoeuvres, clock |
//! | [`route_path`] | positions along the middle of the lanelets, to places on the map |
//! | `motion` | speed and stops: where the vehicle is next |
//! | `planner` | the manoeuvres as the planner publishes them |
//! | [`run`] | the decider in one behaviour, cycle by cycle |
//! | [`verdict`] | expectations met and failed |

pub mod course;
mod motion;
mod planner;
pub mod route_path;
pub mod run;
pub mod verdict;
