//! Outputs of the command machine.

use super::allow_list::CommandFrame;
use can_signal::can::{BusIndex, Frame};

/// A frame to send, or to show in a dry run.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandOutput {
    /// A frame to send to the vehicle. Report the result before the next `settle`:
    /// [`CommandInput::Sent`](super::input::CommandInput::Sent) or
    /// [`CommandInput::SendFailed`](super::input::CommandInput::SendFailed).
    Transmit {
        /// The frame and its bus.
        frame: CommandFrame,
        /// True if the contents, without counter and checksum, differ from the last frame of this message.
        is_news: bool,
    },
    /// In a dry run, the frame that would be sent to the vehicle now.
    WouldTransmit {
        /// Bus on which it would be sent.
        bus: BusIndex,
        /// Frame with counter and checksum.
        frame: Frame,
        /// True if the contents, without counter and checksum, differ from the last frame of this message.
        is_news: bool,
    },
}
