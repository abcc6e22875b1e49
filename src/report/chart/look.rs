//! The look of a bar: bulbs, a name, or a command.

use super::command::{CommandKind, IndicatorState};
use super::ink::{self, Ink};
use super::svg::{Area, Element, line, pixels, rect, text_at};
use super::text;
use crate::core::diagnostics::Level;
use crate::core::traffic_light::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

/// The state that a bar shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Look {
    /// A light: a stripe for each bulb, from the first in the order of keys at the top. Without
    /// bulbs it is dark, which is a thin line.
    Bulbs(BulbSet),
    /// A box with a name, such as a phase or a lanelet.
    Named(String),
    /// A turn signal or hazard lights.
    Command(CommandKind, IndicatorState),
    /// A lanelet with its name, and the side that it turns to.
    Lanelet(Option<IndicatorState>, String),
    /// A quantity as a share of its largest value, 0 to 1, with its text.
    Share(f64, String),
    /// A status with its message.
    Status(Level, String),
    /// A quantity as a line, with its range as text.
    Curve {
        /// Position along the bar and share of the row's range, both 0 to 1.
        points: Vec<(f64, f64)>,
        /// Share at which the quantity is 0.
        zero: f64,
        /// Its range in words.
        text: String,
    },
}

const STRIPE_PX: f64 = 12.0;
const MAX_STRIPES: u8 = 6;
/// A narrower bar is all border.
const BORDERLESS_PX: f64 = 4.0;
const SIGN_PX: f64 = 11.0;
/// Height of a curve.
const CURVE_PX: f64 = 64.0;
/// Above the highest and below the lowest value of a curve.
const CURVE_EDGE_PX: f64 = 3.0;
/// Room left and right of a label together.
const LABEL_GAP_PX: f64 = 6.0;
/// From the middle of a line of text down to its base line, as a factor of its size.
pub(super) const BASE_LINE: f64 = 0.36;

impl Look {
    /// The look as text.
    pub(super) fn description(&self) -> String {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => "dark".to_owned(),
            Self::Bulbs(bulbs) => bulbs.to_string(),
            Self::Named(name) | Self::Lanelet(_, name) | Self::Share(_, name) | Self::Status(_, name) => {
                name.clone()
            }
            Self::Command(kind, indicator) => kind.description(*indicator),
            Self::Curve { text, .. } => text.clone(),
        }
    }

    /// Height that a row needs to show it, pixels; `single_px` is enough for a line of text.
    pub(super) fn height(&self, single_px: f64) -> f64 {
        match self {
            Self::Bulbs(bulbs) => {
                let stripes = u8::try_from(bulbs.len()).unwrap_or(MAX_STRIPES).min(MAX_STRIPES);
                single_px.max(f64::from(stripes) * STRIPE_PX)
            }
            Self::Named(_) | Self::Lanelet(..) | Self::Share(..) | Self::Command(..) | Self::Status(..) => {
                single_px
            }
            Self::Curve { .. } => CURVE_PX.max(single_px),
        }
    }

    /// Returns whether bars of this look may lie one over the other.
    pub(super) fn overlaps(&self) -> bool {
        matches!(self, Self::Command(..))
    }

    /// Draws the bar in an area.
    pub(super) fn draw(&self, area: Area) -> Vec<Element> {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => vec![dark(area)],
            Self::Bulbs(bulbs) => stripes(bulbs, area),
            Self::Named(name) => {
                let edge = if area.width < BORDERLESS_PX { "none" } else { ink::BOX_EDGE };
                let field = rect(area.x, area.y, area.width, area.height);
                labelled(field.with("fill", ink::BOX).with("stroke", edge), (name, ink::DARK), area)
            }
            Self::Lanelet(side, name) => {
                let tint = side.map_or(ink::BOX, IndicatorState::tint);
                let field = rect(area.x, area.y, area.width, area.height).with("fill", tint);
                let arrow = match side {
                    Some(IndicatorState::Left) => format!("\u{2190} {name}"),
                    Some(IndicatorState::Right) => format!("{name} \u{2192}"),
                    _ => name.clone(),
                };
                // The beginning of an id is another id.
                let fits = |text: &str| text::width(text, SIGN_PX) <= area.width - LABEL_GAP_PX;
                let arrow_alone = arrow.replace(name.as_str(), "");
                let shown = [arrow.as_str(), arrow_alone.trim()].into_iter().find(|text| fits(text));
                labelled(field.with("stroke", ink::BOX_EDGE), (shown.unwrap_or(""), ink::DARK), area)
            }
            Self::Share(share, _) => {
                let height = (area.height * share).max(1.0);
                vec![
                    rect(area.x, area.y + area.height - height, area.width, height)
                        .with("fill", ink::BOX_EDGE)
                        .with("shape-rendering", "crispEdges"),
                ]
            }
            Self::Curve { points, zero, .. } => curve(points, *zero, area),
            Self::Status(level, message) => {
                let (fill, text) = ink::of_level(*level);
                let field = rect(area.x, area.y, area.width, area.height).with("fill", fill);
                labelled(field, (message, text), area)
            }
            Self::Command(kind, indicator) => {
                let (name, fill) = kind.label(*indicator);
                // The beginning of a command says nothing; its colour does.
                let fits = text::width(name, SIGN_PX) <= area.width - LABEL_GAP_PX;
                labelled(kind.field(*indicator, area), (if fits { name } else { "" }, fill), area)
            }
        }
    }
}

