//! Calls of a live gateway. A recording stores them next to the received data, so that a replay can repeat
//! the same calls and the gateway makes the same decisions at the same times.

use crate::command::input::CommandInput;
use crate::command::origin::{CommandOrigin, SampleId};
use crate::command::sender::SendFailure;
use crate::gateway::event::Input;
use can_signal::can::{BusIndex, LinkState, LogNote};
use gateway_base::time::Now;

/// A call, without its frames and samples, which are recorded as separate messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GatewayCall {
    /// The gateway starts with these link states, one for each bus.
    Start(Vec<LinkState>),
    /// This many bus inputs were read together; they follow as frames and notes.
    Read(u32),
    /// An input of a bus that is not a frame.
    Note(BusIndex, LogNote),
    /// A ROS 2 sample was read; it follows.
    Sample(SampleId),
    /// Everything that is due is handled.
    Look,
    /// The last output frame was sent.
    Sent,
    /// The last output frame could not be sent.
    SendFailed(SendFailure),
    /// The configuration was reloaded.
    Reconfigure,
    /// The gateway is about to stop.
    Stop,
}

/// A call with its time on the gateway's clocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimedCall {
    /// Position among all calls since the start, from 1. A gap indicates calls that were not recorded.
    pub number: u64,
    /// Time of the call on both clocks.
    pub at: Now,
    /// The call at that time.
    pub call: GatewayCall,
}

impl GatewayCall {
    /// Returns the call that records the result of sending a frame; `None` for other inputs of the commands.
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

    /// Returns the call that precedes a sample.
    pub fn of_sample(input: &Input) -> Self {
        let sample = if let Input::Command(
            CommandInput::Turn { origin: CommandOrigin::Topic(sample), .. }
            | CommandInput::Hazard { origin: CommandOrigin::Topic(sample), .. }
            | CommandInput::ControlMode { sample, .. },
        ) = input
        {
            *sample
        } else {
            SampleId::default()
        };
        Self::Sample(sample)
    }
}
