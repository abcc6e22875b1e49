//! The layout of a chart: the position of each of its parts.

use super::axis::{Axis, Tick};
use super::mark::Marks;
use super::svg::{self, Area, Element, horizontal, rect, text_at, vertical};
use super::{Bar, Chart, Lane, Row, legend, look, plan, text};
use crate::report::palette;

/// Width of every chart, pixels, so that documents show it at nearly full size.
const WIDTH_PX: f64 = 880.0;
const MARGIN_PX: f64 = 16.0;
/// Margin right of the axis: half of the last number, pixels.
const RIGHT_PX: f64 = 30.0;
const TITLE_PX: f64 = 16.0;
const LABEL_PX: f64 = 12.0;
const SMALL_PX: f64 = 11.0;
/// Factor by which bold letters are wider.
const BOLD: f64 = 1.1;
const MAX_LANE_LABEL_PX: f64 = 110.0;
const MAX_ROW_LABEL_PX: f64 = 170.0;
const MAX_LINES: usize = 2;
const LABEL_GAP_PX: f64 = 14.0;
const HEADER_GAP_PX: f64 = 6.0;
const LANE_GAP_PX: f64 = 6.0;
const ROW_PX: f64 = 18.0;
const ROW_GAP_PX: f64 = 3.0;
const CAPTION_GAP_PX: f64 = 32.0;
const LEGEND_GAP_PX: f64 = 16.0;
const AXIS_PX: f64 = 22.0;
/// Height of a line of small text, pixels.
const LINE_PX: f64 = 13.0;
const NOTE_PX: f64 = 16.0;
const NOTE_GAP_PX: f64 = 6.0;
const NOTE_INDENT_PX: f64 = 12.0;
const TICK_GAP_PX: f64 = 64.0;
/// Adjacent bars narrower than this are drawn as one; every bar is at least this wide, pixels.
const DENSE_PX: f64 = 2.0;

impl Chart {
    /// Returns the chart as an SVG document. The same data always gives the same text.
    pub fn to_svg(&self) -> String {
        let lanes = self.lanes.iter().map(|lane| lane_label(&lane.label));
        let labels_px = widest(lanes, LABEL_PX * BOLD);
        let rows_px = widest(self.rows().map(Row::lines), SMALL_PX);
        let left = MARGIN_PX + labels_px + LABEL_GAP_PX + rows_px + 8.0;
        let axis = Axis::new(self.along, self.from..self.to, left..WIDTH_PX - RIGHT_PX);
        let marks = Marks::new(&self.marks, &axis);

        let mut content = vec![look::patterns()];
        let mut y = 8.0;
        for line in text::wrapped(&self.title, TITLE_PX * BOLD, WIDTH_PX - 2.0 * MARGIN_PX) {
            y += 20.0;
            let title = text_at(MARGIN_PX, y, TITLE_PX, &line);
            content.push(title.fill(palette::TEXT).with("font-weight", "bold"));
        }
        y += 5.0;
        for line in text::wrapped(&self.subtitle, SMALL_PX, WIDTH_PX - 2.0 * MARGIN_PX) {
            y += LINE_PX;
            content.push(text_at(MARGIN_PX, y, SMALL_PX, &line).fill(palette::SOFT));
        }
        let marks_top = y + HEADER_GAP_PX;
        let top = marks_top + marks.height_above() + AXIS_PX;
        let bottom = top + self.lanes.iter().map(Lane::height).sum::<f64>();
        content.extend(axis.draw_backgrounds(&self.lanes, top));
        content.extend(axis.draw_grid(top, bottom));
        // Below the bars, so that no line runs through a text.
        content.extend(marks.draw(&axis, marks_top, bottom));
        let mut lane_top = top;
        let draw_lane = |lane: &Lane| {
            let drawn = axis.draw_lane(lane, lane_top);
            lane_top += lane.height();
            drawn
        };
        let lanes: Vec<_> = self.lanes.iter().map(draw_lane).collect();
        let has = |class| lanes.iter().any(|lane| lane.has_class(class));
        let legend_marks = legend::Marks { is_dense: has(DENSE), is_left_out: has(look::LEFT_OUT) };
        content.extend(lanes);
        let ticks = axis.ticks(TICK_GAP_PX);
        content.extend(ticks.iter().flat_map(|tick| axis.draw_number(tick, top, bottom)));
        content.push(axis.draw_caption(bottom));
        y = bottom + AXIS_PX + LEGEND_GAP_PX;
        let mut add = |(drawn, height): (Vec<Element>, f64)| {
            content.extend(drawn);
            height
        };
        let looks = self.rows().flat_map(|row| &row.bars).map(|bar| &bar.look);
        y += add(legend::draw(looks, &legend_marks, left..WIDTH_PX - MARGIN_PX, y));
        y += add(marks.draw_list(&axis, left..WIDTH_PX - MARGIN_PX, y));
        if let Some(plan) = &self.plan {
            y += LEGEND_GAP_PX;
            y += add(plan::draw(plan, MARGIN_PX..WIDTH_PX - MARGIN_PX, y));
        }
        y += add(self.draw_notes(y));
        svg::document(&self.title, WIDTH_PX, (y + MARGIN_PX).ceil(), content)
    }

