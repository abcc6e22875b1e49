//! A section record: the signal of one manoeuvre and the stretch to which it applies
//! (docs/spec/turn-signal-decider.md, "Conventions").

use std::ops::Range;

use super::junction::JunctionAhead;
use super::side::Side;
use super::subject::SignalSubject;
use crate::light_command::{HazardCommand, TurnCommand};
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathFrame;

/// The request of one manoeuvre. The default is upstream's empty record: no command, all points at the
/// origin of the map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Section {
    /// The turn command it requests.
    pub turn: TurnCommand,
    /// The hazard command it requests.
    pub hazard: HazardCommand,
    /// Start of the stretch in which it may be signalled.
    pub desired_start: Pose,
    /// End of that stretch.
    pub desired_end: Pose,
    /// Start of the stretch in which it must be signalled.
    pub required_start: Pose,
    /// End of that stretch.
    pub required_end: Pose,
    /// The turn, the part of a roundabout or the manoeuvre that is signalled.
    pub subject: SignalSubject,
    /// Position of the section on the distance path of this cycle; `None` if its points must be searched for.
    pub place: Option<SectionPlace>,
    /// A junction before the section's turn that offers the same side.
    pub junction: Option<JunctionAhead>,
}

/// Position of a section on the distance path of a cycle. It prevents confusing the points of a path that
/// comes near to itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionPlace {
    /// Arc lengths of the section's lanelets, metres.
    pub span_m: [f64; 2],
    /// Distance from its desired start to its required start, metres.
    pub announced_before_m: f64,
}

/// The four distances of a record, metres along the path: starts from the front, ends from the rear axle;
/// negative values lie behind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distances {
    /// Distance from the front to the desired start (`ds`).
    pub desired_start_m: f64,
    /// Distance from the rear axle to the desired end (`de`).
    pub desired_end_m: f64,
    /// Distance from the front to the required start (`rs`).
    pub required_start_m: f64,
    /// Distance from the rear axle to the required end (`re`).
    pub required_end_m: f64,
}

impl Distances {
    /// Returns the desired start, desired end, required start and required end.
    pub fn values(&self) -> [f64; 4] {
        [self.desired_start_m, self.desired_end_m, self.required_start_m, self.required_end_m]
    }

    /// Returns whether the front is past the start of the required section, and the rear axle not past its
    /// end.
    pub fn are_required(&self) -> bool {
        self.required_start_m <= 0.0 && self.required_end_m >= 0.0
    }
}

impl Section {
    /// Returns a record that blinks on one side, with the poses of both stretches.
    pub fn blinking(side: Side, desired: Range<Pose>, required: Range<Pose>) -> Self {
        Self {
            turn: side.into(),
            desired_start: desired.start,
            desired_end: desired.end,
            required_start: required.start,
            required_end: required.end,
            ..Self::default()
        }
    }

    /// Returns whether the section waits until a junction is passed.
    pub fn waits(&self) -> bool {
        self.junction.is_some_and(|junction| junction.waits())
    }

    /// Returns whether a side or the hazard lights are requested.
    pub fn requests_something(&self) -> bool {
        self.turn.side().is_some() || self.hazard == HazardCommand::Enable
    }

    /// Returns whether all four poses are finite.
    pub fn is_finite(&self) -> bool {
        [self.desired_start, self.desired_end, self.required_start, self.required_end]
            .iter()
            .all(|pose| pose.is_finite())
    }

    /// Measures the four distances from the vehicle. If every visit of a path is considered, the desired
    /// section is the one that contains the required section: on a ring its far end may come by a second
    /// time, nearer to the vehicle.
    pub fn distances(&self, path_frame: &PathFrame<'_>) -> Distances {
        if let Some(SectionPlace { span_m, announced_before_m }) = self.place {
            let from_base_m = |pose| path_frame.from_base_within_m(pose, span_m);
            let required_start_m = from_base_m(self.required_start) - path_frame.front_m();
            return Distances {
                desired_start_m: required_start_m - announced_before_m,
                desired_end_m: from_base_m(self.desired_end),
                required_start_m,
                required_end_m: from_base_m(self.required_end),
            };
        }
        let distances = Distances {
            desired_start_m: path_frame.from_front_m(self.desired_start),
            desired_end_m: path_frame.from_base_m(self.desired_end),
            required_start_m: path_frame.from_front_m(self.required_start),
            required_end_m: path_frame.from_base_m(self.required_end),
        };
        if !path_frame.looks_at_every_visit() {
            return distances;
        }
        Distances {
            desired_start_m: distances.desired_start_m.min(distances.required_start_m),
            desired_end_m: distances.desired_end_m.max(distances.required_end_m),
            ..distances
        }
    }
}
