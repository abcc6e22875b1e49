//! Followers and neighbours among the lanelets for vehicles, found through shared points and ways: lanelet2's
//! routing graph for vehicles (docs/spec/turn-signal-decider.md, "Map facts").
//!
//! Bidirectional lanelets are used only in the direction of their bounds.

use std::collections::BTreeMap;

use super::{LaneId, Lanelet};

/// A lanelet as drawn, before its followers and neighbouring lanes are known.
pub(super) struct DrawnLanelet {
    pub(super) lane: Lanelet,
    pub(super) left: Bound,
    pub(super) right: Bound,
    pub(super) is_for_vehicles: bool,
    pub(super) is_shoulder: bool,
}

/// A bound of a lanelet, with the features that other lanelets can share.
pub(super) struct Bound {
    /// Id of its way. Several lanelets can share it.
    pub(super) way_id: i64,
    /// The way is drawn against traffic.
    pub(super) is_inverted: bool,
    /// Positions of the first and last node in the file, in the direction of traffic.
    pub(super) ends: [usize; 2],
}

/// Lanelets, by position, for each shared feature; lists are in the order of the file.
type Shared<K> = BTreeMap<K, Vec<usize>>;

/// All lanelets except the shoulders are for vehicles.
#[derive(Default)]
struct Topology {
    /// Lanelets by the first nodes of their bounds.
    begins: Shared<[usize; 2]>,
    /// Lanelets by the last nodes of their bounds.
    ends: Shared<[usize; 2]>,
    /// Lanelets by their left bound: its way, and whether the way is inverted.
    lefts: Shared<(i64, bool)>,
    /// Lanelets by their right bound: its way, and whether the way is inverted.
    rights: Shared<(i64, bool)>,
    /// Shoulders by their bounding ways.
    shoulders: Shared<i64>,
}

/// Returns the lanes of these lanelets, with their followers and neighbours.
pub(super) fn connected(drawn: Vec<DrawnLanelet>) -> Vec<Lanelet> {
    let topology = Topology::new(&drawn);
    let links: Vec<(Vec<LaneId>, [bool; 2])> = drawn
        .iter()
        .enumerate()
        .map(|(at, of)| (topology.followers(&drawn, of), topology.lanes_beside(&drawn, at, of)))
        .collect();
    let mut lanes: Vec<Lanelet> = drawn.into_iter().map(|drawn| drawn.lane).collect();
    for (lane, (followers, [left, right])) in lanes.iter_mut().zip(links) {
        lane.followers = followers;
        (lane.left.lane, lane.right.lane) = (left, right);
    }
    lanes
}

impl Topology {
    fn new(drawn: &[DrawnLanelet]) -> Self {
        let mut topology = Self::default();
        for (at, DrawnLanelet { left, right, is_for_vehicles, is_shoulder, .. }) in drawn.iter().enumerate() {
            if *is_shoulder {
                topology.shoulders.entry(left.way_id).or_default().push(at);
                topology.shoulders.entry(right.way_id).or_default().push(at);
            }
            if *is_for_vehicles {
                topology.begins.entry([left.ends[0], right.ends[0]]).or_default().push(at);
                topology.ends.entry([left.ends[1], right.ends[1]]).or_default().push(at);
                topology.lefts.entry((left.way_id, left.is_inverted)).or_default().push(at);
                topology.rights.entry((right.way_id, right.is_inverted)).or_default().push(at);
            }
        }
        topology
    }

    fn followers(&self, drawn: &[DrawnLanelet], of: &DrawnLanelet) -> Vec<LaneId> {
        let next = shared(&self.begins, of, &[of.left.ends[1], of.right.ends[1]]);
        next.iter().filter_map(|at| drawn.get(*at)).map(|next| next.lane.id).collect()
    }

    /// Returns whether there is a neighbour, a shoulder, an opposite lane or a sibling on the left and on the
    /// right.
    fn lanes_beside(&self, drawn: &[DrawnLanelet], at: usize, of: &DrawnLanelet) -> [bool; 2] {
        let beside = |bound: &Bound, neighbours, opposite| {
            let is_other = |beside: &usize| *beside != at;
            let (way_id, is_inverted) = (bound.way_id, bound.is_inverted);
            let shoulders = self.shoulders.get(&way_id).map_or(&[][..], Vec::as_slice);
            !shared(neighbours, of, &(way_id, is_inverted)).is_empty()
                || shared(opposite, of, &(way_id, !is_inverted)).iter().chain(shoulders).any(is_other)
        };
        // A sibling begins with this lanelet and ends next to it: their inner bounds meet there, as they do
        // if their followers lie side by side.
        let roots = shared(&self.ends, of, &[of.left.ends[0], of.right.ends[0]]).iter();
        let begun = roots
            .filter_map(|root| drawn.get(*root))
            .flat_map(|root| shared(&self.begins, root, &[root.left.ends[1], root.right.ends[1]]).iter());
        let siblings: Vec<_> =
            begun.filter(|other| **other != at).filter_map(|other| drawn.get(*other)).collect();
        [
            beside(&of.left, &self.rights, &self.lefts)
                || siblings.iter().any(|sibling| sibling.right.ends[1] == of.left.ends[1]),
            beside(&of.right, &self.lefts, &self.rights)
                || siblings.iter().any(|sibling| sibling.left.ends[1] == of.right.ends[1]),
        ]
    }
}

/// Returns the lanelets that share a key with this lanelet; none if it is not for vehicles.
fn shared<'a, K: Ord>(by: &'a Shared<K>, of: &DrawnLanelet, key: &K) -> &'a [usize] {
    by.get(key).filter(|_| of.is_for_vehicles).map_or(&[], Vec::as_slice)
}
