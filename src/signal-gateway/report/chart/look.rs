//! The look of a bar: bulbs, a name, or a command.

use super::command::{CommandKind, IndicatorState};
use super::svg::{Area, BORDERLESS_PX, Element, bordered, line, pixels, rect, text_at};
use super::text;
use crate::report::palette::{self, Lamp, Meaning, Paint};
use gateway_base::diagnostics::Level;
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

/// The state that a bar shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Look {
    /// A light: a stripe per bulb, in the order of keys from the top. Without bulbs it is dark, shown as a
    /// thin line.
    Bulbs(BulbSet),
    /// A box with a name, such as a phase or a lanelet.
    Named(String),
    /// A turn signal or hazard lights.
    Command(CommandKind, IndicatorState),
    /// A value that stands for a state of the lights, with its text.
    Value(IndicatorState, String),
    /// A lanelet with its name, and the side to which it turns.
    Lanelet(Option<IndicatorState>, String),
    /// A quantity as a share of its largest value, 0 to 1, with its text.
    Share(f64, String),
    /// A status with its message.
    Status(Level, String),
    /// A quantity drawn as a line, with its range as text.
    Curve {
        /// Position along the bar and share of the row's range, both 0 to 1.
        points: Vec<(f64, f64)>,
        /// Share at which the quantity is 0.
        zero: f64,
        /// Range of the quantity as text.
        text: String,
    },
}

const STRIPE_PX: f64 = 12.0;
const MAX_STRIPES: u8 = 6;
const SIGN_PX: f64 = 11.0;
/// Height of a curve, pixels.
const CURVE_PX: f64 = 64.0;
/// Margin above the highest and below the lowest value of a curve, pixels.
const CURVE_EDGE_PX: f64 = 3.0;
/// Sum of the gaps left and right of a label, pixels.
const LABEL_GAP_PX: f64 = 6.0;
/// Size of the corner that marks an omitted label, pixels.
const CORNER_PX: f64 = 5.0;
/// Minimum width of a bar with a corner, pixels.
const MIN_CORNER_PX: f64 = 4.5;
/// Minimum width of a bar with hatching, pixels.
const MIN_HATCHED_PX: f64 = 8.0;
/// CSS class of these corners.
pub(super) const LEFT_OUT: &str = "left-out";
/// Distance from the middle of a line of text down to its base line, as a factor of its size.
pub(super) const BASE_LINE: f64 = 0.36;

