//! The subject of a section record: the turn, the part of a roundabout or the manoeuvre that is signalled.

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::light_command::TurnCommand;
use crate::side::Side;
use lanelet2_map::lane_network::LaneId;

/// The subject of a section record. Turns and roundabouts are named by the lanelet at which their required
/// section begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SignalSubject {
    /// The subject of upstream's empty record.
    #[default]
    Unnamed,
    /// A turn at an intersection.
    Turn(LaneId),
    /// The way into a roundabout.
    RoundaboutEntry(LaneId),
    /// The way out of a roundabout.
    RoundaboutExit(LaneId),
    /// A manoeuvre of the planner.
    Manoeuvre(ManoeuvreKind),
}

/// The kind of a manoeuvre.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema, Display,
)]
#[serde(rename_all = "snake_case")]
pub enum ManoeuvreKind {
    /// Pulling out from the roadside.
    #[display("pull-out")]
    PullOut,
    /// Avoidance of static obstacles.
    #[display("avoidance")]
    Avoidance,
    /// A lane change to either side.
    #[display("lane change")]
    LaneChange,
    /// Pulling over to the roadside.
    #[display("pull-over")]
    PullOver,
    /// A side shift, or a path of the sampling planner.
    #[display("side shift")]
    SideShift,
}

impl SignalSubject {
    /// Returns the name with the side that is signalled, such as `left turn on 111`; `None` for the empty
    /// record.
    pub fn name(self, turn: TurnCommand) -> Option<String> {
        let side = turn.side().map_or("no side", Side::name);
        Some(match self {
            Self::Unnamed => return None,
            Self::Turn(lane) => format!("{side} turn on {lane}"),
            Self::RoundaboutEntry(lane) => format!("roundabout entry on {lane}"),
            Self::RoundaboutExit(lane) => format!("roundabout exit on {lane}"),
            Self::Manoeuvre(kind) => format!("{kind} to the {side}"),
        })
    }

    /// Returns a short name without the side, such as `turn 111`; `None` for the empty record.
    pub fn label(self) -> Option<String> {
        Some(match self {
            Self::Unnamed => return None,
            Self::Turn(lane) => format!("turn {lane}"),
            Self::RoundaboutEntry(lane) => format!("entry {lane}"),
            Self::RoundaboutExit(lane) => format!("exit {lane}"),
            Self::Manoeuvre(kind) => kind.to_string(),
        })
    }
}
