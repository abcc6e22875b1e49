//! The calls of a live gateway, as a recording keeps them beside what was received: with both, a replay makes
//! the same calls again, and the gateway decides the same at the same times.

use crate::command::input::CommandInput;
use crate::command::origin::{CommandOrigin, SampleId};
use crate::command::sender::SendFailure;
use crate::gateway::event::Input;
use can_signal::can::{BusIndex, LinkState, LogNote};
use gateway_base::time::Now;

/// A call, but for the frames and samples themselves, which have messages of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GatewayCall {
    /// The gateway starts with these links, one for each bus.
    Start(Vec<LinkState>),
    /// So many inputs of the buses were read together; they follow, as frames and notes.
    Read(u32),
    /// An input of a bus for which there is no frame.
    Note(BusIndex, LogNote),
    /// A sample of ROS 2 was read; it follows.
    Sample(SampleId),
    /// What is due is handled.
    Look,
    /// The frame that was given out last was sent.
    Sent,
    /// The frame that was given out last could not be sent.
    SendFailed(SendFailure),
    /// The configuration was read again.
    Reconfigure,
    /// The gateway is about to stop.
    Stop,
}

/// A call with its time, as the gateway's clocks had it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimedCall {
    /// Position among all calls since the start, from 1. A gap tells of calls that were not recorded.
    pub number: u64,
    /// When it was made.
    pub at: Now,
    /// The call.
    pub call: GatewayCall,
}

impl GatewayCall {
    /// Returns the call that tells the result of sending a frame; `None` for another input of the commands.
    pub fn of_result(result: &CommandInput) -> Option<Self> {
        match result {
            CommandInput::Sent(_) => Some(Self::Sent),
            CommandInput::SendFailed { failure, .. } => Some(Self::SendFailed(*failure)),
            CommandInput::Turn { .. }
            | CommandInput::Hazard { .. }
            | CommandInput::ControlMode { .. }
            | CommandInput::Stop => None,
        }
    }

    /// Returns the call that comes before a sample.
    pub fn of_sample(input: &Input) -> Self {
        let id = match input {
            Input::Command(
                CommandInput::Turn { origin: CommandOrigin::Topic(sample), .. }
                | CommandInput::Hazard { origin: CommandOrigin::Topic(sample), .. }
                | CommandInput::ControlMode { sample, .. },
            ) => *sample,
            Input::Command(_) | Input::Can(_) | Input::TrafficLight(_) | Input::Planner(_) | Input::Tick => {
                SampleId::default()
            }
        };
        Self::Sample(id)
    }
}
