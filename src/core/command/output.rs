//! The outputs of the command machine.

use super::allow_list::CommandFrame;
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;

/// One frame to send, or to show.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandOutput {
    /// Send a frame to the vehicle, and give its fate back before the next settling:
    /// [`CommandInput::Sent`](super::input::CommandInput::Sent) or
    /// [`CommandInput::SendFailed`](super::input::CommandInput::SendFailed).
    Transmit {
        /// The frame and its bus.
        frame: CommandFrame,
        /// True if its contents differ from those of the last frame of this message, but for counter and checksum.
        is_news: bool,
    },
    /// In a dry run, the frame that would be sent to the vehicle now.
    WouldTransmit {
        /// Bus it would be sent on.
        bus: BusIndex,
        /// Frame with counter and checksum.
        frame: Frame,
        /// True if its contents differ from those of the last frame of this message, but for counter and checksum.
        is_news: bool,
    },
}
