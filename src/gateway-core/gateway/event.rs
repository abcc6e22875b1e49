//! All inputs and outputs of the gateway.
//!
//! Each flow has its own inputs and outputs; this module joins them. The daemon creates [`Input`]s from
//! received data and sends [`Output`]s to sockets; a replay creates the same `Input`s from a file.

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

/// One external event.
#[derive(Debug, Clone, PartialEq, From)]
#[allow(missing_docs)] // their names say it
pub enum Input {
    /// Event on a CAN bus, for every flow that reads some of its messages.
    Can(CanInput),
    TrafficLight(TrafficLightInput),
    Planner(PlannerInput),
    Command(CommandInput),
    /// No event, but a deadline has been reached.
    Tick,
}

/// One action for the caller.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum Output {
    VehicleLights(VehicleLightsOutput),
    VehicleStatus(VehicleStatusOutput),
    TrafficLights(TrafficLightOutput),
    TurnSignal(TurnSignalOutput),
    Command(CommandOutput),
    /// Publishes a `DiagnosticArray`.
    Diagnostics {
        diagnostics: Diagnostics,
        /// Stamp of the header: the current time.
        stamp: WallStamp,
    },
}

impl Input {
    /// Returns the time at which the kernel or the recorder received the input; `None` for an event that
    /// happens when it is read.
    pub fn stamp(&self) -> Option<WallStamp> {
        match self {
            Self::Can(input) => input.stamp(),
            Self::TrafficLight(_) | Self::Planner(_) | Self::Command(_) | Self::Tick => None,
        }
    }
}
