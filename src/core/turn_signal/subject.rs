//! The subject of a section record: the turn, the part of a roundabout or the manoeuvre that is signalled.

use crate::core::light_command::TurnCommand;
use crate::core::map::lane_network::LaneId;
use crate::core::turn_signal::side::Side;

/// The subject of a section record. Turns and roundabouts go by the lanelet at which their required section begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SignalSubject {
    /// Not named: upstream's empty record.
    #[default]
    Unnamed,
    /// A turn at an intersection.
    Turn(LaneId),
    /// The way into a roundabout.
    RoundaboutEntry(LaneId),
    /// The way out of a roundabout.
    RoundaboutExit(LaneId),
    /// Pulling out from the roadside.
    PullOut,
    /// Avoidance of static obstacles, out or back.
    Avoidance,
    /// A lane change to either side.
    LaneChange,
    /// Pulling over to the roadside.
    PullOver,
}

impl SignalSubject {
    /// Returns its name with the side that is signalled, such as `left turn on 111`; `None` when it is not named.
    pub fn name(self, turn: TurnCommand) -> Option<String> {
        let side = turn.side().map_or("no side", Side::name);
        Some(match self {
            Self::Unnamed => return None,
            Self::Turn(lane) => format!("{side} turn on {lane}"),
            Self::RoundaboutEntry(lane) => format!("roundabout entry on {lane}"),
            Self::RoundaboutExit(lane) => format!("roundabout exit on {lane}"),
            Self::PullOut => format!("pull-out to the {side}"),
            Self::Avoidance => format!("avoidance to the {side}"),
            Self::LaneChange => format!("lane change to the {side}"),
            Self::PullOver => format!("pull-over to the {side}"),
        })
    }

    /// Returns a short name without the side, such as `turn 111`; `None` when it is not named.
    pub fn label(self) -> Option<String> {
        Some(match self {
            Self::Unnamed => return None,
            Self::Turn(lane) => format!("turn {lane}"),
            Self::RoundaboutEntry(lane) => format!("entry {lane}"),
            Self::RoundaboutExit(lane) => format!("exit {lane}"),
            Self::PullOut => "pull-out".to_owned(),
            Self::Avoidance => "avoidance".to_owned(),
            Self::LaneChange => "lane change".to_owned(),
            Self::PullOver => "pull-over".to_owned(),
        })
    }
}
