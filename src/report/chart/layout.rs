//! The layout of a chart: the position of each of its parts.

use super::axis::{Along, Axis, Tick};
use super::legend;
use super::look;
use super::mark::Marks;
use super::svg::{self, Area, Element, line, rect, text_at};
use super::{Bar, Chart, Lane, Row};
use super::{ink, plan, text};

const MARGIN_PX: f64 = 16.0;
const TITLE_PX: f64 = 16.0;
const LABEL_PX: f64 = 12.0;
const SMALL_PX: f64 = 11.0;
/// Bold letters are wider by this factor.
const BOLD: f64 = 1.1;
const MAX_LABEL_PX: f64 = 240.0;
const LABEL_GAP_PX: f64 = 14.0;
const HEADER_GAP_PX: f64 = 6.0;
const LANE_GAP_PX: f64 = 6.0;
const ROW_PX: f64 = 18.0;
const ROW_GAP_PX: f64 = 3.0;
const CAPTION_GAP_PX: f64 = 32.0;
const LEGEND_GAP_PX: f64 = 16.0;
const AXIS_PX: f64 = 22.0;
const NOTE_PX: f64 = 16.0;
const NOTE_GAP_PX: f64 = 6.0;
const NOTE_INDENT_PX: f64 = 12.0;
/// Least distance of ticks.
const TICK_GAP_PX: f64 = 64.0;
/// Least width for all but the shortest bars: a letter fits.
const READABLE_BAR_PX: f64 = 16.0;
const MIN_WIDTH_PX: f64 = 760.0;
const MAX_WIDTH_PX: f64 = 2_400.0;
/// Width of a chart over metres.
const DISTANCE_PX: f64 = 1_000.0;
/// Bars next to each other that are narrower than this are drawn as one.
const DENSE_PX: f64 = 1.0;

impl Chart {
    /// The chart as an SVG document. The same data gives the same text.
    pub fn to_svg(&self) -> String {
        let labels_px = widest(self.lanes.iter().map(|lane| &lane.label), LABEL_PX);
        let rows_px = widest(self.lanes.iter().flat_map(|lane| &lane.rows).map(|row| &row.label), SMALL_PX);
        let left = MARGIN_PX + labels_px + LABEL_GAP_PX + rows_px + 8.0;
        let axis = Axis::new(self.along, (self.from, self.to), left, self.plot_width());
        let drawing = Drawing { axis, labels_px, rows_px };
        let marks = Marks::new(&self.marks, &drawing.axis);
        let (_, right) = drawing.axis.edges();

        let mut content = vec![look::patterns()];
        let title = text_at(MARGIN_PX, 28.0, TITLE_PX, &self.title);
        content.push(title.with("fill", ink::DARK).with("font-weight", "bold"));
        let mut y = 38.0;
        if !self.subtitle.is_empty() {
            let subtitle = text_at(MARGIN_PX, y + 9.0, SMALL_PX, &self.subtitle);
            content.push(subtitle.with("fill", ink::SOFT));
            y += 18.0;
        }
        let marks_top = y + HEADER_GAP_PX;
        let top = marks_top + marks.height_above() + AXIS_PX;
        let bottom = top + self.lanes.iter().map(Lane::height).sum::<f64>();
        content.extend(drawing.backgrounds(&self.lanes, top));
        content.extend(drawing.grid(top, bottom));
        let mut lane_top = top;
        for lane in &self.lanes {
            content.push(drawing.lane(lane, lane_top));
            lane_top += lane.height();
        }
        content.extend(marks.draw(&drawing.axis, marks_top, bottom));
        let ticks = drawing.axis.ticks(TICK_GAP_PX);
        content.extend(ticks.iter().flat_map(|tick| drawing.number(tick, top, bottom)));
        content.push(drawing.caption(bottom));
        y = bottom + AXIS_PX + LEGEND_GAP_PX;
        let (samples, height) = legend::draw(self.bars().map(|bar| &bar.look), (left, right), y);
        content.extend(samples);
        y += height;
        let (listed, height) = marks.draw_list(&drawing.axis, (left, right), y);
        content.extend(listed);
        y += height;
        if let Some(plan) = &self.plan {
            y += LEGEND_GAP_PX;
            let (drawn, height) = plan::draw(plan, (MARGIN_PX, right), y);
            content.extend(drawn);
            y += height;
        }
        let (noted, height) = self.draw_notes(y);
        content.extend(noted);
        y += height;
        let last_number = ticks.last().map_or(0.0, |tick| text::width(&tick.label, SMALL_PX));
        let overhang = marks.overhang(&drawing.axis).max(last_number / 2.0);
        let headings = [(&self.title, TITLE_PX * BOLD), (&self.subtitle, SMALL_PX)];
        let headings = headings.map(|(text, size)| MARGIN_PX + text::width(text, size)).into_iter();
        let lines = self.notes.iter().flat_map(|note| &note.lines);
        let lines = lines.map(|line| MARGIN_PX + NOTE_INDENT_PX + text::width(line, SMALL_PX));
        let width = headings.chain(lines).fold(right + overhang, f64::max) + MARGIN_PX;
        svg::document(width.ceil(), (y + MARGIN_PX).ceil(), content)
    }

