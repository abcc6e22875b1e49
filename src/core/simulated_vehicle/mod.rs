//! Simulated vehicle for tests of the gateway. It sends the messages that a vehicle profile binds and
//! obeys the commands that the profile describes. Driver actions and faults are requested.
//!
//! It is the other end of the bus and uses the profile in the opposite direction: it encodes meanings as
//! raw values and decodes command frames. Nothing here evaluates a real vehicle.

mod driver;
mod encoder;
mod faults;
mod flasher;
mod missing_signal;
pub mod plan;
mod receiver;
pub mod request;
mod transmission;
mod vehicle;

use std::time::Duration;

use crate::core::can::error_frame::ErrorFrame;
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::command::Turn;
use crate::core::vehicle_lights::state::TurnCode;
pub use vehicle::SimulatedVehicle;

/// Behaviour of the vehicle in addition to its profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimulationSettings {
    /// Delay between a command frame and the lights.
    pub reaction: Duration,
    /// Time for which a command holds after its last frame; `None` = five periods of its message.
    pub command_timeout: Option<Duration>,
    /// Flash period, half of it lit. A side with a defective bulb flashes at twice the rate.
    pub flash_period: Duration,
    /// Seed of the random faults.
    pub seed: u64,
}

impl Default for SimulationSettings {
    /// A reaction after 50 ms and 90 flashes a minute.
    fn default() -> Self {
        Self {
            reaction: Duration::from_millis(50),
            command_timeout: None,
            flash_period: Duration::from_nanos(666_666_667),
            seed: 0,
        }
    }
}

/// Output of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Output {
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
    /// The request of the commands changed; `None` = no request for this function.
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
    /// The vehicle has no signal for a request; text for the missing signal.
    NotPossible(&'static str),
    /// The controllers went bus-off (`true`) or were restarted (`false`).
    BusOff(bool),
}

/// Origin of a request for lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Who {
    /// There is no request.
    Nobody,
    /// The commands request it.
    Command,
    /// The driver requests it.
    Driver,
}

impl Who {
    /// Name in text and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nobody => "nobody",
            Self::Command => "command",
            Self::Driver => "driver",
        }
    }
}
