//! Announced manoeuvres, recognised from one cycle to the next
//! (docs/spec/turn-signal-decider.md, "Identity of manoeuvres").

use crate::side::Side;
use crate::subject::ManoeuvreKind;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathFrame;

/// Ends farther apart than this in two consecutive cycles belong to two manoeuvres, metres. A waiting lane
/// change moves with the vehicle, by less than this per cycle.
pub const SAME_END_M: f64 = 5.0;
/// Nearer ends belong to two manoeuvres if their distances from the vehicle along the path differ by more
/// than this, metres: the path comes by twice, as on a ring or a helix. The vehicle itself advances less in a
/// cycle.
const SAME_VISIT_M: f64 = 25.0;

/// Returns whether an end that is `before_m` ahead of the vehicle in one cycle and `now_m` in the next lies
/// on one visit of the path, metres.
pub fn is_same_visit(before_m: f64, now_m: f64) -> bool {
    (before_m - now_m).abs() <= SAME_VISIT_M
}

/// The features that identify a manoeuvre of the planner in the next cycle; planning factors have no ids.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // their names say it
pub struct ManoeuvreIdentity {
    pub kind: ManoeuvreKind,
    pub side: Side,
    pub end: Pose,
    /// Distance from the rear axle to its end along the path, metres.
    pub ahead_m: f64,
}

/// The announced manoeuvres. A manoeuvre that is absent in a cycle is forgotten at the end of that cycle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnnouncedManoeuvres {
    known: Vec<AnnouncedManoeuvre>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct AnnouncedManoeuvre {
    identity: ManoeuvreIdentity,
    /// Pose of the vehicle at the announcement, or the start if it already lay behind.
    from: Pose,
    is_present: bool,
}

impl ManoeuvreIdentity {
    /// Creates a manoeuvre that ends at a pose, seen from the vehicle.
    pub fn new(path_frame: &PathFrame<'_>, kind: ManoeuvreKind, side: Side, end: Pose) -> Self {
        Self { kind, side, end, ahead_m: path_frame.from_base_m(end) }
    }

    /// Returns the distance between the ends, metres, if both may be one manoeuvre in two cycles.
    fn moved_m(&self, next: &Self) -> Option<f64> {
        let moved_m = self.end.position.distance_m(next.end.position);
        // The planner pulls out and over once; deciding on the target moves the end by any distance.
        let is_only_one = matches!(self.kind, ManoeuvreKind::PullOut | ManoeuvreKind::PullOver);
        let is_near = moved_m <= SAME_END_M && is_same_visit(self.ahead_m, next.ahead_m);
        let is_same = self.kind == next.kind && self.side == next.side && (is_only_one || is_near);
        is_same.then_some(moved_m)
    }
}

impl AnnouncedManoeuvres {
    /// Returns the pose from which a manoeuvre is announced, and marks the manoeuvre as present in this
    /// cycle; `None` if it is not announced.
    pub fn from(&mut self, identity: ManoeuvreIdentity) -> Option<Pose> {
        let free = self.known.iter_mut().filter(|announced| !announced.is_present);
        let nearest = free
            .filter_map(|announced| Some((announced.identity.moved_m(&identity)?, announced)))
            .min_by(|(one_m, _), (other_m, _)| one_m.total_cmp(other_m));
        nearest.map(|(_, announced)| {
            (announced.identity, announced.is_present) = (identity, true);
            announced.from
        })
    }

    /// Announces a manoeuvre that is not announced yet.
    pub fn announce(&mut self, identity: ManoeuvreIdentity, from: Pose) {
        self.known.push(AnnouncedManoeuvre { identity, from, is_present: true });
    }

    /// Forgets the manoeuvres that were not present in this cycle.
    pub fn end_cycle(&mut self) {
        self.known.retain(|announced| announced.is_present);
        for announced in &mut self.known {
            announced.is_present = false;
        }
    }
}
