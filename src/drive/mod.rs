//! A drive scenario on virtual time: what a vehicle and its planner would say at each cycle, what the
//! decider makes of it, and whether that is what was expected.
//!
//! | file | what it is |
//! |---|---|
//! | [`course`] | the drive cycle by cycle: pose, speed, path, manoeuvres, clock |
//! | [`way`] | positions along the middle of the lanelets, to places on the map |
//! | `motion` | speed and stops: where the vehicle is next |
//! | `planner` | the manoeuvres as the planner tells them |
//! | [`run`] | the decider in one behaviour, cycle by cycle |
//! | [`verdict`] | expectations met and failed |
//! | [`text`] | lines for people |
//! | [`json`] | lines for programs |

pub mod course;
pub mod json;
mod motion;
mod planner;
pub mod run;
pub mod text;
pub mod verdict;
pub mod way;
mod words;
