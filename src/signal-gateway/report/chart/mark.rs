//! Vertical marks. Their texts are staggered above the lanes or, if they do not fit there, replaced by
//! numbers with a list below.

use std::ops::Range;

use super::axis::Axis;
use super::svg::{Element, text_at, vertical};
use super::{Mark, text};
use crate::report::palette;

const SIZE_PX: f64 = 11.0;
const LEVEL_PX: f64 = 15.0;
const MAX_LEVELS: usize = 6;
const MAX_PX: f64 = 280.0;
const TEXT_GAP_PX: f64 = 4.0;
const NUMBER_GAP_PX: f64 = 4.0;
/// Lines closer together than this are drawn once, pixels.
const MIN_LINE_GAP_PX: f64 = 2.0;
const LINE_PX: f64 = 15.0;
const COLUMN_GAP_PX: f64 = 28.0;
const MAX_LISTED: usize = 120;

#[derive(Debug)]
pub(super) struct Marks<'a> {
    moments: Vec<Moment<'a>>,
    /// Step of each moment from the top; empty if the moments are numbered.
    levels: Vec<usize>,
}

#[derive(Debug)]
struct Moment<'a> {
    at_s: f64,
    texts: Vec<&'a str>,
}

/// One line of the list: number, time, text. Only the first line of a moment has number and time.
struct Listed {
    number: String,
    time: String,
    text: String,
}

impl<'a> Marks<'a> {
    pub(super) fn new(marks: &'a [Mark], axis: &Axis) -> Self {
        let mut marks: Vec<_> = marks.iter().collect();
        marks.sort_by(|one, other| one.at.total_cmp(&other.at));
        let mut moments: Vec<Moment<'_>> = Vec::new();
        for Mark { at: at_s, text } in marks {
            match moments.last_mut().filter(|moment| moment.at_s.total_cmp(at_s).is_eq()) {
                Some(moment) => moment.texts.push(text),
                None => moments.push(Moment { at_s: *at_s, texts: vec![text] }),
            }
        }
        let levels = levels(&moments, axis).unwrap_or_default();
        Self { moments, levels }
    }

    /// Returns the height of the texts above the lanes, pixels.
    pub(super) fn height_above(&self) -> f64 {
        let numbers = usize::from(!self.moments.is_empty());
        pixels(self.levels.iter().max().map_or(numbers, |top| top + 1)) * LEVEL_PX
    }

    /// Draws lines and texts from `top` to `bottom`; the lanes begin below the texts.
    pub(super) fn draw(&self, axis: &Axis, top: f64, bottom: f64) -> Vec<Element> {
        let mut drawn = Vec::new();
        let numbers = self.numbers(axis);
        let mut last_x = f64::NEG_INFINITY;
        for (index, moment) in self.moments.iter().enumerate() {
            let x = axis.x(moment.at_s);
            let level = self.levels.get(index).copied();
            let is_numbered = numbers.iter().any(|(first, _)| *first == index);
            // Lines at the same place are drawn once; each moment still has its entry in the list.
            if level.is_none() && !is_numbered && x - last_x < MIN_LINE_GAP_PX {
                continue;
            }
            last_x = x;
            let y = top + pixels(level.unwrap_or(0)) * LEVEL_PX;
            let title = format!("{}: {}", axis.position(moment.at_s), moment.text());
            let line_top = if level.is_some() { y } else { y + LEVEL_PX - 2.0 };
            let stroke = vertical(x, line_top..bottom, palette::FOCUS);
            let mut group = Element::new("g").with("class", "mark").fill(palette::FOCUS);
            group = group.child(Element::new("title").text(&title));
            group = group.child(stroke.with("stroke-dasharray", "4 3").with("stroke-opacity", 0.75));
            if level.is_some() {
                group = group.child(text_at(x + TEXT_GAP_PX, y + SIZE_PX, SIZE_PX, &moment.text()));
            } else if let Some((_, number)) = numbers.iter().find(|(first, _)| *first == index) {
                let number = text_at(x, y + SIZE_PX - 1.0, SIZE_PX, number);
                group = group.child(number.with("text-anchor", "middle"));
            }
            drawn.push(group);
        }
        drawn
    }

