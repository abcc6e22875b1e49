//! The plan view of a chart: lanes from above, and the driven way.

use super::svg::{Element, line, pixels, text_at};
use super::{IndicatorState, Plan, text};
use crate::report::palette::{self, Paint};

const HEIGHT_PX: f64 = 260.0;
const LABEL_PX: f64 = 10.0;
/// Half the width of the way, pixels.
const WAY_PX: f64 = 4.0;
/// Radius of the dot at the start, pixels.
const DOT_PX: f64 = 4.0;
/// Distances from the middle of a lane at which its name is tried, pixels.
const NAME_OFFSETS_PX: [f64; 7] = [0.0, -13.0, 13.0, -24.0, 24.0, -36.0, 36.0];
/// Minimum length of the scale bar, pixels.
const MIN_MEASURE_PX: f64 = 50.0;
/// Minimum distance between arrow heads along the way, pixels.
const ARROW_GAP_PX: f64 = 70.0;
/// Margin around the driven way, which shows the lanes beside it: as a share of the way's size, and a minimum
/// in metres.
const AROUND: f64 = 0.08;
const MIN_AROUND_M: f64 = 6.0;
/// Minimum width of the view, metres.
const MIN_WIDTH_M: f64 = 30.0;
/// Maximum number of names and signals.
const MAX_NAMES: usize = 60;

/// A point in the map's plane, metres.
pub type PlanPoint = (f64, f64);

/// Converts map coordinates to pixels; north is up.
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

    /// Draws a scale bar of a round length in metres at the bottom, with a caption beside it, and returns the
    /// height of both.
    fn measure(&self, left_px: f64, top_px: f64) -> (Element, f64) {
        let length_m = super::axis::decimal_step(MIN_MEASURE_PX / self.px_per_m);
        let (y, right_px) = (top_px + 16.0, left_px + length_m * self.px_per_m);
        let text =
            format!("{length_m} m; north is up, and the line is the way from the dot on, with its signals");
        let ends = [left_px, right_px].map(|x| line((x, y - 4.0), (x, y + 4.0), palette::TEXT));
        let bar = line((left_px, y), (right_px, y), palette::TEXT).with("stroke-width", 1.5);
        let text = text_at(right_px + 8.0, y + 4.0, LABEL_PX + 1.0, &text).fill(palette::SOFT);
        (Element::new("g").with("class", "measure").child(bar).children(ends).child(text), 24.0)
    }

    /// Returns the attribute `points` of a line.
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

/// Returns the minimum and maximum coordinates of points; `None` without a finite point.
fn extent<'a>(points: impl Iterator<Item = &'a PlanPoint>) -> Option<(PlanPoint, PlanPoint)> {
    let finite = points.filter(|(x, y)| x.is_finite() && y.is_finite());
    finite.fold(None, |extent, &(x, y)| {
        let ((left, bottom), (right, top)) = extent.unwrap_or(((x, y), (x, y)));
        Some(((left.min(x), bottom.min(y)), (right.max(x), top.max(y))))
    })
}

/// Draws the plan below `top_px`, and returns its height; draws nothing without a way.
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
        let stroke = match indicator {
            IndicatorState::Off | IndicatorState::Nothing => palette::SOFT,
            IndicatorState::Left | IndicatorState::Right | IndicatorState::Hazard => indicator.fill(),
        };
        let way = Element::new("polyline").with("points", scale.points(points)).with("fill", "none");
        let way = way.stroke(stroke).with("stroke-width", 3).with("stroke-linejoin", "round");
        content.push(way.child(Element::new("title").text(indicator.name())));
        content.extend(arrows(points, &scale, stroke));
    }
    let start = plan.driven.first().and_then(|(_, points)| points.first()).map(|start| scale.at(*start));
    if let Some((x, y)) = start {
        let dot = Element::new("circle").at("cx", x).at("cy", y).at("r", DOT_PX).fill(palette::TEXT);
        content.push(dot.child(Element::new("title").text("start")));
    }
    content.extend(names(plan, &scale, (left_px, right_px), (top_px, top_px + height_px)));
    let group = Element::new("g").with("class", "plan").with("clip-path", "url(#plan)").children(content);
    let (measure, measure_px) = scale.measure(left_px, top_px + height_px);
    (vec![Element::new("defs").child(clip), group, measure], height_px + measure_px)
}