impl Look {
    /// Returns the look as text.
    pub(super) fn description(&self) -> String {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => "dark".to_owned(),
            Self::Bulbs(bulbs) => bulbs.to_string(),
            Self::Named(name)
            | Self::Value(_, name)
            | Self::Lanelet(_, name)
            | Self::Share(_, name)
            | Self::Status(_, name) => name.clone(),
            Self::Command(kind, indicator) => kind.description(*indicator),
            Self::Curve { text, .. } => text.clone(),
        }
    }

    /// Returns the row height needed to show it, pixels; `single_px` is enough for a line of text.
    pub(super) fn height(&self, single_px: f64) -> f64 {
        match self {
            Self::Bulbs(bulbs) => {
                let stripes = u8::try_from(bulbs.len()).unwrap_or(MAX_STRIPES).min(MAX_STRIPES);
                single_px.max(f64::from(stripes) * STRIPE_PX)
            }
            Self::Named(_)
            | Self::Value(..)
            | Self::Lanelet(..)
            | Self::Share(..)
            | Self::Command(..)
            | Self::Status(..) => single_px,
            Self::Curve { .. } => CURVE_PX.max(single_px),
        }
    }

    /// Returns true if bars of this look may overlap.
    pub(super) fn overlaps(&self) -> bool {
        matches!(self, Self::Command(CommandKind::Desired | CommandKind::Required, _))
    }

    /// Returns its level, if it has one, which ranks it among states too short to be distinguished.
    pub(super) fn severity(&self) -> Option<Level> {
        if let Self::Status(level, _) = self { Some(*level) } else { None }
    }

    /// Returns the colour that represents it among such states.
    pub(super) fn fill(&self) -> Paint {
        match self {
            Self::Bulbs(bulbs) => bulbs.iter().next().map_or(palette::CARD, |bulb| Lamp::of(bulb.color).fill),
            Self::Named(_) | Self::Lanelet(..) | Self::Share(..) | Self::Curve { .. } => palette::PLAIN,
            Self::Command(_, indicator) | Self::Value(indicator, _) => indicator.fill(),
            Self::Status(level, _) => Meaning::of(*level).fill,
        }
    }

    /// Returns the possible texts of its label, longest first, and their colour; `None` if there is no label.
    fn labels(&self) -> Option<(Vec<String>, Paint)> {
        let signed = |sign: &str, text: &str| format!("{sign} {text}").trim().to_owned();
        let texts = match self {
            Self::Bulbs(_) | Self::Share(..) | Self::Curve { .. } => return None,
            Self::Named(name) => vec![name.clone(), beginning(name).to_owned()],
            Self::Lanelet(Some(IndicatorState::Left), name) => vec![format!("← {name}"), "←".to_owned()],
            Self::Lanelet(Some(IndicatorState::Right), name) => vec![format!("{name} →"), "→".to_owned()],
            Self::Lanelet(_, name) => vec![name.clone()],
            Self::Command(kind, indicator) => {
                let sign = indicator.sign();
                vec![signed(sign, kind.label(*indicator)), sign.to_owned()]
            }
            Self::Value(_, text) | Self::Status(_, text) => {
                let sign = if let Self::Value(indicator, _) = self {
                    indicator.sign()
                } else {
                    self.severity().map_or("", |level| Meaning::of(level).sign)
                };
                vec![signed(sign, text), signed(sign, beginning(text)), sign.to_owned()]
            }
        };
        let ink = match self {
            Self::Command(kind, indicator) => kind.ink(*indicator),
            Self::Status(level, _) => Meaning::of(*level).on,
            Self::Value(indicator, _) => CommandKind::Signal.ink(*indicator),
            Self::Bulbs(_) | Self::Named(_) | Self::Lanelet(..) | Self::Share(..) | Self::Curve { .. } => {
                palette::TEXT
            }
        };
        Some((texts, ink)).filter(|(texts, _)| texts.first().is_some_and(|text| !text.is_empty()))
    }

    /// Draws the bar in an area.
    pub(super) fn draw(&self, area: Area) -> Vec<Element> {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => vec![dark(area)],
            Self::Bulbs(bulbs) => stripes(bulbs, area),
            Self::Named(_) | Self::Value(..) | Self::Lanelet(..) | Self::Status(..) => {
                let fill = if let Self::Lanelet(Some(side), _) = self { side.tint() } else { self.fill() };
                let field = bordered(rect(area.x, area.y, area.width, area.height).fill(fill), area);
                self.labelled(field, area)
            }
            Self::Share(share, _) => {
                let height = (area.height * share).max(1.0);
                vec![
                    rect(area.x, area.y + area.height - height, area.width, height)
                        .fill(palette::EDGE)
                        .with("shape-rendering", "crispEdges"),
                ]
            }
            Self::Curve { points, zero, .. } => curve(points, *zero, area),
            Self::Command(kind, indicator) => {
                let field = kind.field(*indicator, area);
                let is_hatched = *kind == CommandKind::Signal && *indicator == IndicatorState::Hazard;
                let hatching = (is_hatched && area.width >= MIN_HATCHED_PX)
                    .then(|| rect(area.x, area.y, area.width, area.height).with("fill", "url(#hazard)"));
                self.labelled(field, area).into_iter().chain(hatching).collect()
            }
        }
    }

    /// Draws a field with the longest label that fits; a corner marks a shortened label.
    fn labelled(&self, field: Element, area: Area) -> Vec<Element> {
        let Some((texts, ink)) = self.labels() else { return vec![field] };
        let room_px = area.width - LABEL_GAP_PX;
        let shown = texts.iter().position(|text| text::fits(text, SIGN_PX, room_px));
        let mut drawn = vec![field];
        if shown != Some(0) {
            drawn.extend(corner(area, ink));
        }
        let text = shown.and_then(|shown| texts.get(shown)).filter(|text| !text.is_empty());
        drawn.extend(text.map(|text| centred(area, SIGN_PX, text).fill(ink)));
        drawn
    }
}

/// Returns the beginning of a text that is comprehensible on its own: the number before a meaning, the
/// finding before its circumstances, or a manoeuvre before its size.
fn beginning(text: &str) -> &str {
    match text.split_once(' ') {
        Some((number, _)) if number.parse::<f64>().is_ok() => number,
        _ => {
            let end = [": ", " to "].into_iter().find_map(|end| text.find(end));
            end.and_then(|end| text.get(..end)).unwrap_or(text)
        }
    }
}

