//! A drive scenario on virtual time: the inputs of a vehicle and its planner at each cycle, the decider's
//! decisions, and their comparison with the expectations.
//!
//! | file | what it is |
//! |---|---|
//! | [`simulation`] | the drive cycle by cycle: pose, speed, path, manoeuvres, clock |
//! | [`route_path`] | positions along the middle of the lanelets, to points of the map |
//! | `motion` | speed and stops: the next position of the vehicle |
//! | `planner` | the manoeuvres as the planner publishes them |
//! | [`run`] | the decider with one `compat`, cycle by cycle |
//! | [`recorded`] | the decider over the messages of a recorded drive |
//! | [`survey`] | many drives over a map, and the turns whose signals are wrong |
//! | [`verdict`] | expectations met and failed |

mod motion;
mod planner;
pub mod recorded;
pub mod route_path;
pub mod run;
pub mod simulation;
pub mod survey;
pub mod verdict;
