//! Which lanelets for vehicles follow each other and lie beside each other, by the points and ways they
//! share: lanelet2's routing graph for vehicles (docs/spec/turn-signal-decider.md, "Map facts").
//!
//! Lanelets that may be driven both ways are seen in the direction of their bounds only.

use std::collections::BTreeMap;

use super::lanelet::{Bound, Lanelet, LaneletIndex};

/// A lanelet beside another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neighbour {
    /// Which.
    pub lanelet: LaneletIndex,
    /// Whether the bound between lets vehicles change to it.
    pub routable: bool,
}

/// Lanelets for vehicles by what they share with others; lists are in the order of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Topology {
    /// By the first nodes of the bounds.
    begins: Shared<[usize; 2]>,
    /// By the last nodes of the bounds.
    ends: Shared<[usize; 2]>,
    /// By the left bound: its way and whether that is inverted.
    lefts: Shared<(i64, bool)>,
    /// By the right bound.
    rights: Shared<(i64, bool)>,
}

type Shared<K> = BTreeMap<K, Vec<LaneletIndex>>;

impl Topology {
    pub(super) fn new(lanelets: &[Lanelet]) -> Self {
        let mut topology = Self::default();
        for (at, lanelet) in lanelets.iter().enumerate().filter(|(_, lanelet)| lanelet.for_vehicles) {
            let [left, right] = [&lanelet.left, &lanelet.right];
            let index = LaneletIndex(at);
            topology.begins.entry([left.ends[0], right.ends[0]]).or_default().push(index);
            topology.ends.entry([left.ends[1], right.ends[1]]).or_default().push(index);
            topology.lefts.entry(side(left)).or_default().push(index);
            topology.rights.entry(side(right)).or_default().push(index);
        }
        topology
    }

    pub(super) fn followers(&self, of: &Lanelet) -> &[LaneletIndex] {
        shared(&self.begins, of, &[of.left.ends[1], of.right.ends[1]])
    }

    pub(super) fn previous(&self, of: &Lanelet) -> &[LaneletIndex] {
        shared(&self.ends, of, &[of.left.ends[0], of.right.ends[0]])
    }

    pub(super) fn left_of(&self, of: &Lanelet) -> Option<Neighbour> {
        let lanelet = *shared(&self.rights, of, &side(&of.left)).first()?;
        Some(Neighbour { lanelet, routable: of.left.lane_change.to_left })
    }

    pub(super) fn right_of(&self, of: &Lanelet) -> Option<Neighbour> {
        let lanelet = *shared(&self.lefts, of, &side(&of.right)).first()?;
        Some(Neighbour { lanelet, routable: of.right.lane_change.to_right })
    }

    pub(super) fn opposite_left(&self, of: &Lanelet) -> &[LaneletIndex] {
        shared(&self.lefts, of, &(of.left.way_id, !of.left.inverted))
    }

    pub(super) fn opposite_right(&self, of: &Lanelet) -> &[LaneletIndex] {
        shared(&self.rights, of, &(of.right.way_id, !of.right.inverted))
    }
}

fn side(bound: &Bound) -> (i64, bool) {
    (bound.way_id, bound.inverted)
}

/// What shares a key with a lanelet: nothing, if that one is not for vehicles.
fn shared<'a, K: Ord>(by: &'a Shared<K>, of: &Lanelet, key: &K) -> &'a [LaneletIndex] {
    by.get(key).filter(|_| of.for_vehicles).map_or(&[], Vec::as_slice)
}
