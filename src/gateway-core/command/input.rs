//! Inputs of the command machine: commands, control mode, and results of sending.

use super::allow_list::CommandFrame;
use super::origin::{CommandOrigin, SampleId};
use super::sender::SendFailure;
use crate::control_mode::ControlMode;
use gateway_base::time::WallStamp;
use turn_signal::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};

/// One input of the command machine. Commands and modes may have a number that the message definition lacks;
/// stamps are by the sender's clock, which may differ from this host's.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum CommandInput {
    /// `TurnIndicatorsCommand` for the vehicle.
    Turn { origin: CommandOrigin, command: EnumOrUnknown<TurnCommand>, stamp: WallStamp },
    /// `HazardLightsCommand` for the vehicle.
    Hazard { origin: CommandOrigin, command: EnumOrUnknown<HazardCommand>, stamp: WallStamp },
    /// `ControlModeReport` of the vehicle: who drives it.
    ControlMode { sample: SampleId, mode: EnumOrUnknown<ControlMode>, stamp: WallStamp },
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) was sent now.
    Sent(CommandFrame),
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) could not be sent.
    SendFailed { frame: CommandFrame, failure: SendFailure },
    /// The gateway is about to stop: each message is sent one more time.
    Stop,
}
