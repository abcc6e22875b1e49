//! The plan view of a chart: lanes from above, and the way that was driven on them.

use super::ink;
use super::svg::{Element, pixels, text_at};
use super::{IndicatorState, Plan};

const HEIGHT_PX: f64 = 260.0;
const LABEL_PX: f64 = 10.0;
/// Arrow heads along the way lie at least so far apart.
const ARROW_GAP_PX: f64 = 70.0;
/// Around the way that was driven, as a share of its size, and at least so many metres: the lanes beside it.
const AROUND: f64 = 0.08;
const MIN_AROUND_M: f64 = 6.0;
/// Least width that is shown, metres.
const MIN_WIDTH_M: f64 = 30.0;
/// Most lanes that have their name.
const MAX_NAMES: usize = 60;

/// A point in the map's plane, metres.
pub type PlanPoint = (f64, f64);

/// From the map to pixels: north is up.
struct Scale {
    left_m: f64,
    top_m: f64,
    px_per_m: f64,
    left_px: f64,
    top_px: f64,
}

impl Scale {
    fn at(&self, (x_m, y_m): PlanPoint) -> (f64, f64) {
        (self.left_px + (x_m - self.left_m) * self.px_per_m, self.top_px + (self.top_m - y_m) * self.px_per_m)
    }

    /// The attribute `points` of a line.
    fn points(&self, points: &[PlanPoint]) -> String {
        let texts: Vec<_> = points
            .iter()
            .map(|point| {
                let (x, y) = self.at(*point);
                format!("{},{}", pixels(x), pixels(y))
            })
            .collect();
        texts.join(" ")
    }
}

/// Least and largest coordinates of points; `None` without a finite one.
fn extent<'a>(points: impl Iterator<Item = &'a PlanPoint>) -> Option<(PlanPoint, PlanPoint)> {
    let finite = points.filter(|(x, y)| x.is_finite() && y.is_finite());
    finite.fold(None, |extent, &(x, y)| {
        let ((left, bottom), (right, top)) = extent.unwrap_or(((x, y), (x, y)));
        Some(((left.min(x), bottom.min(y)), (right.max(x), top.max(y))))
    })
}

/// The drawing below `top_px`, with its height; nothing without a way.
pub(super) fn draw(plan: &Plan, (left_px, right_px): (f64, f64), top_px: f64) -> (Vec<Element>, f64) {
    let driven = plan.driven.iter().flat_map(|(_, points)| points);
    let Some(((left, bottom), (right, top))) = extent(driven) else { return (Vec::new(), 0.0) };
    let with_surroundings = |size_m: f64| size_m + 2.0 * (AROUND * size_m).max(MIN_AROUND_M);
    let (width_m, height_m) =
        (with_surroundings((right - left).max(MIN_WIDTH_M)), with_surroundings(top - bottom));
    let px_per_m = ((right_px - left_px) / width_m).min(HEIGHT_PX / height_m);
    let (center_x, center_y) = (f64::midpoint(left, right), f64::midpoint(bottom, top));
    let height_px = height_m * px_per_m;
    let shown_m = (right_px - left_px) / px_per_m;
    let scale = Scale {
        left_m: center_x - shown_m / 2.0,
        top_m: center_y + height_m / 2.0,
        px_per_m,
        left_px,
        top_px,
    };
    let clip = Element::new("clipPath").with("id", "plan").child(super::svg::rect(
        left_px,
        top_px,
        right_px - left_px,
        height_px,
    ));
    let mut content = Vec::new();
    for lane in &plan.lanes {
        content.push(lane_outline(lane, &scale));
    }
    for (indicator, points) in &plan.driven {
        let (fill, _) = indicator.inks();
        let stroke = if *indicator == IndicatorState::Off { ink::SOFT } else { fill };
        let way = Element::new("polyline").with("points", scale.points(points)).with("fill", "none");
        let way = way.with("stroke", stroke).with("stroke-width", 3).with("stroke-linejoin", "round");
        content.push(way.child(Element::new("title").text(indicator.name())));
        content.extend(arrows(points, &scale, stroke));
    }
    let names = plan.lanes.iter().filter(|lane| lane.is_driven).take(MAX_NAMES);
    content.extend(names.filter_map(|lane| {
        let (x, y) = scale.at(mean(&lane.outline)?);
        let name = text_at(x, y, LABEL_PX, &lane.name).with("fill", ink::DARK).with("text-anchor", "middle");
        Some(name.with("stroke", "#ffffff").with("stroke-width", 3).with("paint-order", "stroke"))
    }));
    if let Some(start) = plan.driven.first().and_then(|(_, points)| points.first()) {
        let (x, y) = scale.at(*start);
        let dot = Element::new("circle").at("cx", x).at("cy", y).at("r", 4.0).with("fill", ink::DARK);
        content.push(dot.child(Element::new("title").text("start")));
    }
    let group = Element::new("g").with("class", "plan").with("clip-path", "url(#plan)").children(content);
    (vec![Element::new("defs").child(clip), group], height_px)
}

/// Mean of points; `None` without one.
fn mean(points: &[PlanPoint]) -> Option<PlanPoint> {
    let count = u32::try_from(points.len()).ok().filter(|count| *count > 0)?;
    let sum = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0, y + point.1));
    Some((sum.0 / f64::from(count), sum.1 / f64::from(count)))
}

fn lane_outline(lane: &super::PlanLane, scale: &Scale) -> Element {
    let tint = lane.side.map_or(ink::SHADE, IndicatorState::tint);
    let outline = Element::new("polygon").with("points", scale.points(&lane.outline));
    let outline = outline.with("fill", tint).with("stroke", ink::BOX_EDGE).with("stroke-width", 0.75);
    outline.child(Element::new("title").text(&lane.name))
}

/// Heads of arrows along a way.
fn arrows(points: &[PlanPoint], scale: &Scale, fill: &str) -> Vec<Element> {
    let mut drawn = Vec::new();
    let mut driven_px = ARROW_GAP_PX / 2.0;
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (scale.at(pair[0]), scale.at(pair[1]));
        let length = (x1 - x0).hypot(y1 - y0);
        driven_px += length;
        if driven_px < ARROW_GAP_PX || length < 1e-6 {
            continue;
        }
        driven_px = 0.0;
        let (ux, uy) = ((x1 - x0) / length, (y1 - y0) / length);
        let corner = |along: f64, aside: f64| {
            format!("{},{}", pixels(x1 + along * ux - aside * uy), pixels(y1 + along * uy + aside * ux))
        };
        let corners = [corner(6.0, 0.0), corner(-5.0, 5.5), corner(-5.0, -5.5)].join(" ");
        drawn.push(Element::new("polygon").with("points", corners).with("fill", fill));
    }
    drawn
}