    /// Returns the numbers with the positions of their moments, joined where they would overlap, as `3–5`.
    fn numbers(&self, axis: &Axis) -> Vec<(usize, String)> {
        let mut groups: Vec<(usize, usize)> = Vec::new();
        let label = |(first, last): (usize, usize)| {
            if first == last { (first + 1).to_string() } else { format!("{}\u{2013}{}", first + 1, last + 1) }
        };
        let reach = |group: (usize, usize)| {
            let (x, half) = (axis.x(self.moments[group.0].at_s), text::width(&label(group), SIZE_PX) / 2.0);
            (x - half, x + half + NUMBER_GAP_PX)
        };
        for index in 0..self.moments.len() {
            groups.push((index, index));
            // A joined number is wider and may reach the previous one.
            while let [.., before, last] = groups.as_slice()
                && reach(*last).0 < reach(*before).1
            {
                let joined = (before.0, last.1);
                groups.truncate(groups.len() - 2);
                groups.push(joined);
            }
        }
        groups.into_iter().map(|group| (group.0, label(group))).collect()
    }

    /// Draws the list below the lanes, in as many columns as fit, and returns its height.
    pub(super) fn draw_list(&self, axis: &Axis, across: Range<f64>, top: f64) -> (Vec<Element>, f64) {
        let width = |lines: &[Listed], part: fn(&Listed) -> &str| {
            lines.iter().map(|line| text::width(part(line), SIZE_PX)).fold(0.0, f64::max)
        };
        let (listed, width_px) = (self.list(axis), across.end - across.start);
        let (numbers_px, times_px) = (width(&listed, |line| &line.number), width(&listed, |line| &line.time));
        let room_px = width_px - numbers_px - times_px - 20.0;
        let lines: Vec<Listed> = listed.into_iter().flat_map(|line| line.wrapped(room_px)).collect();
        let texts_px = width(&lines, |line| &line.text).min(room_px);
        let column_px = numbers_px + 10.0 + times_px + 10.0 + texts_px + COLUMN_GAP_PX;
        let mut rows = lines.len();
        while rows > 8 && column_px * pixels(lines.len().div_ceil(rows - 1)) <= width_px {
            rows -= 1;
        }
        let mut drawn = Vec::new();
        for (index, line) in lines.iter().enumerate() {
            let x = across.start + pixels(index / rows.max(1)) * column_px;
            let y = top + pixels(index % rows.max(1) + 1) * LINE_PX;
            let times_x = x + numbers_px + 10.0 + times_px;
            let ends = [(x + numbers_px, &line.number), (times_x, &line.time)];
            let ends = ends.into_iter().filter(|(_, text)| !text.is_empty());
            drawn.extend(ends.map(|(x, text)| text_at(x, y, SIZE_PX, text).with("text-anchor", "end")));
            drawn.push(text_at(times_x + 10.0, y, SIZE_PX, &line.text));
        }
        let drawn = drawn.into_iter().map(|text| text.fill(palette::FOCUS)).collect();
        (drawn, pixels(rows) * LINE_PX)
    }

    fn list(&self, axis: &Axis) -> Vec<Listed> {
        if !self.levels.is_empty() {
            return Vec::new();
        }
        let all = self.moments.iter().enumerate().flat_map(|(index, moment)| {
            moment.texts.iter().enumerate().map(move |(position, text)| {
                let first = |text: String| if position == 0 { text } else { String::new() };
                let (number, time) = (first((index + 1).to_string()), first(axis.position(moment.at_s)));
                Listed { number, time, text: (*text).to_owned() }
            })
        });
        let mut lines: Vec<_> = all.collect();
        if lines.len() > MAX_LISTED {
            let text = format!("… and {} more", lines.len() - MAX_LISTED);
            lines.truncate(MAX_LISTED);
            lines.push(Listed { number: String::new(), time: String::new(), text });
        }
        lines
    }
}

impl Listed {
    fn wrapped(self, room_px: f64) -> impl Iterator<Item = Self> {
        let Self { mut number, mut time, text } = self;
        let below =
            move |text| Self { number: std::mem::take(&mut number), time: std::mem::take(&mut time), text };
        text::wrapped(&text, SIZE_PX, room_px).into_iter().map(below)
    }
}

