//! The gateway without I/O: vehicle lights, vehicle status, commands, and the machine that joins all flows.
//!
//! - [`vehicle_lights`], [`vehicle_status`]: reports from bound frames; [`vehicle_report`] is their common
//!   part;
//! - [`v2i_reception`]: traffic-light states from the frames of a V2X unit;
//! - [`command`]: turn and hazard commands, from sender to frame;
//! - [`gateway`]: all flows behind one interface, each on its own clock. It accepts frames and messages with
//!   their times, and returns outputs and the next deadline. The same inputs give the same outputs, byte for
//!   byte.
//!
//! Path of an Autoware command, from its message to the request to the vehicle:
//!
//! ```
//! use std::time::Duration;
//!
//! use gateway_base::time::{MonoTime, Now, WallStamp};
//! use gateway_core::command::arbitration::{ArbitrationRules, DecisionReason};
//! use gateway_core::command::feedback_monitor::FeedbackLimits;
//! use gateway_core::command::flow::CommandFlow;
//! use gateway_core::command::input::CommandInput;
//! use gateway_core::command::origin::{CommandOrigin, SampleId};
//! use gateway_core::command::settings::{
//!     CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit,
//! };
//! use turn_signal::light_command::{EnumOrUnknown, TurnCommand};
//!
//! let second = Duration::from_secs(1);
//! let settings = CommandSettings {
//!     source: CommandSource::Topic,
//!     transmit: Transmit::On,
//!     mode_from: ModeFrom::Topic { timeout: second },
//!     turn_timeout: second,
//!     hazard_timeout: second,
//!     rules: ArbitrationRules::default(),
//!     limits: FeedbackLimits { warn: second, error: second },
//! };
//! let stamp = WallStamp::from_nanos(1);
//! let now = Now { mono: MonoTime::ZERO, wall: stamp };
//! let mut flow = CommandFlow::new(settings, CommandBinding::default(), now);
//! let origin = CommandOrigin::Topic(SampleId::default());
//! let command = EnumOrUnknown::Known(TurnCommand::Left);
//! flow.handle_input(CommandInput::Turn { origin, command, stamp }, now);
//! flow.settle(&[], now);
//! assert_eq!(flow.decision().turn, DecisionReason::NotGranted);
//! assert_eq!(flow.poll_output(), None);
//! ```
//!
//! The decider (`turn_signal`) and the traffic lights (`traffic_lights`) are separate crates that depend
//! neither on each other nor on the vehicle; this crate joins them.

pub mod command;
pub mod control_mode;
pub mod gateway;
pub mod provenance;
pub mod v2i_reception;
pub mod vehicle_lights;
pub mod vehicle_report;
pub mod vehicle_status;
