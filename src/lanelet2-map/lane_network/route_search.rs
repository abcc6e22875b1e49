//! The shortest way over consecutive lanelets.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::{LaneId, LaneNetwork};

impl LaneNetwork {
    /// Returns the shortest way from one lanelet to another, both included, without a lane change; `None` if
    /// there is none. The length of a way is the sum over all its lanelets except the last; among equally
    /// long ways the choice is deterministic.
    pub fn shortest_way(&self, from: LaneId, to: LaneId) -> Option<Vec<LaneId>> {
        self.lane(from)?;
        let mut before: BTreeMap<LaneId, Option<LaneId>> = BTreeMap::new();
        let mut pending = BinaryHeap::from([Reverse((0, from, None))]);
        while let Some(Reverse((length_mm, here, previous))) = pending.pop() {
            if before.contains_key(&here) {
                continue;
            }
            before.insert(here, previous);
            if here == to {
                let way = std::iter::successors(Some(to), |lane| before.get(lane).copied().flatten());
                let mut way: Vec<LaneId> = way.collect();
                way.reverse();
                return Some(way);
            }
            let length_mm = self.length_mm(here).saturating_add(length_mm);
            let known = |next: &LaneId| self.lane(*next).is_some();
            let followers = self.followers(here).iter().copied().filter(known);
            pending.extend(followers.map(|next| Reverse((length_mm, next, Some(here)))));
        }
        None
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // no road is that long, and none is negative
    fn length_mm(&self, lane: LaneId) -> u64 {
        self.lane(lane).map_or(0, |lane| (lane.length_m() * 1000.0).round() as u64)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Point;
    use crate::lane_network::Lanelet;

    /// Returns lanelets with ids from 0, each with this length in metres and these followers.
    fn network(lanes: &[(u8, Vec<LaneId>)]) -> LaneNetwork {
        let lane = |(id, (length_m, followers)): (LaneId, &(u8, Vec<LaneId>))| Lanelet {
            id,
            centerline: vec![Point::new(0.0, 0.0), Point::new(f64::from(*length_m), 0.0)],
            followers: followers.clone(),
            ..Lanelet::default()
        };
        LaneNetwork::new((0..).zip(lanes).map(lane), Vec::new())
    }

    fn length_m(lanes: &[(u8, Vec<LaneId>)], way: &[LaneId]) -> u32 {
        let lengths = way.iter().map(|lane| u32::from(lanes[usize::try_from(*lane).unwrap()].0));
        lengths.take(way.len() - 1).sum()
    }

    /// Returns the shortest of all ways that visit no lanelet twice, by trying each.
    fn brute_force(
        lanes: &[(u8, Vec<LaneId>)],
        way: &mut Vec<LaneId>,
        to: LaneId,
        least_m: &mut Option<u32>,
    ) {
        let here = *way.last().unwrap();
        if here == to {
            let length_m = length_m(lanes, way);
            *least_m = Some(least_m.map_or(length_m, |least_m| least_m.min(length_m)));
            return;
        }
        for next in &lanes[usize::try_from(here).unwrap()].1 {
            if !way.contains(next) {
                way.push(*next);
                brute_force(lanes, way, to, least_m);
                way.pop();
            }
        }
    }

    proptest! {
        #[test]
        fn the_way_is_as_short_as_the_shortest_of_all(
            lanes in proptest::collection::vec((1..50_u8, proptest::collection::vec(0..7_i64, 0..4)), 7),
            from in 0..7_i64,
            to in 0..7_i64,
        ) {
            let mut least_m = None;
            brute_force(&lanes, &mut vec![from], to, &mut least_m);
            let road = network(&lanes);
            let way = road.shortest_way(from, to);
            prop_assert_eq!(way.as_deref().map(|way| length_m(&lanes, way)), least_m);
            if let Some(way) = way {
                prop_assert_eq!((way[0], way[way.len() - 1]), (from, to));
                prop_assert!(way.windows(2).all(|pair| road.followers(pair[0]).contains(&pair[1])));
            }
        }
    }

    #[test]
    fn a_lanelet_that_is_not_there_is_on_no_way() {
        let road = network(&[(1, vec![1, 9]), (1, vec![])]);
        assert_eq!(road.shortest_way(9, 1), None);
        assert_eq!(road.shortest_way(0, 9), None);
        assert_eq!(road.shortest_way(0, 0), Some(vec![0]));
    }
}
