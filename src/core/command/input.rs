//! The inputs of the command machine: commands, the control mode, and the fate of its frames.

use super::allow_list::CommandFrame;
use super::control_mode::ControlMode;
use super::sender::SendFailure;
use super::settings::CommandSource;
use crate::core::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use crate::core::time::WallStamp;

/// One input of the command machine.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandInput {
    /// `TurnIndicatorsCommand` for the vehicle.
    Turn {
        /// Who commands.
        source: CommandSource,
        /// The command.
        command: EnumOrUnknown<TurnCommand>,
        /// The sender's stamp.
        stamp: WallStamp,
    },
    /// `HazardLightsCommand` for the vehicle.
    Hazard {
        /// Who commands.
        source: CommandSource,
        /// The command.
        command: EnumOrUnknown<HazardCommand>,
        /// The sender's stamp.
        stamp: WallStamp,
    },
    /// `ControlModeReport` of the vehicle: who drives it.
    ControlMode {
        /// The mode.
        mode: EnumOrUnknown<ControlMode>,
        /// The sender's stamp.
        stamp: WallStamp,
    },
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) was sent now, which may be
    /// later than it was given out.
    Sent(CommandFrame),
    /// A frame of [`CommandOutput::Transmit`](super::output::CommandOutput::Transmit) could not be sent.
    SendFailed {
        /// The frame.
        frame: CommandFrame,
        /// The reason.
        failure: SendFailure,
    },
    /// The gateway is about to end: one last frame of each message, then none.
    Stop,
}