/// Draws the mark of an omitted label in the upper right corner; `None` if there is no room for it either.
pub(super) fn corner(area: Area, ink: Paint) -> Option<Element> {
    let size = CORNER_PX.min(area.width);
    let (right, top) = (area.x + area.width, area.y);
    let points = [(right - size, top), (right, top), (right, top + size)];
    let points = points.map(|(x, y)| format!("{},{}", pixels(x), pixels(y))).join(" ");
    (size >= MIN_CORNER_PX)
        .then(|| Element::new("polygon").with("points", points).fill(ink).with("class", LEFT_OUT))
}

/// Draws a thin line at zero, and the curve. For each pixel column the first, lowest, highest and last value
/// are drawn, so a curve of any length has a bounded number of points.
fn curve(points: &[(f64, f64)], zero: f64, area: Area) -> Vec<Element> {
    let y = |share: f64| area.y + CURVE_EDGE_PX + (1.0 - share) * (area.height - 2.0 * CURVE_EDGE_PX);
    let placed: Vec<_> =
        points.iter().map(|(along, share)| (area.x + along * area.width, y(*share))).collect();
    let mut drawn: Vec<String> = Vec::new();
    for column in placed.chunk_by(|(one, _), (other, _)| one.floor().total_cmp(&other.floor()).is_eq()) {
        let by_height = |one: &&(f64, f64), other: &&(f64, f64)| one.1.total_cmp(&other.1);
        let ends = [column.iter().min_by(by_height), column.iter().max_by(by_height)];
        for (x, y) in column.first().into_iter().chain(ends.into_iter().flatten()).chain(column.last()) {
            let point = format!("{},{}", pixels(*x), pixels(*y));
            if drawn.last() != Some(&point) {
                drawn.push(point);
            }
        }
    }
    let curve = Element::new("polyline").with("points", drawn.join(" ")).with("fill", "none");
    vec![
        line((area.x, y(zero)), (area.x + area.width, y(zero)), palette::LINE),
        curve.stroke(palette::LEFT.fill).with("stroke-width", 1.5).with("stroke-linejoin", "round"),
    ]
}

/// Returns the hatchings to which bars refer.
pub(super) fn patterns() -> Element {
    let hatchings = Color::ALL.into_iter().flat_map(|color| {
        let pattern = |kind: &str, size_px: f64| {
            Element::new("pattern")
                .with("id", pattern_name(kind, color))
                .with("patternUnits", "userSpaceOnUse")
                .at("width", size_px)
                .at("height", size_px)
        };
        let edge = Lamp::of(color).edge;
        let stroke = line((0.0, 0.0), (0.0, 6.0), edge).with("stroke-width", 4).with("stroke-opacity", 0.6);
        let dot = Element::new("circle").at("cx", 2.0).at("cy", 2.0).at("r", 0.9).fill(edge);
        [
            pattern("flashing", 6.0).with("patternTransform", "rotate(45)").child(stroke),
            pattern("unsure", 4.0).child(dot),
        ]
    });
    // Hatching marks hazard lights, which are both sides at once, and several short states.
    let others = [("hazard", palette::HAZARD.on, 0.45), ("dense", palette::CARD, 0.8)];
    let others = others.map(|(name, paint, opacity)| {
        let stroke =
            line((0.0, 0.0), (0.0, 6.0), paint).with("stroke-width", 2).with("stroke-opacity", opacity);
        let pattern = Element::new("pattern").with("id", name).with("patternUnits", "userSpaceOnUse");
        let pattern = pattern.at("width", 6.0).at("height", 6.0).with("patternTransform", "rotate(45)");
        pattern.child(stroke)
    });
    Element::new("defs").children(hatchings).children(others)
}

/// Draws bars too narrow to be distinguished, in the colour of the most important.
pub(super) fn dense(area: Area, fill: Paint) -> Vec<Element> {
    let field = || rect(area.x, area.y, area.width, area.height);
    vec![field().fill(fill), field().with("fill", "url(#dense)")]
}

fn pattern_name(kind: &str, color: Color) -> String {
    format!("{kind}-{}", color.name())
}