/// A thin line at zero, and the curve. Values that would fall on each other are left out.
fn curve(points: &[(f64, f64)], zero: f64, area: Area) -> Vec<Element> {
    let y = |share: f64| area.y + CURVE_EDGE_PX + (1.0 - share) * (area.height - 2.0 * CURVE_EDGE_PX);
    let mut drawn: Vec<(String, String)> = Vec::new();
    for (along, share) in points {
        let point = (pixels(area.x + along * area.width), pixels(y(*share)));
        if drawn.last() != Some(&point) {
            drawn.push(point);
        }
    }
    let path: Vec<_> = drawn.iter().map(|(x, y)| format!("{x},{y}")).collect();
    let curve = Element::new("polyline").with("points", path.join(" ")).with("fill", "none");
    vec![
        line((area.x, y(zero)), (area.x + area.width, y(zero)), ink::GRID),
        curve.with("stroke", ink::CURVE).with("stroke-width", 1.5).with("stroke-linejoin", "round"),
    ]
}

/// A field with as much of its label as fits.
fn labelled(field: Element, (label, fill): (&str, &str), area: Area) -> Vec<Element> {
    let shown = text::fitted(label, SIGN_PX, area.width - LABEL_GAP_PX);
    let label = (!shown.is_empty()).then(|| centred(area, SIGN_PX, &shown).with("fill", fill));
    [field].into_iter().chain(label).collect()
}

/// Hatchings that bars refer to.
pub(super) fn patterns() -> Element {
    let hatchings = Color::ALL.into_iter().flat_map(|color| {
        let pattern = |kind: &str, size_px: f64| {
            Element::new("pattern")
                .with("id", pattern_name(kind, color))
                .with("patternUnits", "userSpaceOnUse")
                .at("width", size_px)
                .at("height", size_px)
        };
        let edge = ink::of(color).edge;
        let stroke = line((0.0, 0.0), (0.0, 6.0), edge).with("stroke-width", 4).with("stroke-opacity", 0.6);
        let dot = Element::new("circle").at("cx", 2.0).at("cy", 2.0).at("r", 0.9).with("fill", edge);
        [
            pattern("flashing", 6.0).with("patternTransform", "rotate(45)").child(stroke),
            pattern("unsure", 4.0).child(dot),
        ]
    });
    Element::new("defs").children(hatchings)
}

/// Bars too narrow to be distinguished.
pub(super) fn dense(area: Area) -> Vec<Element> {
    let fill = format!("url(#{})", pattern_name("flashing", Color::Unknown));
    vec![
        rect(area.x, area.y, area.width, area.height).with("fill", "#ffffff"),
        rect(area.x, area.y, area.width, area.height).with("fill", fill),
    ]
}

fn pattern_name(kind: &str, color: Color) -> String {
    format!("{kind}-{}", color.name())
}

fn dark(area: Area) -> Element {
    let y = area.y + area.height / 2.0;
    line((area.x, y), (area.x + area.width, y), ink::DARK).with("stroke-width", 1.5)
}

fn stripes(bulbs: &BulbSet, area: Area) -> Vec<Element> {
    let count = u32::try_from(bulbs.len()).map_or(1.0, f64::from);
    let height = area.height / count;
    let mut y = area.y;
    let mut drawn = Vec::new();
    for bulb in bulbs.iter() {
        drawn.extend(stripe(bulb, Area { y, height, ..area }));
        y += height;
    }
    drawn
}

fn stripe(bulb: Bulb, area: Area) -> Vec<Element> {
    let ink = ink::of(bulb.color);
    let mut drawn = field(bulb, ink, area);
    let size = SIGN_PX.min(area.height - 2.0);
    if size >= 7.0 {
        let sign = if bulb.status == BulbStatus::SolidOff { ink.edge } else { ink.sign };
        drawn.extend(signs(bulb, ink, sign, area, size));
    }
    drawn
}

