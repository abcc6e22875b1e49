//! Outputs of the vehicle: frames on its buses, and events for observers.

use serde::Serialize;

use can_signal::can::{BusIndex, ErrorFrame, Frame};
use gateway_base::names::named_by_variant;
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::state::TurnCode;

/// Output of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum VehicleOutput {
    /// A frame that the vehicle sends.
    Frame { bus: BusIndex, frame: Frame },
    /// An error frame that all other participants on a bus receive from their drivers.
    Error { bus: BusIndex, error: ErrorFrame },
    /// An event for observers, without effect on a bus.
    Happened(VehicleEvent),
}

/// An event for observers.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum VehicleEvent {
    /// The request of the commands changed; `None` means no request for this function.
    Commanded { turn: Option<Turn>, hazard: Option<bool> },
    /// A command message timed out, so that its request is dropped.
    CommandTimedOut { message: String },
    /// A command frame was rejected; reported for the first of several in a row.
    CommandRejected { message: String, why: String },
    /// The flashing lights changed.
    Lights {
        /// Lights that flash; both = hazard lights.
        code: TurnCode,
        who: Who,
    },
    /// A lamp was lit or went dark.
    Lamps { left: bool, right: bool },
    /// The vehicle has no signal for a request, or cannot perform it now; contains the reason.
    NotPossible(&'static str),
    /// The controllers went bus-off (`true`) or were restarted (`false`).
    BusOff(bool),
}

/// Origin of a request for lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum Who {
    Nobody,
    Command,
    Driver,
}

named_by_variant!(Who);