fn dark(area: Area) -> Element {
    let y = area.y + area.height / 2.0;
    line((area.x, y), (area.x + area.width, y), palette::TEXT).with("stroke-width", 1.5)
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
    let lamp = Lamp::of(bulb.color);
    let mut drawn = field(bulb, lamp, area);
    let size = SIGN_PX.min(area.height - 2.0);
    if size >= 7.0 {
        let sign = if bulb.status == BulbStatus::SolidOff { lamp.edge } else { lamp.on };
        let signs = signs(bulb, lamp, sign, area, size);
        drawn.extend(corner(area, sign).filter(|_| signs.is_empty()));
        drawn.extend(signs);
    }
    drawn
}

fn field(bulb: Bulb, lamp: Lamp, area: Area) -> Vec<Element> {
    let Area { x, y, width, height } = area;
    let wide = width >= BORDERLESS_PX && height >= BORDERLESS_PX;
    let field = rect(x, y, width, height).with("stroke-width", 0.75);
    let field = if wide { field.stroke(lamp.edge) } else { field.with("stroke", "none") };
    let over = |kind| {
        let fill = format!("url(#{})", pattern_name(kind, bulb.color));
        rect(x, y, width, height).with("fill", fill)
    };
    match bulb.status {
        BulbStatus::SolidOn => vec![field.fill(lamp.fill)],
        BulbStatus::Flashing => {
            vec![field.fill(lamp.fill).with("stroke-dasharray", "3 2"), over("flashing")]
        }
        BulbStatus::Unknown => {
            let pale = field.fill(lamp.fill).with("fill-opacity", 0.5);
            vec![pale.with("stroke-dasharray", "1 2"), over("unsure")]
        }
        // Hollow: the border alone, drawn inside so that neighbours do not cover it.
        BulbStatus::SolidOff if wide => {
            vec![
                rect(x + 1.0, y + 1.0, width - 2.0, height - 2.0)
                    .fill(palette::CARD)
                    .stroke(lamp.edge)
                    .with("stroke-width", 2),
            ]
        }
        BulbStatus::SolidOff => vec![field.fill(lamp.fill).with("fill-opacity", 0.3)],
    }
}

/// Draws letter and outline; if there is not enough room, the outline is omitted first.
fn signs(bulb: Bulb, lamp: Lamp, color: Paint, area: Area, size: f64) -> Vec<Element> {
    let outline = |x: f64| outline(bulb, (x, area.y + area.height / 2.0), size, color);
    let middle = area.x + area.width / 2.0;
    let letter = |x: f64| {
        let area = Area { x, width: 0.0, ..area };
        let letter = centred(area, size, lamp.letter).with("font-weight", "bold").fill(color);
        let letter = letter.with("stroke-width", 2.5).with("paint-order", "stroke");
        match (bulb.status, bulb.color) {
            (BulbStatus::Flashing, Color::Yellow) => letter.stroke(lamp.fill),
            (BulbStatus::Flashing, Color::Green | Color::Red | Color::Unknown) => letter.stroke(lamp.edge),
            _ => letter.with("stroke", "none"),
        }
    };
    match outline(middle + size * 0.55) {
        Some(second) if area.width >= size * 2.4 => vec![letter(middle - size * 0.6), second],
        Some(_) if area.width >= size + 4.0 => outline(middle).into_iter().collect(),
        None if area.width >= size + 3.0 => vec![letter(middle)],
        Some(_) | None => Vec::new(),
    }
}

/// Draws the sign of a shape; `None` for the circle, the default.
fn outline(bulb: Bulb, (x, y): (f64, f64), size: f64, color: Paint) -> Option<Element> {
    let turn_deg = match bulb.shape {
        BulbShape::Circle => return None,
        // The letter is a question mark already.
        BulbShape::Unknown if bulb.color == Color::Unknown => return None,
        BulbShape::Unknown => {
            let area = Area { x, y: y - size, width: 0.0, height: 2.0 * size };
            return Some(centred(area, size, "?").with("font-weight", "bold").fill(color));
        }
        BulbShape::Cross => {
            let arm = size * 0.36;
            let path = format!("M{0} {0}L{1} {1}M{0} {1}L{1} {0}", pixels(-arm), pixels(arm));
            let cross = Element::new("path").with("d", path).stroke(color).with("stroke-width", 2);
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
    let arrow = Element::new("polygon").with("points", points).fill(color);
    Some(arrow.with("transform", transform))
}

fn centred(area: Area, size_px: f64, text: &str) -> Element {
    let y = area.y + area.height / 2.0 + size_px * BASE_LINE;
    text_at(area.x + area.width / 2.0, y, size_px, text).with("text-anchor", "middle")
}
