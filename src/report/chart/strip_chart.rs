//! A path as a strip: what lies along it, sections where something is wanted, signals over metres.

use super::axis::Axis;
use super::ink;
use super::svg::{self, Element, line, rect, words};
use super::text;

/// All there is to see.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StripChart {
    /// Heading.
    pub title: String,
    /// A line below it; may be empty.
    pub subtitle: String,
    /// Where the strip begins, metres.
    pub from_m: f64,
    /// Where it ends, metres, farther.
    pub to_m: f64,
    /// From top to bottom.
    pub groups: Vec<Group>,
}

/// Rows that belong together, such as one behaviour.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Group {
    /// Its name.
    pub label: String,
    /// From top to bottom.
    pub rows: Vec<Row>,
}

/// Pieces side by side, or one over the other: later ones lie on top.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// What it tells.
    pub label: String,
    /// In any order.
    pub pieces: Vec<Piece>,
}

/// A piece of the strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Begin, metres.
    pub from_m: f64,
    /// End, metres.
    pub to_m: f64,
    /// What it looks like.
    pub look: Look,
    /// What is written in it; may be empty.
    pub text: String,
}

/// What a piece looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// A part of the road or a deed of the planner.
    Plain,
    /// A signal to this side.
    Signal(IndicatorState),
    /// A section in which a side may be signalled.
    Desired(IndicatorState),
    /// A section in which a side must be signalled.
    Required(IndicatorState),
    /// What was expected.
    Expected(IndicatorState),
}

/// What a signal says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum IndicatorState {
    /// Left.
    Left,
    /// Right.
    Right,
    /// Neither.
    Off,
    /// Hazard lights.
    Hazard,
    /// No command.
    Nothing,
}

const MARGIN_PX: f64 = 16.0;
const ROW_PX: f64 = 20.0;
const GAP_PX: f64 = 4.0;
const LABEL_PX: f64 = 12.0;
const SMALL_PX: f64 = 11.0;
const WIDTH_PX: f64 = 1_000.0;
const TICK_GAP_PX: f64 = 64.0;
const SAMPLE_PX: f64 = 30.0;

impl StripChart {
    /// The picture. The same data gives the same text.
    pub fn to_svg(&self) -> String {
        let widest = |texts: &mut dyn Iterator<Item = f64>| texts.fold(0.0, f64::max);
        let labels_px =
            widest(&mut self.groups.iter().map(|group| text::width(&group.label, LABEL_PX) * 1.1));
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        let rows_px = widest(&mut rows.map(|row| text::width(&row.label, SMALL_PX)));
        let left = MARGIN_PX + labels_px + 12.0 + rows_px + 8.0;
        let axis = Axis::of_metres(self.from_m, self.to_m, left, WIDTH_PX);
        let (_, right) = axis.edges();
        let mut content = vec![
            words(MARGIN_PX, 28.0, 16.0, &self.title).with("fill", ink::DARK).with("font-weight", "bold"),
            words(MARGIN_PX, 46.0, SMALL_PX, &self.subtitle).with("fill", ink::SOFT),
        ];
        let top = 78.0;
        let bottom = top + self.groups.iter().map(height).sum::<f64>();
        let mut y = top;
        for (index, group) in self.groups.iter().enumerate() {
            if index % 2 == 0 {
                let shade = rect(MARGIN_PX / 2.0, y, right - MARGIN_PX / 2.0, height(group));
                content.push(shade.with("fill", ink::SHADE));
            }
            y += height(group);
        }
        for tick in axis.ticks(TICK_GAP_PX) {
            let x = axis.x(tick.value);
            content.push(line((x, top - 4.0), (x, bottom + 4.0), ink::GRID));
            for y in [top - 8.0, bottom + 16.0] {
                let number = words(x, y, SMALL_PX, &tick.label).with("text-anchor", "middle");
                content.push(number.with("fill", ink::SOFT));
            }
        }
        let caption = words(left - 20.0, bottom + 16.0, SMALL_PX, axis.caption());
        content.push(caption.with("text-anchor", "end").with("fill", ink::SOFT));
        let mut y = top;
        for group in &self.groups {
            content.push(draw_group(group, y, &axis));
            y += height(group);
        }
        y = bottom + 34.0;
        let (samples, legend_px) = self.legend(left, right, y);
        content.extend(samples);
        let subtitle_px = MARGIN_PX + text::width(&self.subtitle, SMALL_PX);
        let title_px = MARGIN_PX + text::width(&self.title, 16.0) * 1.1;
        let width = (right + 20.0).max(subtitle_px).max(title_px) + MARGIN_PX;
        svg::document(width.ceil(), (y + legend_px + MARGIN_PX).ceil(), content)
    }

    /// Samples of the looks that occur.
    fn legend(&self, left: f64, right: f64, top: f64) -> (Vec<Element>, f64) {
        let pieces = self.groups.iter().flat_map(|group| &group.rows).flat_map(|row| &row.pieces);
        let mut looks: Vec<Look> =
            pieces.map(|piece| piece.look).filter(|look| *look != Look::Plain).collect();
        looks.sort_unstable();
        looks.dedup();
        let (mut x, mut y) = (left, top);
        let mut drawn = Vec::new();
        for look in looks {
            let meaning = look.meaning();
            let width = SAMPLE_PX + 6.0 + text::width(&meaning, SMALL_PX) + 16.0;
            if x + width > right && x > left {
                (x, y) = (left, y + 24.0);
            }
            drawn.push(look.field(x, y, SAMPLE_PX, ROW_PX));
            drawn.push(words(x + SAMPLE_PX + 6.0, y + 14.0, SMALL_PX, &meaning).with("fill", ink::SOFT));
            x += width;
        }
        (drawn, y + 24.0 - top)
    }
}