    /// The notes, with their height.
    fn draw_notes(&self, top: f64) -> (Vec<Element>, f64) {
        let (mut drawn, mut y) = (Vec::new(), top);
        for note in &self.notes {
            y += NOTE_PX + NOTE_GAP_PX;
            let heading = text_at(MARGIN_PX, y, SMALL_PX, &note.heading);
            drawn.push(heading.with("fill", ink::DARK).with("font-weight", "bold"));
            for line in &note.lines {
                y += NOTE_PX;
                drawn.push(text_at(MARGIN_PX + NOTE_INDENT_PX, y, SMALL_PX, line).with("fill", ink::SOFT));
            }
        }
        (drawn, y - top)
    }

    /// Over time so wide that nine of ten bars can be read, within limits; hopelessly short ones do not count
    /// as long as there are others.
    fn plot_width(&self) -> f64 {
        if self.along == Along::Distance {
            return DISTANCE_PX;
        }
        let span = self.to - self.from;
        let hopeless = span * READABLE_BAR_PX / MAX_WIDTH_PX / 4.0;
        let all = self.bars().map(|bar| bar.to - bar.from);
        let mut spans: Vec<_> = all.filter(|span| *span > hopeless).collect();
        spans.sort_by(f64::total_cmp);
        let none = if self.bars().next().is_some() { hopeless } else { span };
        let short = spans.get(spans.len() / 10).copied().unwrap_or(none);
        let ideal = READABLE_BAR_PX * span / short;
        if ideal.is_finite() { ideal.clamp(MIN_WIDTH_PX, MAX_WIDTH_PX) } else { MIN_WIDTH_PX }
    }

    fn bars(&self) -> impl Iterator<Item = &Bar> {
        self.lanes.iter().flat_map(|lane| &lane.rows).flat_map(|row| &row.bars)
    }
}

fn widest<'a>(texts: impl Iterator<Item = &'a String>, size_px: f64) -> f64 {
    texts.map(|text| text::width(text, size_px)).fold(0.0, f64::max).min(MAX_LABEL_PX)
}

/// The axis, and the two columns of labels left of it.
struct Drawing {
    axis: Axis,
    labels_px: f64,
    rows_px: f64,
}

impl Row {
    fn height(&self) -> f64 {
        self.bars.iter().map(|bar| bar.look.height(ROW_PX)).fold(ROW_PX, f64::max)
    }
}

impl Lane {
    fn height(&self) -> f64 {
        let rows: f64 = self.rows.iter().map(|row| row.height() + ROW_GAP_PX).sum();
        rows.max(ROW_PX) + 2.0 * LANE_GAP_PX - ROW_GAP_PX
    }
}

