//! The look of a bar: bulbs, a name, or a command.

use super::command::{CommandKind, IndicatorState};
use super::svg::{Area, BORDERLESS_PX, Element, bordered, horizontal, pixels, rect, text_at, vertical};
use super::text;
use crate::report::palette::{self, Lamp, Meaning, Paint};
use gateway_base::diagnostics::Level;
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

/// The state that a bar shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Look {
    /// A light: a stripe per bulb, in the order of keys from the top; a thin line if it is dark.
    Bulbs(BulbSet),
    /// A box with a name, such as a phase or a lanelet.
    Named(String),
    Command(CommandKind, IndicatorState),
    /// A value that stands for a state of the lights, with its text.
    Value(IndicatorState, String),
    /// A lanelet with its name, and the side to which it turns.
    Lanelet(Option<IndicatorState>, String),
    /// A quantity as a share of its largest value, 0 to 1, with its text.
    Share(f64, String),
    Status(Level, String),
    /// A quantity drawn as a line, with its range as text.
    Curve {
        /// Points of the line, in order of their positions.
        points: Vec<CurvePoint>,
        /// Numbers of the axis, each with its share; empty texts for lines alone.
        ticks: Vec<(f64, String)>,
        /// Range of the quantity as text.
        text: String,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Position along the bar, 0 to 1.
    pub along: f64,
    /// Value as a share of the row's range, 0 to 1.
    pub share: f64,
}

const STRIPE_PX: f64 = 12.0;
const MAX_STRIPES: u8 = 6;
const SIGN_PX: f64 = 11.0;
const CURVE_PX: f64 = 96.0;
/// Margin above the highest and below the lowest value of a curve, pixels.
const CURVE_EDGE_PX: f64 = 6.0;
/// Sum of the gaps left and right of a label, pixels.
const LABEL_GAP_PX: f64 = 6.0;
/// Size of the corner that marks an omitted label, pixels.
const CORNER_PX: f64 = 5.0;
const MIN_CORNER_PX: f64 = 4.5;
const MIN_HATCHED_PX: f64 = 8.0;
/// CSS class of these corners.
pub(super) const LEFT_OUT: &str = "left-out";
/// Distance from the middle of a line of text down to its base line, as a factor of its size.
pub(super) const BASE_LINE: f64 = 0.36;

