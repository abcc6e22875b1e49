//! A timeline as a picture: a lane for each light with rows of bars, marks across, time below.

use super::axis::Axis;
pub use super::bar::Look;
use super::bar::{self, Place};
use super::ink;
use super::legend;
pub use super::mark::Mark;
use super::mark::{Marks, seconds};
use super::svg::{self, Element, line, rect, words};
use super::text;

/// All there is to see.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimelineChart {
    /// Heading.
    pub title: String,
    /// A line below it; may be empty.
    pub subtitle: String,
    /// Where time begins, seconds.
    pub from_s: f64,
    /// Where it ends, seconds, later.
    pub to_s: f64,
    /// From top to bottom.
    pub lanes: Vec<Lane>,
    /// Across all lanes, in any order.
    pub marks: Vec<Mark>,
}

/// What belongs together, such as one light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// Its name, left of all rows.
    pub label: String,
    /// From top to bottom.
    pub rows: Vec<Row>,
}

/// Bars side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// What it tells of the lane.
    pub label: String,
    /// Ascending in time, without overlap; where there is none nothing is drawn.
    pub bars: Vec<Bar>,
}

/// One state for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Begin, seconds.
    pub from_s: f64,
    /// End, seconds, not before the begin.
    pub to_s: f64,
    /// What it shows.
    pub look: Look,
}

const MARGIN_PX: f64 = 16.0;
const TITLE_PX: f64 = 16.0;
const LABEL_PX: f64 = 12.0;
const SMALL_PX: f64 = 11.0;
const MAX_LABEL_PX: f64 = 240.0;
const ROW_GAP_PX: f64 = 3.0;
const LANE_GAP_PX: f64 = 6.0;
const AXIS_PX: f64 = 22.0;
/// Least distance of ticks.
const TICK_GAP_PX: f64 = 64.0;
/// Least width for all but the shortest bars: a letter fits.
const READABLE_BAR_PX: f64 = 16.0;
const MIN_WIDTH_PX: f64 = 760.0;
const MAX_WIDTH_PX: f64 = 2_400.0;
/// Bars next to each other that are narrower than this are drawn as one.
const DENSE_PX: f64 = 1.0;

impl TimelineChart {
    /// The picture. The same data gives the same text.
    pub fn to_svg(&self) -> String {
        let labels_px = self.widest(|lane| vec![(lane.label.as_str(), LABEL_PX)]).min(MAX_LABEL_PX);
        let rows_px =
            self.widest(|lane| lane.rows.iter().map(|row| (row.label.as_str(), SMALL_PX)).collect());
        let rows_px = rows_px.min(MAX_LABEL_PX);
        let left = MARGIN_PX + labels_px + 14.0 + rows_px + 8.0;
        let axis = Axis::new(self.from_s, self.to_s, left, self.plot_width());
        let marks = Marks::new(&self.marks, &axis);
        let (_, right) = axis.edges();

        let mut content =
            vec![bar::patterns(), words(MARGIN_PX, 28.0, TITLE_PX, &self.title).with("fill", ink::DARK)];
        if let Some(title) = content.last_mut() {
            *title = title.clone().with("font-weight", "bold");
        }
        let mut y = 38.0;
        if !self.subtitle.is_empty() {
            content.push(words(MARGIN_PX, y + 9.0, SMALL_PX, &self.subtitle).with("fill", ink::SOFT));
            y += 18.0;
        }
        let marks_top = y + 6.0;
        let lanes_top = marks_top + marks.height_above() + AXIS_PX;
        let lanes_bottom = lanes_top + self.lanes.iter().map(lane_height).sum::<f64>();
        content.extend(self.backgrounds(lanes_top, right));
        content.extend(grid(&axis, lanes_top, lanes_bottom));
        let gutter = Gutter { labels_px, rows_px };
        let mut lane_top = lanes_top;
        for lane in &self.lanes {
            content.push(draw_lane(lane, lane_top, &axis, &gutter));
            lane_top += lane_height(lane);
        }
        content.extend(marks.draw(&axis, marks_top, lanes_bottom));
        content.extend(numbers(&axis, lanes_top, lanes_bottom));
        y = lanes_bottom + AXIS_PX + 16.0;
        let (samples, height) = legend::draw(&self.legend(), left, right, y);
        content.extend(samples);
        y += height;
        let (listed, height) = marks.draw_list(left, right, y);
        content.extend(listed);
        y += height;
        let last_number =
            axis.ticks(TICK_GAP_PX).last().map_or(0.0, |tick| text::width(&tick.label, SMALL_PX));
        let headings = [(&self.title, TITLE_PX * 1.1), (&self.subtitle, SMALL_PX)];
        let headings = headings.map(|(text, size)| MARGIN_PX + text::width(text, size)).into_iter();
        let width = headings.fold(right + marks.overhang(&axis).max(last_number / 2.0), f64::max) + MARGIN_PX;
        svg::document(width.ceil(), (y + MARGIN_PX).ceil(), content)
    }

    /// So wide that nine of ten bars can be read, within limits; hopelessly short ones do not count
    /// as long as there are others.
    fn plot_width(&self) -> f64 {
        let span = self.to_s - self.from_s;
        let hopeless = span * READABLE_BAR_PX / MAX_WIDTH_PX / 4.0;
        let all = self.bars().map(|bar| bar.to_s - bar.from_s);
        let mut spans: Vec<_> = all.filter(|span| *span > hopeless).collect();
        spans.sort_by(f64::total_cmp);
        let none = if self.bars().next().is_some() { hopeless } else { span };
        let short = spans.get(spans.len() / 10).copied().unwrap_or(none);
        let wanted = READABLE_BAR_PX * span / short;
        if wanted.is_finite() { wanted.clamp(MIN_WIDTH_PX, MAX_WIDTH_PX) } else { MIN_WIDTH_PX }
    }