    fn rows(&self) -> impl Iterator<Item = &Row> {
        self.lanes.iter().flat_map(|lane| &lane.rows)
    }

    /// Draws the notes, and returns their height.
    fn draw_notes(&self, top: f64) -> (Vec<Element>, f64) {
        let (mut drawn, mut y) = (Vec::new(), top);
        for note in &self.notes {
            y += NOTE_PX + NOTE_GAP_PX;
            let heading = text_at(MARGIN_PX, y, SMALL_PX, &note.heading);
            drawn.push(heading.fill(palette::TEXT).with("font-weight", "bold"));
            let room_px = WIDTH_PX - 2.0 * MARGIN_PX - NOTE_INDENT_PX;
            for line in note.lines.iter().flat_map(|line| text::wrapped(line, SMALL_PX, room_px)) {
                y += NOTE_PX;
                drawn.push(text_at(MARGIN_PX + NOTE_INDENT_PX, y, SMALL_PX, &line).fill(palette::SOFT));
            }
        }
        (drawn, y - top)
    }
}

const DENSE: &str = "dense";

fn widest(labels: impl Iterator<Item = Vec<String>>, size_px: f64) -> f64 {
    labels.flatten().map(|line| text::width(&line, size_px)).fold(0.0, f64::max)
}

fn lane_label(label: &str) -> Vec<String> {
    text::name_lines(label, LABEL_PX * BOLD, MAX_LANE_LABEL_PX, MAX_LINES)
}

impl Row {
    fn lines(&self) -> Vec<String> {
        text::name_lines(&self.label, SMALL_PX, MAX_ROW_LABEL_PX, MAX_LINES)
    }

    fn height(&self) -> f64 {
        let lines = self.lines().iter().skip(1).fold(ROW_PX, |height, _| height + LINE_PX - 3.0);
        self.bars.iter().map(|bar| bar.look.height(ROW_PX)).fold(lines, f64::max)
    }
}

impl Lane {
    fn height(&self) -> f64 {
        let rows: f64 = self.rows.iter().map(|row| row.height() + ROW_GAP_PX).sum();
        let label = lane_label(&self.label).iter().skip(1).fold(ROW_PX, |height, _| height + LINE_PX);
        (rows - ROW_GAP_PX).max(label) + 2.0 * LANE_GAP_PX
    }
}

impl Axis {
    fn draw_backgrounds(&self, lanes: &[Lane], top: f64) -> Vec<Element> {
        let (mut y, right) = (top, self.edges().end);
        let mut drawn = Vec::new();
        for (index, lane) in lanes.iter().enumerate() {
            let height = lane.height();
            if index % 2 == 0 {
                let shade = rect(MARGIN_PX / 2.0, y, right - MARGIN_PX / 2.0, height);
                drawn.push(shade.fill(palette::PAGE));
            }
            y += height;
        }
        drawn
    }

    /// Draws lines at round values, and a frame.
    fn draw_grid(&self, top: f64, bottom: f64) -> impl Iterator<Item = Element> {
        let tick = move |tick: Tick| vertical(self.x(tick.value), top - 4.0..bottom + 4.0, palette::LINE);
        let frame = [top, bottom].map(|y| horizontal(self.edges(), y, palette::SOFT));
        self.ticks(TICK_GAP_PX).into_iter().map(tick).chain(frame)
    }

