//! The alphabet of the gateway: everything that can go in, everything that can come out.
//!
//! Each flow has its own inputs and outputs; here they are joined. The daemon makes [`Input`]s of what sockets
//! receive and sends [`Output`]s to sockets; a replay makes the same `Input`s of a file.

use derive_more::From;

use crate::core::can::CanInput;
use crate::core::command::input::CommandInput;
use crate::core::command::output::CommandOutput;
use crate::core::diagnostics::Diagnostics;
use crate::core::time::WallStamp;
use crate::core::traffic_light::input::TrafficLightInput;
use crate::core::traffic_light::output::TrafficLightOutput;
use crate::core::turn_signal::output::TurnSignalOutput;
use crate::core::turn_signal::planner_input::PlannerInput;
use crate::core::vehicle_lights::output::VehicleLightsOutput;
use crate::core::vehicle_status::output::VehicleStatusOutput;

/// One thing that happened outside.
#[derive(Debug, Clone, PartialEq, From)]
pub enum Input {
    /// On a CAN bus, for every flow that reads some of its messages.
    Can(CanInput),
    /// For the traffic lights.
    TrafficLight(TrafficLightInput),
    /// For the turn signal decider.
    Planner(PlannerInput),
    /// For the command machine.
    Command(CommandInput),
    /// Nothing has happened, but a deadline has come.
    Tick,
}

/// One thing to do outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Output {
    /// Of the vehicle's lights.
    VehicleLights(VehicleLightsOutput),
    /// Of the vehicle's status.
    VehicleStatus(VehicleStatusOutput),
    /// Of the traffic lights.
    TrafficLights(TrafficLightOutput),
    /// Of the turn signal decider.
    TurnSignal(TurnSignalOutput),
    /// Of the command machine.
    Command(CommandOutput),
    /// Publishes a `DiagnosticArray`.
    Diagnostics {
        /// The statuses that are published.
        diagnostics: Diagnostics,
        /// Stamp of the header, which is the present time.
        stamp: WallStamp,
    },
}

impl Input {
    /// When the kernel or the recorder received it; `None` for what happened when it was read.
    pub fn stamp(&self) -> Option<WallStamp> {
        match self {
            Self::Can(input) => input.stamp(),
            Self::TrafficLight(_) | Self::Planner(_) | Self::Command(_) | Self::Tick => None,
        }
    }
}
