//! Which lanelets are at or near a place, without looking at all of them.

use std::ops::ControlFlow;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{PointDistance, RTree};

use super::lanelet::{Lanelet, LaneletIndex};
use super::polyline::project_onto;

/// A tree of the boxes around lanelets, by position.
#[derive(Debug, Clone)]
pub(super) struct LaneletTree(RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>);

impl LaneletTree {
    pub(super) fn new(lanelets: &[Lanelet]) -> Self {
        let boxed = |(at, lanelet): (usize, &Lanelet)| {
            let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            for point in outline(lanelet) {
                for axis in 0..2 {
                    low[axis] = low[axis].min(point[axis]);
                    high[axis] = high[axis].max(point[axis]);
                }
            }
            GeomWithData::new(Rectangle::from_corners(low, high), at)
        };
        Self(RTree::bulk_load(lanelets.iter().enumerate().map(boxed).collect()))
    }

    pub(super) fn holding(&self, lanelets: &[Lanelet], place: [f64; 2]) -> Vec<LaneletIndex> {
        if !place.iter().all(|axis| axis.is_finite()) {
            return Vec::new();
        }
        let boxes = self.0.locate_all_at_point(place).map(|found| found.data);
        let holds = |at: &usize| lanelets.get(*at).is_some_and(|lanelet| distance_m(lanelet, place) == 0.0);
        let mut found: Vec<_> = boxes.filter(holds).map(LaneletIndex).collect();
        found.sort_unstable();
        found
    }

    pub(super) fn nearest(
        &self,
        lanelets: &[Lanelet],
        place: [f64; 2],
        wanted: impl Fn(&Lanelet) -> bool,
    ) -> Option<(LaneletIndex, f64)> {
        if !place.iter().all(|axis| axis.is_finite()) {
            return None;
        }
        let mut best: Option<(f64, usize)> = None;
        // Boxes come by their distance, which no lanelet inside is nearer than.
        let _: ControlFlow<()> = self.0.nearest_neighbor_iter(place).try_for_each(|found| {
            if best.is_some_and(|(distance_m, _)| found.geom().distance_2(&place).sqrt() > distance_m) {
                return ControlFlow::Break(());
            }
            if let Some(lanelet) = lanelets.get(found.data).filter(|lanelet| wanted(lanelet)) {
                let this = (distance_m(lanelet, place), found.data);
                if best.is_none_or(|best| this < best) {
                    best = Some(this);
                }
            }
            ControlFlow::Continue(())
        });
        best.map(|(distance_m, at)| (LaneletIndex(at), distance_m))
    }
}

/// From a place to the area between the bounds, metres; 0 inside.
fn distance_m(lanelet: &Lanelet, place: [f64; 2]) -> f64 {
    let next = outline(lanelet).skip(1).chain(outline(lanelet).take(1));
    let mut nearest_m = f64::INFINITY;
    let mut inside = false;
    for (from, to) in outline(lanelet).zip(next) {
        nearest_m = nearest_m.min(project_onto(*from, *to, place).1);
        // A ray to the east crosses the outline an odd number of times from inside.
        if (from[1] > place[1]) != (to[1] > place[1]) {
            let share = (place[1] - from[1]) / (to[1] - from[1]);
            if place[0] < from[0] + share * (to[0] - from[0]) {
                inside = !inside;
            }
        }
    }
    if inside { 0.0 } else { nearest_m }
}

/// Along the left bound and back along the right one.
fn outline(lanelet: &Lanelet) -> impl Iterator<Item = &[f64; 3]> {
    lanelet.left.line.points().iter().chain(lanelet.right.line.points().iter().rev())
}
