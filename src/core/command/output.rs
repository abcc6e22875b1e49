//! What the command flow gives out.

use super::allow_list::CommandFrame;
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;

/// One frame to send, or to read along.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandOutput {
    /// Send a frame to the vehicle. When it cannot be sent, `Gateway::not_sent` wants to know at once.
    Transmit {
        /// The frame and its bus.
        frame: CommandFrame,
        /// Whether it asks for something else than the frame of this message before.
        is_news: bool,
    },
    /// Dry run: the frame that would be sent to the vehicle now. For those who read along.
    WouldTransmit {
        /// On which bus.
        bus: BusIndex,
        /// The frame.
        frame: Frame,
        /// Whether it asks for something else than the frame of this message before.
        is_news: bool,
    },
}
