//! What can happen on a CAN bus.

use super::controller::ControllerReport;
use super::error_frame::ErrorFrame;
use super::frame::Frame;
use super::link::{BusIndex, LinkState};
use crate::core::time::WallStamp;

/// One thing that happened on a CAN bus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CanInput {
    /// A data frame arrived.
    Frame {
        /// On which bus.
        bus: BusIndex,
        /// The frame.
        frame: Frame,
        /// When the kernel received it, or the recording's stamp.
        stamp: WallStamp,
    },
    /// The link below a bus changed.
    Link {
        /// Which bus.
        bus: BusIndex,
        /// What it is now.
        state: LinkState,
    },
    /// The kernel dropped frames because the receive queue was full.
    Drops {
        /// On which bus.
        bus: BusIndex,
        /// How many more than reported before.
        lost: u32,
    },
    /// The controller or driver sent an error frame.
    ErrorFrame {
        /// On which bus.
        bus: BusIndex,
        /// What it says.
        error: ErrorFrame,
    },
    /// The kernel told the state of the controller below a bus: when asked, changed or not.
    Controller {
        /// Of which bus.
        bus: BusIndex,
        /// What it said.
        report: ControllerReport,
    },
    /// Lines or records of a recording that could not be read.
    BadRecords {
        /// On which bus they would have been counted.
        bus: BusIndex,
        /// How many more than reported before.
        count: u32,
    },
}

impl CanInput {
    /// The bus that it happened on.
    pub fn bus(&self) -> BusIndex {
        match *self {
            Self::Frame { bus, .. }
            | Self::Link { bus, .. }
            | Self::Drops { bus, .. }
            | Self::ErrorFrame { bus, .. }
            | Self::Controller { bus, .. }
            | Self::BadRecords { bus, .. } => bus,
        }
    }

    /// When the kernel or the recorder received it; `None` for what happened when it was read.
    pub fn stamp(&self) -> Option<WallStamp> {
        match *self {
            Self::Frame { stamp, .. } => Some(stamp),
            Self::Link { .. }
            | Self::Drops { .. }
            | Self::ErrorFrame { .. }
            | Self::Controller { .. }
            | Self::BadRecords { .. } => None,
        }
    }
}
