//! Outputs of the vehicle: frames on its buses, and events for observers.

use serde::Serialize;

use can_signal::can::{BusIndex, ErrorFrame, Frame};
use gateway_base::names::named_by_variant;
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::state::TurnCode;

/// Output of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum VehicleOutput {
    /// A frame that the vehicle sends.
    Frame {
        /// Bus of the frame.
        bus: BusIndex,
        /// Frame to send on the bus.
        frame: Frame,
    },
    /// An error frame that all other participants on a bus receive from their drivers.
    Error {
        /// Bus of the frame.
        bus: BusIndex,
        /// Error frame to deliver.
        error: ErrorFrame,
    },
    /// An event for observers, without effect on a bus.
    Happened(VehicleEvent),
}

/// An event for observers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum VehicleEvent {
    /// The request of the commands changed; `None` means no request for this function.
    Commanded {
        /// Requested state of the turn indicators.
        turn: Option<Turn>,
        /// Requested state of the hazard lights.
        hazard: Option<bool>,
    },
    /// A command message timed out, so that its request is dropped.
    CommandTimedOut {
        /// Name of the message.
        message: String,
    },
    /// A command frame was rejected; reported for the first of several in a row.
    CommandRejected {
        /// Name of the message.
        message: String,
        /// Reason of the rejection.
        why: String,
    },
    /// The flashing lights changed.
    Lights {
        /// Lights that flash; both = hazard lights.
        code: TurnCode,
        /// Origin of the request.
        who: Who,
    },
    /// A lamp was lit or went dark.
    Lamps {
        /// True if the left lamps are lit.
        left: bool,
        /// True if the right lamps are lit.
        right: bool,
    },
    /// The vehicle has no signal for a request, or cannot perform it now; contains the reason.
    NotPossible(&'static str),
    /// The controllers went bus-off (`true`) or were restarted (`false`).
    BusOff(bool),
}

/// Origin of a request for lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Who {
    /// There is no request.
    Nobody,
    /// The commands request it.
    Command,
    /// The driver requests it.
    Driver,
}

named_by_variant!(Who);