impl Look {
    fn meaning(self) -> String {
        match self {
            Self::Plain => "road".to_owned(),
            Self::Signal(indicator) => format!("signal: {}", indicator.name()),
            Self::Desired(indicator) => format!("desired section, {}", indicator.name()),
            Self::Required(indicator) => format!("required section, {}", indicator.name()),
            Self::Expected(indicator) => format!("expected: {}", indicator.name()),
        }
    }

    /// The box; desired sections and expectations leave room above and below.
    fn field(self, x: f64, y: f64, width: f64, height: f64) -> Element {
        let slim = |share: f64| {
            let height_px = height * share;
            rect(x, y + (height - height_px) / 2.0, width, height_px)
        };
        match self {
            Self::Plain => slim(1.0).with("fill", ink::BOX).with("stroke", ink::BOX_EDGE),
            Self::Signal(indicator) => {
                let (fill, edge) = indicator.inks();
                slim(1.0).with("fill", fill).with("stroke", edge).with("stroke-width", 0.75)
            }
            Self::Desired(indicator) => {
                let (fill, edge) = indicator.inks();
                slim(0.5).with("fill", fill).with("fill-opacity", 0.3).with("stroke", edge)
            }
            Self::Required(indicator) => {
                let (fill, edge) = indicator.inks();
                slim(1.0).with("fill", fill).with("fill-opacity", 0.75).with("stroke", edge)
            }
            Self::Expected(indicator) => {
                let (fill, edge) = indicator.inks();
                slim(0.4).with("fill", fill).with("fill-opacity", 0.6).with("stroke", edge)
            }
        }
    }

    const fn ink(self) -> &'static str {
        match self {
            Self::Signal(IndicatorState::Left | IndicatorState::Right | IndicatorState::Hazard)
            | Self::Required(IndicatorState::Left | IndicatorState::Right | IndicatorState::Hazard) => {
                "#ffffff"
            }
            Self::Signal(IndicatorState::Off | IndicatorState::Nothing)
            | Self::Required(IndicatorState::Off | IndicatorState::Nothing)
            | Self::Plain
            | Self::Desired(_)
            | Self::Expected(_) => ink::DARK,
        }
    }
}

impl IndicatorState {
    /// As the command is called.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "LEFT",
            Self::Right => "RIGHT",
            Self::Off => "DISABLE",
            Self::Hazard => "hazard lights",
            Self::Nothing => "NO_COMMAND",
        }
    }

    /// Blue and orange stay apart for colour-blind eyes.
    const fn inks(self) -> (&'static str, &'static str) {
        match self {
            Self::Left => ("#2166ac", "#123c66"),
            Self::Right => ("#d95f0e", "#8a3b06"),
            Self::Off => ("#e4e8ec", "#8a9bb0"),
            Self::Hazard => ("#b2182b", "#6d0d19"),
            Self::Nothing => ("#ffffff", "#52606d"),
        }
    }
}

fn height(group: &Group) -> f64 {
    // At most some hundred rows.
    let rows = u32::try_from(group.rows.len().max(1)).map_or(1.0, f64::from);
    rows * (ROW_PX + GAP_PX) + 2.0 * GAP_PX
}

fn draw_group(group: &Group, top: f64, axis: &Axis) -> Element {
    let label = words(MARGIN_PX, top + GAP_PX + 15.0, LABEL_PX, &group.label);
    let name = Element::new("title").text(&group.label);
    let label = label.with("fill", ink::DARK).with("font-weight", "bold");
    let mut drawn = Element::new("g").with("class", "group").child(name).child(label);
    let mut y = top + GAP_PX + GAP_PX / 2.0;
    for row in &group.rows {
        let label = words(axis.edges().0 - 8.0, y + 14.0, SMALL_PX, &row.label).with("text-anchor", "end");
        let name = Element::new("title").text(&row.label);
        let of_row = Element::new("g").with("class", "row").child(name).child(label.with("fill", ink::SOFT));
        drawn = drawn.child(of_row.children(row.pieces.iter().map(|piece| draw_piece(piece, y, axis))));
        y += ROW_PX + GAP_PX;
    }
    drawn
}

fn draw_piece(piece: &Piece, y: f64, axis: &Axis) -> Element {
    let (x, to) = (axis.x(piece.from_m), axis.x(piece.to_m));
    let width = (to - x).max(1.0);
    let told = if piece.look == Look::Plain { piece.text.clone() } else { piece.look.meaning() };
    let told = format!("{:.2} m to {:.2} m: {told}", piece.from_m, piece.to_m);
    let drawn = Element::new("g").with("class", "piece").child(Element::new("title").text(&told));
    let drawn = drawn.child(piece.look.field(x, y, width, ROW_PX));
    let shown = text::fitted(&piece.text, SMALL_PX, width - 6.0);
    if shown.is_empty() {
        return drawn;
    }
    let middle = words(x + width / 2.0, y + ROW_PX / 2.0 + 4.0, SMALL_PX, &shown);
    drawn.child(middle.with("text-anchor", "middle").with("fill", piece.look.ink()))
}
