//! Events on a CAN bus.

use super::controller::ControllerReport;
use super::error_frame::ErrorFrame;
use super::frame::Frame;
use super::link::{BusIndex, LinkState};
use gateway_base::time::WallStamp;

/// One event on a CAN bus.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum CanInput {
    /// A data frame arrived.
    Frame {
        bus: BusIndex,
        frame: Frame,
        /// Receive time of the kernel or stamp of the recording.
        stamp: WallStamp,
    },
    /// The link below a bus changed.
    Link { bus: BusIndex, state: LinkState },
    /// The kernel dropped frames because the receive queue was full.
    Drops {
        bus: BusIndex,
        /// Number of frames dropped since the last report.
        lost: u32,
    },
    /// The controller or driver sent an error frame.
    ErrorFrame { bus: BusIndex, error: ErrorFrame },
    /// The kernel reported the state of the controller on request, changed or not.
    Controller { bus: BusIndex, report: ControllerReport },
    /// Records of a recording could not be read.
    BadRecords {
        /// Bus to which they are attributed.
        bus: BusIndex,
        /// Number of unreadable records since the last report.
        count: u32,
    },
}

impl CanInput {
    /// Returns the bus of the event.
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

    /// Returns the receive time of a frame; `None` for other events, whose time is the time of reading.
    pub fn stamp(&self) -> Option<WallStamp> {
        if let Self::Frame { stamp, .. } = *self { Some(stamp) } else { None }
    }
}