/// Bounding box that no name may cover: left, top, right and bottom.
type Bounds = (f64, f64, f64, f64);

fn overlap(one: &Bounds, other: &Bounds) -> bool {
    one.0 < other.2 && other.0 < one.2 && one.1 < other.3 && other.1 < one.3
}

/// Draws the signals on the way, and beside the way the names of the driven lanes. A name that would cover
/// the way or another name is omitted, and remains only as the title of its part or lane.
fn names(plan: &Plan, scale: &Scale, (left, right): (f64, f64), (top, bottom): (f64, f64)) -> Vec<Element> {
    let driven = plan.driven.iter().flat_map(|(_, points)| points.windows(2));
    let mut taken: Vec<Bounds> = driven
        .flat_map(|pair| {
            let ((x0, y0), (x1, y1)) = (scale.at(pair[0]), scale.at(pair[1]));
            let count = (((x1 - x0).hypot(y1 - y0) / WAY_PX).ceil() + 1.0).min(1_000.0);
            (0..=1_000_u32).map(f64::from).take_while(move |step| *step <= count).map(move |step| {
                let (x, y) = (x0 + (x1 - x0) * step / count, y0 + (y1 - y0) * step / count);
                (x - WAY_PX, y - WAY_PX, x + WAY_PX, y + WAY_PX)
            })
        })
        .collect();
    let lanes = plan.lanes.iter().filter(|lane| lane.is_driven);
    let lanes = lanes.filter_map(|lane| Some((mean(&lane.outline)?, lane.name.clone(), palette::TEXT)));
    // The signal is written beside its part of the way, which has the signal's colour.
    let signals = plan.driven.iter().filter_map(|(indicator, points)| {
        let meaning = indicator.meaning().filter(|meaning| !meaning.sign.is_empty())?;
        let text = format!("{} {}", meaning.sign, indicator.name());
        Some((*points.get(points.len() / 2)?, text, meaning.text))
    });
    let mut drawn = Vec::new();
    for (place, name, ink) in signals.chain(lanes).take(MAX_NAMES) {
        let (x, y) = scale.at(place);
        let half = text::width(&name, LABEL_PX) / 2.0;
        let places =
            NAME_OFFSETS_PX.iter().flat_map(|down| NAME_OFFSETS_PX.iter().map(move |aside| (*aside, *down)));
        let bounds = places.map(|(aside, down)| {
            let (x, y) = (x + aside * 2.0, y + down);
            (x - half, y - LABEL_PX / 2.0 - 1.0, x + half, y + LABEL_PX / 2.0 + 1.0)
        });
        let is_inside = |one: &Bounds| one.0 >= left && one.2 <= right && one.1 >= top && one.3 <= bottom;
        let free = |one: &Bounds| is_inside(one) && !taken.iter().any(|taken| overlap(one, taken));
        let Some(bounds) = bounds.into_iter().find(free) else { continue };
        taken.push(bounds);
        let name = text_at(bounds.0 + half, bounds.3 - LABEL_PX * 0.25, LABEL_PX, &name).fill(ink);
        let name = name.with("text-anchor", "middle").with("class", "name");
        drawn.push(name.stroke(palette::CARD).with("stroke-width", 3).with("paint-order", "stroke"));
    }
    drawn
}

/// Returns the mean of points; `None` if there are none.
fn mean(points: &[PlanPoint]) -> Option<PlanPoint> {
    let count = u32::try_from(points.len()).ok().filter(|count| *count > 0)?;
    let sum = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0, y + point.1));
    Some((sum.0 / f64::from(count), sum.1 / f64::from(count)))
}

fn lane_outline(lane: &super::PlanLane, scale: &Scale) -> Element {
    let tint = lane.side.map_or(palette::PAGE, IndicatorState::tint);
    let outline = Element::new("polygon").with("points", scale.points(&lane.outline));
    let outline = outline.fill(tint).stroke(palette::EDGE).with("stroke-width", 0.75);
    outline.child(Element::new("title").text(&lane.name))
}

/// Draws arrow heads along a way.
fn arrows(points: &[PlanPoint], scale: &Scale, fill: Paint) -> Vec<Element> {
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
        drawn.push(Element::new("polygon").with("points", corners).fill(fill));
    }
    drawn
}