    /// Draws the number of a tick, above and below, with a halo that covers marks.
    fn draw_number(&self, tick: &Tick, top: f64, bottom: f64) -> [Element; 2] {
        [top - 8.0, bottom + 16.0].map(|y| {
            let number = text_at(self.x(tick.value), y, SMALL_PX, &tick.label).with("text-anchor", "middle");
            let halo = number.stroke(palette::CARD).with("stroke-width", 4).with("paint-order", "stroke");
            halo.fill(palette::SOFT)
        })
    }

    fn draw_caption(&self, bottom: f64) -> Element {
        let x = self.edges().start - CAPTION_GAP_PX;
        let caption = text_at(x, bottom + 16.0, SMALL_PX, self.caption());
        caption.with("text-anchor", "end").fill(palette::SOFT)
    }

    fn draw_lane(&self, lane: &Lane, top: f64) -> Element {
        let name = Element::new("title").text(&lane.label);
        let mut group = Element::new("g").with("class", "lane").child(name);
        let mut y = top + LANE_GAP_PX + 13.0;
        for line in lane_label(&lane.label) {
            let label = text_at(MARGIN_PX, y, LABEL_PX, &line).fill(palette::TEXT);
            group = group.child(label.with("font-weight", "bold"));
            y += LINE_PX;
        }
        let mut y = top + LANE_GAP_PX;
        for row in &lane.rows {
            let height = row.height();
            let name = Element::new("title").text(&row.label);
            let mut drawn = Element::new("g").with("class", "row").child(name);
            let lines = row.lines();
            let mut base_line =
                y + height / 2.0 + 4.0 - lines.iter().skip(1).fold(0.0, |up, _| up + (LINE_PX - 1.0) / 2.0);
            for line in &lines {
                let label = text_at(self.edges().start - 8.0, base_line, SMALL_PX, line);
                drawn = drawn.child(label.with("text-anchor", "end").fill(palette::SOFT));
                base_line += LINE_PX - 1.0;
            }
            group = group.child(drawn.children(self.draw_bars(row, y, height)));
            y += height + ROW_GAP_PX;
        }
        group
    }

    /// Draws the bars. Bars too short to be distinguished are drawn as one, above the others.
    fn draw_bars(&self, row: &Row, y: f64, height: f64) -> Vec<Element> {
        let width = |from: f64, to: f64| self.x(to) - self.x(from);
        let is_narrow = |bar: &Bar| !bar.look.overlaps() && width(bar.from, bar.to) < DENSE_PX;
        let (mut wide, mut narrow) = (Vec::new(), Vec::new());
        let mut bars = row.bars.iter().peekable();
        while let Some(bar) = bars.next() {
            let mut end = bar.to;
            let mut fill = bar.look.fill();
            let mut severity = bar.look.severity();
            let mut hidden = 0;
            while let Some(next) = bars
                .next_if(|next| is_narrow(bar) && is_narrow(next) && width(end, next.from).abs() < DENSE_PX)
            {
                (end, hidden) = (end.max(next.to), hidden + 1);
                if next.look.severity() > severity {
                    (fill, severity) = (next.look.fill(), next.look.severity());
                } else if severity.is_none() && fill != next.look.fill() {
                    fill = palette::PLAIN;
                }
            }
            let area = Area { x: self.x(bar.from), y, width: width(bar.from, end).max(DENSE_PX), height };
            let (class, what, shapes) = if hidden > 0 {
                let what = format!("{} states, too short to be told apart", hidden + 1);
                (DENSE, what, look::dense(area, fill))
            } else {
                ("bar", bar.look.description(), bar.look.draw(area))
            };
            let title = Element::new("title").text(&format!("{}: {what}", self.interval(bar.from, end)));
            let drawn = Element::new("g").with("class", class).child(title).children(shapes);
            if is_narrow(bar) { narrow.push(drawn) } else { wide.push(drawn) }
        }
        wide.into_iter().chain(narrow).collect()
    }
}

#[cfg(test)]
mod tests;
