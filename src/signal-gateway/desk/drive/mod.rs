//! A drive scenario on virtual time: the inputs of a vehicle and its planner at each cycle, the decider's
//! decisions, and their comparison with the expectations.

mod motion;
mod planner;
pub(crate) mod recorded;
pub mod route_path;
pub mod run;
pub mod simulation;
pub(crate) mod survey;
pub mod verdict;