impl Moment<'_> {
    fn text(&self) -> String {
        self.texts.join("; ")
    }

    fn width(&self) -> f64 {
        text::width(&self.text(), SIZE_PX)
    }
}

/// Returns a step for each text such that no line crosses a text: to the right of a mark, lower steps are
/// free. `None` if they do not fit, even beyond the right end of the axis.
fn levels(moments: &[Moment<'_>], axis: &Axis) -> Option<Vec<usize>> {
    let mut ends = [f64::NEG_INFINITY; MAX_LEVELS];
    let level = |moment: &Moment<'_>| {
        let (x, width) = (axis.x(moment.at_s), moment.width());
        let level = ends.iter().rposition(|end| *end > x).map_or(0, |taken| taken + 1);
        *ends.get_mut(level).filter(|_| width <= MAX_PX)? = x + 10.0 + width;
        Some(level)
    };
    let levels: Option<Vec<_>> = moments.iter().map(level).collect();
    let right = axis.edges().end;
    let fits = moments.iter().all(|moment| axis.x(moment.at_s) + TEXT_GAP_PX + moment.width() <= right);
    levels.filter(|_| fits)
}

/// Converts a small number to a factor for pixels.
fn pixels(number: usize) -> f64 {
    u32::try_from(number).map_or(0.0, f64::from)
}

#[cfg(test)]
mod tests {
    use super::super::axis::Along;
    use super::*;

    fn mark(at_s: f64, text: &str) -> Mark {
        Mark { at: at_s, text: text.into() }
    }

    #[test]
    fn texts_step_down_where_the_one_before_is_in_the_way() {
        let axis = Axis::new(Along::Time, 0.0..10.0, 0.0..1_000.0);
        let given = [mark(8.0, "d"), mark(1.0, "a long text"), mark(1.2, "b"), mark(1.2, "c")];
        let marks = Marks::new(&given, &axis);
        assert_eq!(marks.levels, [0, 1, 0]);
        assert_eq!((marks.moments[1].text(), marks.list(&axis).len()), ("b; c".to_owned(), 0));
        assert!((marks.height_above() - 2.0 * LEVEL_PX).abs() < 1e-9);
    }

    #[test]
    fn no_number_covers_another() {
        let axis = Axis::new(Along::Time, 0.0..10.0, 0.0..1_000.0);
        let long = "long ".repeat(50);
        let numbers = |times: &[f64]| {
            let given: Vec<_> = times.iter().map(|at| mark(*at, &long)).collect();
            Marks::new(&given, &axis).numbers(&axis).into_iter().map(|(_, text)| text).collect::<Vec<_>>()
        };
        assert_eq!(numbers(&[1.0, 2.0]), ["1", "2"]);
        assert_eq!(numbers(&[1.0, 2.0, 2.01, 2.02, 5.0]), ["1", "2\u{2013}4", "5"]);
        // Two joined numbers reach the previous one.
        assert_eq!(numbers(&[1.0, 1.13, 1.14, 1.15]), ["1\u{2013}4"]);
    }

    #[test]
    fn what_does_not_fit_is_numbered_and_listed() {
        let axis = Axis::new(Along::Time, 0.0..10.0, 0.0..1_000.0);
        let crowd: Vec<_> = (0..200).map(|number| mark(f64::from(number) * 0.01, "a long text")).collect();
        let long = [mark(1.0, &"long ".repeat(50)), mark(1.0, "b"), mark(2.0, "c")];
        let listed = |given: &[Mark]| {
            let lines = Marks::new(given, &axis).list(&axis);
            lines.into_iter().map(|line| (line.number, line.text)).collect::<Vec<_>>()
        };
        assert_eq!(listed(&crowd).len(), MAX_LISTED + 1);
        assert_eq!(listed(&crowd)[MAX_LISTED].1, "… and 80 more");
        let lines = listed(&long);
        assert_eq!(lines[1..], [(String::new(), "b".to_owned()), ("2".to_owned(), "c".to_owned())]);
    }
}
