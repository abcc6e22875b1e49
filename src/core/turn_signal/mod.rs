//! The turn signal decider: sections of the road in which each manoeuvre must or may be signalled, and one
//! rule that chooses between them (docs/spec/turn-signal-decider.md).

pub mod catalogue;
pub mod chain;
pub mod compat;
pub mod country;
pub mod decider;
pub mod decision;
pub mod decision_context;
pub mod distance_path;
pub mod factors;
pub mod finished;
pub mod flow;
pub mod headline;
pub mod inputs;
pub mod intersection;
pub mod junction;
pub mod manoeuvre;
pub mod min_duration;
pub mod output;
pub mod parameters;
pub mod path_generator;
pub mod planner_input;
pub mod resolve;
pub mod roundabout;
pub mod route;
pub mod section;
pub mod shift;
pub mod side;
pub mod signal_judge;
pub mod subject;
pub mod turn_lane;
pub mod vehicle_state;
