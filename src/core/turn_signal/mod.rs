//! Which turn signal a manoeuvre wants: sections of the road where each must or may be signalled, and
//! one rule that chooses between them (turn-signal-decider).

pub mod chain;
pub mod country;
pub mod decider;
pub mod decision;
pub mod distance_path;
pub mod finished;
pub mod geometry;
pub mod inputs;
pub mod intersection;
pub mod manoeuvre;
pub mod parameters;
pub mod path_generator;
pub mod resolve;
pub mod road;
pub mod roundabout;
pub mod route;
pub mod scene;
pub mod section;
pub mod shift;
pub mod signal;
pub mod steady;
pub mod told;
pub mod turn_lane;
