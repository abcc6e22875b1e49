//! Inputs of the command machine: commands, control mode, and results of sending.

use super::allow_list::CommandFrame;
use super::origin::{CommandOrigin, SampleId};
use super::sender::SendFailure;
use crate::control_mode::ControlMode;
use gateway_base::time::WallStamp;
use turn_signal::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};

/// One input of the command machine.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandInput {
    /// `TurnIndicatorsCommand` for the vehicle.
    Turn {
        /// Origin of the command.
        origin: CommandOrigin,
        /// The command, or a number that the message definition lacks.
        command: EnumOrUnknown<TurnCommand>,
        /// Stamp by the sender's clock, which may differ from this host's.
        stamp: WallStamp,
    },
    /// `HazardLightsCommand` for the vehicle.
    Hazard {
        /// Origin of the command.
        origin: CommandOrigin,
        /// The command, or a number that the message definition lacks.
        command: EnumOrUnknown<HazardCommand>,
        /// Stamp by the sender's clock, which may differ from this host's.
        stamp: WallStamp,
    },
    /// `ControlModeReport` of the vehicle: who drives it.
    ControlMode {
        /// Identity of the message.
        sample: SampleId,
        /// Control mode, or a number that the message definition lacks.
        mode: EnumOrUnknown<ControlMode>,
        /// Stamp by the sender's clock, which may differ from this host's.
        stamp: WallStamp,
    },
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) was sent now.
    Sent(CommandFrame),
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) could not be sent.
    SendFailed {
        /// Frame that was not sent.
        frame: CommandFrame,
        /// Reason for the failure.
        failure: SendFailure,
    },
    /// The gateway is about to stop: each message is sent one more time.
    Stop,
}