impl Drawing {
    fn backgrounds(&self, lanes: &[Lane], top: f64) -> Vec<Element> {
        let (mut y, (_, right)) = (top, self.axis.edges());
        let mut drawn = Vec::new();
        for (index, lane) in lanes.iter().enumerate() {
            let height = lane.height();
            if index % 2 == 0 {
                let shade = rect(MARGIN_PX / 2.0, y, right - MARGIN_PX / 2.0, height);
                drawn.push(shade.with("fill", ink::SHADE));
            }
            y += height;
        }
        drawn
    }

    /// Lines at round values, and a frame.
    fn grid(&self, top: f64, bottom: f64) -> Vec<Element> {
        let mut drawn = Vec::new();
        for tick in self.axis.ticks(TICK_GAP_PX) {
            let x = self.axis.x(tick.value);
            drawn.push(line((x, top - 4.0), (x, bottom + 4.0), ink::GRID));
        }
        let (left, right) = self.axis.edges();
        drawn.extend([top, bottom].map(|y| line((left, y), (right, y), ink::SOFT)));
        drawn
    }

    /// The number of a tick, above and below, with a halo that covers marks.
    fn number(&self, tick: &Tick, top: f64, bottom: f64) -> [Element; 2] {
        [top - 8.0, bottom + 16.0].map(|y| {
            let number =
                text_at(self.axis.x(tick.value), y, SMALL_PX, &tick.label).with("text-anchor", "middle");
            let halo = number.with("stroke", "#ffffff").with("stroke-width", 4).with("paint-order", "stroke");
            halo.with("fill", ink::SOFT)
        })
    }

    fn caption(&self, bottom: f64) -> Element {
        let x = self.axis.edges().0 - CAPTION_GAP_PX;
        let caption = text_at(x, bottom + 16.0, SMALL_PX, self.axis.caption());
        caption.with("text-anchor", "end").with("fill", ink::SOFT)
    }

    fn lane(&self, lane: &Lane, top: f64) -> Element {
        let name = Element::new("title").text(&lane.label);
        let label = text::fitted(&lane.label, LABEL_PX, self.labels_px);
        let label = text_at(MARGIN_PX, top + LANE_GAP_PX + 13.0, LABEL_PX, &label).with("fill", ink::DARK);
        let label = label.with("font-weight", "bold");
        let mut group = Element::new("g").with("class", "lane").child(name).child(label);
        let mut y = top + LANE_GAP_PX;
        for row in &lane.rows {
            let height = row.height();
            let label = text::fitted(&row.label, SMALL_PX, self.rows_px);
            let x = self.axis.edges().0 - 8.0;
            let label = text_at(x, y + height / 2.0 + 4.0, SMALL_PX, &label).with("text-anchor", "end");
            let name = Element::new("title").text(&row.label);
            let drawn =
                Element::new("g").with("class", "row").child(name).child(label.with("fill", ink::SOFT));
            group = group.child(drawn.children(self.bars(row, y, height)));
            y += height + ROW_GAP_PX;
        }
        group
    }

    fn bars(&self, row: &Row, y: f64, height: f64) -> Vec<Element> {
        let axis = &self.axis;
        let is_narrow = |bar: &Bar| !bar.look.overlaps() && axis.x(bar.to) - axis.x(bar.from) < DENSE_PX;
        let mut drawn = Vec::new();
        let mut bars = row.bars.iter().peekable();
        while let Some(bar) = bars.next() {
            let x = axis.x(bar.from);
            let mut end = bar.to;
            let mut hidden = 0;
            while let Some(next) = bars.next_if(|next| {
                is_narrow(bar) && is_narrow(next) && axis.x(next.from) - axis.x(end) < DENSE_PX
            }) {
                (end, hidden) = (next.to, hidden + 1);
            }
            let area = Area { x, y, width: (axis.x(end) - x).max(DENSE_PX), height };
            let (class, what, shapes) = if hidden > 0 {
                ("dense", format!("{} states, too short to be drawn", hidden + 1), look::dense(area))
            } else {
                let shapes = bar.look.draw(area);
                ("bar", bar.look.description(), shapes)
            };
            let title = Element::new("title").text(&format!("{}: {what}", axis.interval(bar.from, end)));
            drawn.push(Element::new("g").with("class", class).child(title).children(shapes));
        }
        drawn
    }
}