impl Look {
    pub(super) fn description(&self) -> String {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => "dark".to_owned(),
            Self::Bulbs(bulbs) => bulbs.to_string(),
            Self::Named(name)
            | Self::Value(_, name)
            | Self::Lanelet(_, name)
            | Self::Share(_, name)
            | Self::Status(_, name)
            | Self::Curve { text: name, .. } => name.clone(),
            Self::Command(kind, indicator) => kind.description(*indicator),
        }
    }

    /// Returns the row height needed to show it, pixels; `single_px` is enough for a line of text.
    pub(super) fn height(&self, single_px: f64) -> f64 {
        if let Self::Bulbs(bulbs) = self {
            let stripes = u8::try_from(bulbs.len()).unwrap_or(MAX_STRIPES).min(MAX_STRIPES);
            return single_px.max(f64::from(stripes) * STRIPE_PX);
        }
        if matches!(self, Self::Curve { .. }) { CURVE_PX.max(single_px) } else { single_px }
    }

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
        let shortened =
            |sign: &str, text: &str| vec![signed(sign, text), signed(sign, beginning(text)), sign.to_owned()];
        let (texts, ink) = match self {
            Self::Bulbs(_) | Self::Share(..) | Self::Curve { .. } => return None,
            Self::Named(name) => (vec![name.clone(), beginning(name).to_owned()], palette::TEXT),
            Self::Lanelet(side, name) => (lanelet_labels(*side, name), palette::TEXT),
            Self::Command(kind, indicator) => {
                let sign = indicator.sign();
                (vec![signed(sign, kind.label(*indicator)), sign.to_owned()], kind.ink(*indicator))
            }
            Self::Value(indicator, text) => {
                (shortened(indicator.sign(), text), CommandKind::Signal.ink(*indicator))
            }
            Self::Status(level, text) => {
                let meaning = Meaning::of(*level);
                (shortened(meaning.sign, text), meaning.on)
            }
        };
        Some((texts, ink)).filter(|(texts, _)| texts.first().is_some_and(|text| !text.is_empty()))
    }

    pub(super) fn draw(&self, area: Area) -> Vec<Element> {
        match self {
            Self::Bulbs(bulbs) if bulbs.is_empty() => vec![dark(area)],
            Self::Bulbs(bulbs) => stripes(bulbs, area),
            Self::Named(_) | Self::Value(..) | Self::Lanelet(..) | Self::Status(..) => {
                let fill = if let Self::Lanelet(Some(side), _) = self { side.tint() } else { self.fill() };
                self.labelled(bordered(area.rect().fill(fill), area), area)
            }
            Self::Share(share, _) => {
                let height = (area.height * share).max(1.0);
                let share = rect(area.x, area.y + area.height - height, area.width, height);
                vec![share.fill(palette::EDGE).with("shape-rendering", "crispEdges")]
            }
            Self::Curve { points, ticks, .. } => curve(points, ticks, area),
            Self::Command(kind, indicator) => {
                let field = kind.field(*indicator, area);
                let is_hatched = *kind == CommandKind::Signal && *indicator == IndicatorState::Hazard;
                let hatching = (is_hatched && area.width >= MIN_HATCHED_PX)
                    .then(|| area.rect().with("fill", "url(#hazard)"));
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

fn lanelet_labels(side: Option<IndicatorState>, name: &str) -> Vec<String> {
    match side {
        Some(IndicatorState::Left) => vec![format!("← {name}"), "←".to_owned()],
        Some(IndicatorState::Right) => vec![format!("{name} →"), "→".to_owned()],
        _ => vec![name.to_owned()],
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

/// Draws a thin line at each tick, and the curve. For each pixel column the first, lowest, highest and last
/// value are drawn, so a curve of any length has a bounded number of points.
fn curve(points: &[CurvePoint], ticks: &[(f64, String)], area: Area) -> Vec<Element> {
    let y = |share: f64| area.y + CURVE_EDGE_PX + (1.0 - share) * (area.height - 2.0 * CURVE_EDGE_PX);
    let placed: Vec<_> =
        points.iter().map(|point| (area.x + point.along * area.width, y(point.share))).collect();
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
    let curve = curve.stroke(palette::LEFT.fill).with("stroke-width", 1.5).with("stroke-linejoin", "round");
    let line = |(share, _): &(f64, String)| horizontal(area.x..area.x + area.width, y(*share), palette::LINE);
    let number = |(share, text): &(f64, String)| {
        let size_px = SIGN_PX - 1.0;
        let number =
            text_at(area.x + 3.0, y(*share) + size_px * BASE_LINE, size_px, text).fill(palette::SOFT);
        number.stroke(palette::CARD).with("stroke-width", 3).with("paint-order", "stroke")
    };
    let numbers = ticks.iter().filter(|(_, text)| !text.is_empty()).map(number);
    ticks.iter().map(line).chain([curve]).chain(numbers).collect()
}

pub(super) fn patterns() -> Element {
    let pattern = |name: &str, size_px: f64| {
        let pattern = Element::new("pattern").with("id", name).with("patternUnits", "userSpaceOnUse");
        pattern.at("width", size_px).at("height", size_px)
    };
    let hatching = |name: &str, paint: Paint, width_px: u8, opacity: f64| {
        let stroke = vertical(0.0, 0.0..6.0, paint).with("stroke-width", width_px);
        let pattern = pattern(name, 6.0).with("patternTransform", "rotate(45)");
        pattern.child(stroke.with("stroke-opacity", opacity))
    };
    let of_lamps = Color::ALL.into_iter().flat_map(|color| {
        let edge = Lamp::of(color).edge;
        let dot = Element::new("circle").at("cx", 2.0).at("cy", 2.0).at("r", 0.9).fill(edge);
        let unsure = pattern(&pattern_name("unsure", color), 4.0).child(dot);
        [hatching(&pattern_name("flashing", color), edge, 4, 0.6), unsure]
    });
    // Hatching marks hazard lights, which are both sides at once, and several short states.
    let hazard = hatching("hazard", palette::HAZARD.on, 2, 0.45);
    let dense = hatching("dense", palette::CARD, 2, 0.8);
    Element::new("defs").children(of_lamps).child(hazard).child(dense)
}

/// Draws bars too narrow to be distinguished, in the colour of the most important.
pub(super) fn dense(area: Area, fill: Paint) -> Vec<Element> {
    vec![area.rect().fill(fill), area.rect().with("fill", "url(#dense)")]
}

fn pattern_name(kind: &str, color: Color) -> String {
    format!("{kind}-{}", color.name())
}

fn dark(area: Area) -> Element {
    let y = area.y + area.height / 2.0;
    horizontal(area.x..area.x + area.width, y, palette::TEXT).with("stroke-width", 1.5)
}

fn stripes(bulbs: &BulbSet, area: Area) -> Vec<Element> {
    let count = u32::try_from(bulbs.len()).map_or(1.0, f64::from);
    let height = area.height / count;
    let mut area = Area { height, ..area };
    let mut drawn = Vec::new();
    for bulb in bulbs.iter() {
        drawn.extend(stripe(bulb, area));
        area.y += height;
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
    let field = area.rect().with("stroke-width", 0.75);
    let field = if wide { field.stroke(lamp.edge) } else { field.with("stroke", "none") };
    let over = |kind| area.rect().with("fill", format!("url(#{})", pattern_name(kind, bulb.color)));
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
            let inner = rect(x + 1.0, y + 1.0, width - 2.0, height - 2.0).fill(palette::CARD);
            vec![inner.stroke(lamp.edge).with("stroke-width", 2)]
        }
        BulbStatus::SolidOff => vec![field.fill(lamp.fill).with("fill-opacity", 0.3)],
    }
}

/// Draws letter and outline; if there is not enough room, the outline is omitted first.
fn signs(bulb: Bulb, lamp: Lamp, color: Paint, area: Area, size: f64) -> Vec<Element> {
    let at = |x: f64| Area { x, width: 0.0, ..area };
    let outline = |x: f64| outline(bulb, at(x), size, color);
    let middle = area.x + area.width / 2.0;
    let letter = |x: f64| {
        let area = at(x);
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

/// Draws the sign of a shape in the middle of an area; `None` for the circle, the default.
fn outline(bulb: Bulb, area: Area, size: f64, color: Paint) -> Option<Element> {
    let place =
        format!("translate({} {})", pixels(area.x + area.width / 2.0), pixels(area.y + area.height / 2.0));
    let turn_deg = match bulb.shape {
        BulbShape::Circle => return None,
        // The letter is a question mark already.
        BulbShape::Unknown if bulb.color == Color::Unknown => return None,
        BulbShape::Unknown => {
            return Some(centred(area, size, "?").with("font-weight", "bold").fill(color));
        }
        BulbShape::Cross => {
            let arm = size * 0.36;
            let path = format!("M{0} {0}L{1} {1}M{0} {1}L{1} {0}", pixels(-arm), pixels(arm));
            let cross = Element::new("path").with("d", path).stroke(color).with("stroke-width", 2);
            return Some(cross.with("transform", place));
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
    let arrow = Element::new("polygon").with("points", points).fill(color);
    Some(arrow.with("transform", format!("{place} rotate({turn_deg})")))
}

fn centred(area: Area, size_px: f64, text: &str) -> Element {
    let y = area.y + area.height / 2.0 + size_px * BASE_LINE;
    text_at(area.x + area.width / 2.0, y, size_px, text).with("text-anchor", "middle")
}