    fn bars(&self) -> impl Iterator<Item = &Bar> {
        self.lanes.iter().flat_map(|lane| &lane.rows).flat_map(|row| &row.bars)
    }

    fn widest<'a>(&'a self, texts: impl Fn(&'a Lane) -> Vec<(&'a str, f64)>) -> f64 {
        self.lanes.iter().flat_map(texts).map(|(text, size)| text::width(text, size)).fold(0.0, f64::max)
    }

    fn legend(&self) -> Vec<(Look, String)> {
        legend::entries(self.bars().map(|bar| &bar.look))
    }

    fn backgrounds(&self, top: f64, right: f64) -> Vec<Element> {
        let mut y = top;
        let mut drawn = Vec::new();
        for (index, lane) in self.lanes.iter().enumerate() {
            let height = lane_height(lane);
            if index % 2 == 0 {
                drawn
                    .push(rect(MARGIN_PX / 2.0, y, right - MARGIN_PX / 2.0, height).with("fill", ink::SHADE));
            }
            y += height;
        }
        drawn
    }
}

/// Widths of the two columns left of the axis.
struct Gutter {
    labels_px: f64,
    rows_px: f64,
}

fn row_height(row: &Row) -> f64 {
    row.bars.iter().map(|bar| bar.look.height()).fold(18.0, f64::max)
}

fn lane_height(lane: &Lane) -> f64 {
    let rows: f64 = lane.rows.iter().map(|row| row_height(row) + ROW_GAP_PX).sum();
    rows.max(18.0) + 2.0 * LANE_GAP_PX - ROW_GAP_PX
}

/// Lines at round times.
fn grid(axis: &Axis, top: f64, bottom: f64) -> Vec<Element> {
    let ticks = axis.ticks(TICK_GAP_PX).into_iter().map(|tick| axis.x(tick.value));
    let mut drawn: Vec<_> = ticks.map(|x| line((x, top - 4.0), (x, bottom + 4.0), ink::GRID)).collect();
    let (left, right) = axis.edges();
    drawn.extend([top, bottom].map(|y| line((left, y), (right, y), ink::SOFT)));
    drawn
}

/// Their numbers, above and below; where a mark goes through, it gives way.
fn numbers(axis: &Axis, top: f64, bottom: f64) -> Vec<Element> {
    let mut drawn = Vec::new();
    let ys = [top - 8.0, bottom + 16.0];
    for tick in axis.ticks(TICK_GAP_PX) {
        let number = |y| words(axis.x(tick.value), y, SMALL_PX, &tick.label).with("text-anchor", "middle");
        let halo = |number: Element| number.with("stroke", "#ffffff").with("stroke-width", 4);
        let number = |y| halo(number(y)).with("paint-order", "stroke").with("fill", ink::SOFT);
        drawn.extend(ys.map(number));
    }
    let caption = words(axis.edges().0 - 32.0, bottom + 16.0, SMALL_PX, axis.caption());
    drawn.push(caption.with("text-anchor", "end").with("fill", ink::SOFT));
    drawn
}

fn draw_lane(lane: &Lane, top: f64, axis: &Axis, gutter: &Gutter) -> Element {
    let name = Element::new("title").text(&lane.label);
    let label = text::fitted(&lane.label, LABEL_PX, gutter.labels_px);
    let label = words(MARGIN_PX, top + LANE_GAP_PX + 13.0, LABEL_PX, &label).with("fill", ink::DARK);
    let mut group =
        Element::new("g").with("class", "lane").child(name).child(label.with("font-weight", "bold"));
    let mut y = top + LANE_GAP_PX;
    for row in &lane.rows {
        let height = row_height(row);
        let label = text::fitted(&row.label, SMALL_PX, gutter.rows_px);
        let x = axis.edges().0 - 8.0;
        let label = words(x, y + height / 2.0 + 4.0, SMALL_PX, &label).with("text-anchor", "end");
        let name = Element::new("title").text(&row.label);
        let drawn = Element::new("g").with("class", "row").child(name).child(label.with("fill", ink::SOFT));
        group = group.child(drawn.children(draw_bars(row, y, height, axis)));
        y += height + ROW_GAP_PX;
    }
    group
}

fn draw_bars(row: &Row, y: f64, height: f64, axis: &Axis) -> Vec<Element> {
    let mut drawn = Vec::new();
    let mut bars = row.bars.iter().peekable();
    while let Some(bar) = bars.next() {
        let x = axis.x(bar.from_s);
        let is_narrow = |bar: &Bar| axis.x(bar.to_s) - axis.x(bar.from_s) < DENSE_PX;
        let mut end = bar.to_s;
        let mut hidden = 0;
        while let Some(next) = bars
            .next_if(|next| is_narrow(bar) && is_narrow(next) && axis.x(next.from_s) - axis.x(end) < DENSE_PX)
        {
            (end, hidden) = (next.to_s, hidden + 1);
        }
        let place = Place { x, y, width: (axis.x(end) - x).max(DENSE_PX), height };
        let (class, what, shapes) = if hidden > 0 {
            ("dense", format!("{} states, too short to be drawn", hidden + 1), bar::dense(place))
        } else {
            ("bar", bar.look.description(), bar.look.draw(place))
        };
        let told = format!("{} s to {} s: {what}", seconds(bar.from_s), seconds(end));
        let group = Element::new("g").with("class", class).child(Element::new("title").text(&told));
        drawn.push(group.children(shapes));
    }
    drawn
}
