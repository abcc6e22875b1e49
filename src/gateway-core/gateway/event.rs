//! The alphabet of the gateway: everything that can go in, everything that can come out.
//!
//! Each flow has its own inputs and outputs; here they are joined. The daemon makes [`Input`]s of what
//! sockets receive and sends [`Output`]s to sockets; a replay makes the same `Input`s of a file.

use derive_more::From;

use crate::command::input::CommandInput;
use crate::command::output::CommandOutput;
use crate::vehicle_lights::output::VehicleLightsOutput;
use crate::vehicle_status::output::VehicleStatusOutput;
use can_signal::can::CanInput;
use gateway_base::diagnostics::Diagnostics;
use gateway_base::time::WallStamp;
use traffic_lights::input::TrafficLightInput;
use traffic_lights::output::TrafficLightOutput;
use turn_signal::output::TurnSignalOutput;
use turn_signal::planner_input::PlannerInput;

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
