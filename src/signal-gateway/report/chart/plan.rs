//! The plan view of a chart: lanes from above, and the driven way.

use std::ops::Range;

use super::command::IndicatorState;
use super::svg::{Element, horizontal, pixels, rect, text_at, vertical};
use super::{axis, text};
use crate::report::palette::{self, Paint};
use lanelet2_map::geometry::Point;

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
const ARROW_GAP_PX: f64 = 70.0;
/// Margin around the driven way, for the lanes beside it: share of the way's size, and minimum in metres.
const AROUND: f64 = 0.08;
const MIN_AROUND_M: f64 = 6.0;
const MIN_WIDTH_M: f64 = 30.0;
/// Maximum number of names and signals.
const MAX_NAMES: usize = 60;

/// Lanes from above, and the driven way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Lanes near the way.
    pub lanes: Vec<PlanLane>,
    /// Parts of the way, with the signal on each.
    pub driven: Vec<(IndicatorState, Vec<Point>)>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct PlanLane {
    pub name: String,
    /// Side to which the lane turns.
    pub side: Option<IndicatorState>,
    /// True if the vehicle was on it.
    pub is_driven: bool,
    /// Bounds of the lane, as one closed line.
    pub outline: Vec<Point>,
}

/// Converts map coordinates to pixels; north is up.
struct Scale {
    left_m: f64,
    top_m: f64,
    px_per_m: f64,
    left_px: f64,
    top_px: f64,
}

impl Scale {
    fn at(&self, point: &Point) -> (f64, f64) {
        let (right_m, down_m) = (point.x_m - self.left_m, self.top_m - point.y_m);
        (self.left_px + right_m * self.px_per_m, self.top_px + down_m * self.px_per_m)
    }

    /// Draws a scale bar of a round length in metres with a caption, and returns their height.
    fn measure(&self, left_px: f64, top_px: f64) -> (Element, f64) {
        let length_m = axis::decimal_step(MIN_MEASURE_PX / self.px_per_m);
        let (y, right_px) = (top_px + 16.0, left_px + length_m * self.px_per_m);
        let text =
            format!("{length_m} m; north is up, and the line is the way from the dot on, with its signals");
        let ends = [left_px, right_px].map(|x| vertical(x, y - 4.0..y + 4.0, palette::TEXT));
        let bar = horizontal(left_px..right_px, y, palette::TEXT).with("stroke-width", 1.5);
        let text = text_at(right_px + 8.0, y + 4.0, LABEL_PX + 1.0, &text).fill(palette::SOFT);
        (Element::new("g").with("class", "measure").child(bar).children(ends).child(text), 24.0)
    }

    fn points(&self, points: &[Point]) -> String {
        let places = points.iter().map(|point| self.at(point));
        places.map(|(x, y)| format!("{},{}", pixels(x), pixels(y))).collect::<Vec<_>>().join(" ")
    }
}

/// Draws the plan below `top_px`, and returns its height; draws nothing without a way.
pub(super) fn draw(plan: &Plan, across_px: Range<f64>, top_px: f64) -> (Vec<Element>, f64) {
    let extent = |coordinate: fn(&Point) -> f64| {
        let driven = plan.driven.iter().flat_map(|(_, points)| points).filter(|point| point.is_finite());
        driven.map(coordinate).fold(f64::INFINITY..f64::NEG_INFINITY, |extent, value| {
            extent.start.min(value)..extent.end.max(value)
        })
    };
    let (x_m, y_m) = (extent(|point| point.x_m), extent(|point| point.y_m));
    if x_m.start > x_m.end {
        return (Vec::new(), 0.0);
    }
    let with_surroundings = |size_m: f64| size_m + 2.0 * (AROUND * size_m).max(MIN_AROUND_M);
    let width_m = with_surroundings((x_m.end - x_m.start).max(MIN_WIDTH_M));
    let height_m = with_surroundings(y_m.end - y_m.start);
    let width_px = across_px.end - across_px.start;
    let px_per_m = (width_px / width_m).min(HEIGHT_PX / height_m);
    let height_px = height_m * px_per_m;
    let scale = Scale {
        left_m: f64::midpoint(x_m.start, x_m.end) - width_px / px_per_m / 2.0,
        top_m: f64::midpoint(y_m.start, y_m.end) + height_m / 2.0,
        px_per_m,
        left_px: across_px.start,
        top_px,
    };
    let clip = rect(across_px.start, top_px, width_px, height_px);
    let clip = Element::new("clipPath").with("id", "plan").child(clip);
    let mut content: Vec<_> = plan.lanes.iter().map(|lane| lane_outline(lane, &scale)).collect();
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
    if let Some(start) = plan.driven.first().and_then(|(_, points)| points.first()) {
        let (x, y) = scale.at(start);
        let dot = Element::new("circle").at("cx", x).at("cy", y).at("r", DOT_PX).fill(palette::TEXT);
        content.push(dot.child(Element::new("title").text("start")));
    }
    let bottom_px = top_px + height_px;
    let (measure, measure_px) = scale.measure(across_px.start, bottom_px);
    content.extend(names(plan, &scale, &Bounds { x: across_px, y: top_px..bottom_px }));
    let group = Element::new("g").with("class", "plan").with("clip-path", "url(#plan)").children(content);
    (vec![Element::new("defs").child(clip), group, measure], height_px + measure_px)
}

