//! The bounding box of a line: bounds for the distance to the line, without visiting its points.

use crate::geometry::Point;

/// Upper bound for the rounding of distances, metres.
const ROUNDING_M: f64 = 1e-6;

/// A box along the axes of the map. It is unlimited if the line is empty or not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    low: Point,
    high: Point,
}

impl Extent {
    pub(super) fn of(line: &[Point]) -> Self {
        let unlimited = Self {
            low: Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
            high: Point::new(f64::INFINITY, f64::INFINITY),
        };
        let Some(first) = line.first().filter(|_| line.iter().all(|point| point.is_finite())) else {
            return unlimited;
        };
        line.iter().fold(Self { low: *first, high: *first }, |around, point| Self {
            low: Point::new(around.low.x_m.min(point.x_m), around.low.y_m.min(point.y_m)),
            high: Point::new(around.high.x_m.max(point.x_m), around.high.y_m.max(point.y_m)),
        })
    }

    /// Returns the minimum and the maximum distance that the line can have from `query`, metres.
    pub(super) fn distances_m(&self, query: Point) -> (f64, f64) {
        let least = |low: f64, high: f64, at: f64| (low - at).max(at - high).max(0.0);
        let most = |low: f64, high: f64, at: f64| (at - low).max(high - at);
        let (low, high) = (self.low, self.high);
        let nearest_m = least(low.x_m, high.x_m, query.x_m).hypot(least(low.y_m, high.y_m, query.y_m));
        let farthest_m = most(low.x_m, high.x_m, query.x_m).hypot(most(low.y_m, high.y_m, query.y_m));
        (nearest_m, farthest_m + ROUNDING_M)
    }
}
