//! The alphabet of the gateway: everything that can go in, everything that can come out.
//!
//! The daemon turns sockets into [`Input`]s and [`Output`]s into sockets; a replay turns a file
//! into the same `Input`s.

use std::sync::Arc;

use super::controller::ControllerReport;
use super::diagnostics::Diagnostics;
use super::error_frame::ErrorFrame;
use super::frame::Frame;
use super::time::WallStamp;
use super::traffic_light::emission::Emission;
use super::traffic_light::engine::Sight;
use super::traffic_light::scenario::Action;
use super::traffic_light::target::StoreId;
use super::turn_signal::signal::{Hazard, Signal};
use super::vehicle_lights::verdict::{HazardLights, TurnIndicators};

/// Which of the configured CAN buses; an index into the settings' list of buses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BusIndex(pub u8);

/// What is known of the link below a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkState {
    /// Frames can arrive.
    Up,
    /// The interface exists but is down (`ENETDOWN`).
    Down,
    /// There is no interface of that name (`ENODEV`), e.g. an unplugged adapter.
    Missing,
    /// The interface is there but cannot be opened; the code is the `errno`.
    Failed(i32),
    /// The recording has ended: nothing more will come.
    Ended,
}

/// One thing that happened outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
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
    /// Somebody told states of traffic lights.
    LightStates {
        /// For which store.
        store: StoreId,
        /// By way or relation id; `None` = there is none any more.
        states: Arc<[(i64, Option<Sight>)]>,
        /// How many more could not be read.
        rejected: u32,
    },
    /// Somebody asked for something to be done with the traffic lights; `None` = in words that could
    /// not be understood.
    LightsAction(Option<Arc<Action>>),
    /// Nothing happened, but the deadline asked for has come.
    Deadline,
}

/// One thing to do outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Output {
    /// Publish `TurnIndicatorsReport`.
    TurnIndicators {
        /// The state.
        report: TurnIndicators,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Publish `HazardLightsReport`.
    HazardLights {
        /// The state.
        report: HazardLights,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Turn reports stop: a late joiner must not be handed an old one.
    WithdrawTurnIndicators,
    /// Hazard reports stop, likewise.
    WithdrawHazardLights,
    /// Publish `DiagnosticArray`.
    Diagnostics {
        /// What it says.
        diagnostics: Diagnostics,
        /// Header stamp: now.
        stamp: WallStamp,
    },
    /// Publish traffic lights.
    TrafficLights(Emission),
    /// Publish `TurnIndicatorsCommand`.
    TurnCommand {
        /// What the turn indicators shall do.
        command: Signal,
        /// When that was decided.
        stamp: WallStamp,
    },
    /// Publish `HazardLightsCommand`.
    HazardCommand {
        /// What the hazard lights shall do.
        command: Hazard,
        /// When that was decided.
        stamp: WallStamp,
    },
}
