//! Which turn signal a route requires, and why.
//!
//! [`decider::Decider`] knows the sections of the road in which each manoeuvre must or may be signalled, and
//! chooses between them by one rule (docs/spec/turn-signal-decider.md). [`flow`] feeds it with the messages
//! of a planner, and [`signal_judge`] compares its decisions with another planner's signals.
//!
//! ```
//! use gateway_base::time::MonoTime;
//! use turn_signal::compat::DeciderCompat;
//! use turn_signal::decider::{Decider, DeciderSettings};
//! use turn_signal::inputs::{InputFinding, Inputs};
//! use turn_signal::light_command::TurnCommand;
//!
//! let mut decider = Decider::new(DeciderSettings::deployed(DeciderCompat::Improved));
//! let nothing = Inputs {
//!     odometry: None,
//!     road: None,
//!     route: None,
//!     planned_path: None,
//!     manoeuvres: &[],
//!     lane_driving: true,
//! };
//! let decision = decider.decide(&nothing, MonoTime::ZERO);
//! assert_eq!(decision.turn, TurnCommand::NoCommand);
//! assert_eq!(decision.findings, [InputFinding::NoOdometry]);
//! ```
//!
//! The map is read by `lanelet2_map`. This crate knows neither CAN nor traffic lights; `gateway_core`
//! converts its decisions to commands.

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
pub mod light_command;
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