/// A rectangle, pixels.
struct Bounds {
    x: Range<f64>,
    y: Range<f64>,
}

impl Bounds {
    fn around(x: f64, y: f64, half_width: f64, half_height: f64) -> Self {
        Self { x: x - half_width..x + half_width, y: y - half_height..y + half_height }
    }

    fn overlaps(&self, other: &Self) -> bool {
        let overlap = |one: &Range<f64>, other: &Range<f64>| one.start < other.end && other.start < one.end;
        overlap(&self.x, &other.x) && overlap(&self.y, &other.y)
    }

    fn is_within(&self, other: &Self) -> bool {
        let within = |one: &Range<f64>, other: &Range<f64>| one.start >= other.start && one.end <= other.end;
        within(&self.x, &other.x) && within(&self.y, &other.y)
    }
}

/// Draws the signals on the way, and beside the way the names of the driven lanes. A name that would cover
/// the way or another name is omitted, and remains only as the title of its part or lane.
fn names(plan: &Plan, scale: &Scale, view: &Bounds) -> Vec<Element> {
    let driven = plan.driven.iter().flat_map(|(_, points)| points.windows(2));
    let mut taken: Vec<Bounds> = driven
        .flat_map(|pair| {
            let ((x0, y0), (x1, y1)) = (scale.at(&pair[0]), scale.at(&pair[1]));
            let count = (((x1 - x0).hypot(y1 - y0) / WAY_PX).ceil() + 1.0).min(1_000.0);
            (0..=1_000_u32).map(f64::from).take_while(move |step| *step <= count).map(move |step| {
                let (x, y) = (x0 + (x1 - x0) * step / count, y0 + (y1 - y0) * step / count);
                Bounds::around(x, y, WAY_PX, WAY_PX)
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
        let (x, y) = scale.at(&place);
        let half = text::width(&name, LABEL_PX) / 2.0;
        let places =
            NAME_OFFSETS_PX.iter().flat_map(|down| NAME_OFFSETS_PX.iter().map(move |aside| (*aside, *down)));
        let mut bounds =
            places.map(|(aside, down)| Bounds::around(x + aside * 2.0, y + down, half, LABEL_PX / 2.0 + 1.0));
        let free = |one: &Bounds| one.is_within(view) && !taken.iter().any(|taken| one.overlaps(taken));
        let Some(bounds) = bounds.find(free) else { continue };
        let name = text_at(bounds.x.start + half, bounds.y.end - LABEL_PX * 0.25, LABEL_PX, &name).fill(ink);
        let name = name.with("text-anchor", "middle").with("class", "name");
        drawn.push(name.stroke(palette::CARD).with("stroke-width", 3).with("paint-order", "stroke"));
        taken.push(bounds);
    }
    drawn
}

fn mean(points: &[Point]) -> Option<Point> {
    let count = u32::try_from(points.len()).ok().filter(|count| *count > 0)?;
    let sum = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.x_m, y + point.y_m));
    Some(Point::new(sum.0 / f64::from(count), sum.1 / f64::from(count)))
}

fn lane_outline(lane: &PlanLane, scale: &Scale) -> Element {
    let tint = lane.side.map_or(palette::PAGE, IndicatorState::tint);
    let outline = Element::new("polygon").with("points", scale.points(&lane.outline));
    let outline = outline.fill(tint).stroke(palette::EDGE).with("stroke-width", 0.75);
    outline.child(Element::new("title").text(&lane.name))
}

fn arrows(points: &[Point], scale: &Scale, fill: Paint) -> Vec<Element> {
    let mut drawn = Vec::new();
    let mut driven_px = ARROW_GAP_PX / 2.0;
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (scale.at(&pair[0]), scale.at(&pair[1]));
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