fn field(bulb: Bulb, ink: Ink, area: Area) -> Vec<Element> {
    let Area { x, y, width, height } = area;
    let wide = width >= BORDERLESS_PX && height >= BORDERLESS_PX;
    let edge = if wide { ink.edge } else { "none" };
    let field = rect(x, y, width, height).with("stroke", edge).with("stroke-width", 0.75);
    let over = |kind| {
        let fill = format!("url(#{})", pattern_name(kind, bulb.color));
        rect(x, y, width, height).with("fill", fill)
    };
    match bulb.status {
        BulbStatus::SolidOn => vec![field.with("fill", ink.fill)],
        BulbStatus::Flashing => {
            vec![field.with("fill", ink.fill).with("stroke-dasharray", "3 2"), over("flashing")]
        }
        BulbStatus::Unknown => {
            let pale = field.with("fill", ink.fill).with("fill-opacity", 0.5);
            vec![pale.with("stroke-dasharray", "1 2"), over("unsure")]
        }
        // Hollow: the border alone, drawn inside so that neighbours do not cover it.
        BulbStatus::SolidOff if wide => {
            vec![
                rect(x + 1.0, y + 1.0, width - 2.0, height - 2.0)
                    .with("fill", "#ffffff")
                    .with("stroke", ink.edge)
                    .with("stroke-width", 2),
            ]
        }
        BulbStatus::SolidOff => vec![field.with("fill", ink.fill).with("fill-opacity", 0.3)],
    }
}

/// Letter and outline, as much of it as there is room for; the outline goes first.
fn signs(bulb: Bulb, ink: Ink, color: &str, area: Area, size: f64) -> Vec<Element> {
    let outline = |x: f64| outline(bulb, (x, area.y + area.height / 2.0), size, color);
    let middle = area.x + area.width / 2.0;
    let letter = |x: f64| {
        let area = Area { x, width: 0.0, ..area };
        let halo =
            if bulb.status == BulbStatus::Flashing && bulb.color != Color::White { ink.edge } else { "none" };
        let halo = if bulb.color == Color::Yellow && halo != "none" { ink.fill } else { halo };
        centred(area, size, ink.letter)
            .with("font-weight", "bold")
            .with("fill", color)
            .with("stroke", halo)
            .with("stroke-width", 2.5)
            .with("paint-order", "stroke")
    };
    match outline(middle + size * 0.55) {
        Some(second) if area.width >= size * 2.4 => vec![letter(middle - size * 0.6), second],
        Some(_) if area.width >= size + 4.0 => outline(middle).into_iter().collect(),
        None if area.width >= size + 3.0 => vec![letter(middle)],
        Some(_) | None => Vec::new(),
    }
}

/// The sign of a shape; none for the circle, which is the default.
fn outline(bulb: Bulb, (x, y): (f64, f64), size: f64, color: &str) -> Option<Element> {
    let turn_deg = match bulb.shape {
        BulbShape::Circle => return None,
        // The letter is a question mark already.
        BulbShape::Unknown if bulb.color == Color::Unknown => return None,
        BulbShape::Unknown => {
            let area = Area { x, y: y - size, width: 0.0, height: 2.0 * size };
            return Some(centred(area, size, "?").with("font-weight", "bold").with("fill", color));
        }
        BulbShape::Cross => {
            let arm = size * 0.36;
            let path = format!("M{0} {0}L{1} {1}M{0} {1}L{1} {0}", pixels(-arm), pixels(arm));
            let cross = Element::new("path").with("d", path).with("stroke", color).with("stroke-width", 2);
            return Some(cross.with("transform", format!("translate({} {})", pixels(x), pixels(y))));
        }
        BulbShape::Right => 0,
        BulbShape::LowerRight => 45,
        BulbShape::Down => 90,
        BulbShape::LowerLeft => 135,
        BulbShape::Left => 180,
        BulbShape::UpperLeft => 225,
        BulbShape::Up => 270,
        BulbShape::UpperRight => 315,
    };
    let tip = size * 0.5;
    let corners =
        [(-1.0, -0.22), (0.0, -0.22), (0.0, -0.8), (1.0, 0.0), (0.0, 0.8), (0.0, 0.22), (-1.0, 0.22)];
    let points = corners.map(|(x, y)| format!("{},{}", pixels(x * tip), pixels(y * tip))).join(" ");
    let transform = format!("translate({} {}) rotate({turn_deg})", pixels(x), pixels(y));
    let arrow = Element::new("polygon").with("points", points).with("fill", color);
    Some(arrow.with("transform", transform))
}

fn centred(area: Area, size_px: f64, text: &str) -> Element {
    let y = area.y + area.height / 2.0 + size_px * BASE_LINE;
    text_at(area.x + area.width / 2.0, y, size_px, text).with("text-anchor", "middle")
}
