//! A vehicle to try the gateway on: it sends what a vehicle profile says the real one sends, and obeys
//! the commands that the profile describes. A driver, and faults, come on request.
//!
//! It is the other end of the bus, so it reads the profile from the other side: of meanings it makes
//! raw values, of command frames it makes lights. Nothing here is used to judge a real vehicle.

mod commanded;
mod driver;
mod encoder;
mod faults;
mod flasher;
pub mod plan;
mod possible;
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

/// How the vehicle behaves, beside what its profile says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimulationSettings {
    /// From a command frame to the lights.
    pub reaction: Duration,
    /// How long a command holds after its last frame; none = five periods of its message.
    pub command_timeout: Option<Duration>,
    /// From flash to flash; lit for half of it. A side with a broken bulb flashes twice as fast.
    pub flash_period: Duration,
    /// Another seed, other random faults.
    pub seed: u64,
}

impl Default for SimulationSettings {
    /// Reacts within 50 ms and flashes 90 times a minute.
    fn default() -> Self {
        Self {
            reaction: Duration::from_millis(50),
            command_timeout: None,
            flash_period: Duration::from_nanos(666_666_667),
            seed: 0,
        }
    }
}

/// One thing the vehicle does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Output {
    /// Sends a frame.
    Frame {
        /// On which bus.
        bus: BusIndex,
        /// The frame.
        frame: Frame,
    },
    /// Lets all others on a bus see an error frame, as their drivers would make it.
    Error {
        /// On which bus.
        bus: BusIndex,
        /// The frame.
        error: ErrorFrame,
    },
    /// Nothing on a bus: for those who watch.
    Happened(VehicleEvent),
}

/// What those who watch want to know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum VehicleEvent {
    /// Commands ask for something else than before; none = nothing is asked of this function.
    Commanded {
        /// Turn indicators.
        turn: Option<Turn>,
        /// Hazard lights.
        hazard: Option<bool>,
    },
    /// A message that commanded something has not come for too long: what it asked for is dropped.
    CommandTimedOut {
        /// The message.
        message: String,
    },
    /// A command frame was not believed; told for the first of a row.
    CommandRejected {
        /// The message.
        message: String,
        /// What is wrong with it.
        why: String,
    },
    /// Other lights flash than before.
    Lights {
        /// Which; both = hazard lights.
        code: TurnCode,
        /// Who wants it.
        who: Who,
    },
    /// The lamps are lit or dark.
    Lamps {
        /// Left ones lit.
        left: bool,
        /// Right ones lit.
        right: bool,
    },
    /// A request that this vehicle has no signal for; what is missing.
    NotPossible(&'static str),
    /// A controller has left the bus, or come back.
    BusOff(bool),
}

/// Whose wish the lights follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Who {
    /// Nobody wants any.
    Nobody,
    /// The commands.
    Command,
    /// The driver.
    Driver,
}

impl Who {
    /// For people and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nobody => "nobody",
            Self::Command => "command",
            Self::Driver => "driver",
        }
    }
}
