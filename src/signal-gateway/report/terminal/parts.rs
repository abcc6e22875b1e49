//! Parts of every view: heading, buses, log and footer.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

use super::ink::{DIM, Ink};
use super::view_model::{Keys, Model};
use crate::report::gateway_view::BusView;
use crate::report::text::{clock_text, counted, cut};
use gateway_base::diagnostics::Level;

/// Width from which a bus has a longer name, and an unknown load is stated.
const WIDE: usize = 70;
/// Indentation of the further rows of a log line.
const LOG_INDENT: usize = 12;
const BAR: u8 = 10;

/// Returns the number of lines, which is small.
pub(super) fn lines_of(lines: &[Line<'_>]) -> u16 {
    u16::try_from(lines.len()).unwrap_or(u16::MAX)
}

/// Returns the header: title on the left, time and level on the right.
pub(super) fn header(model: &Model, ink: Ink, width: usize) -> Line<'static> {
    let picture = &model.picture;
    let level = picture.level.map_or_else(String::new, |level| format!(" {level} "));
    let time = format!(" {} ", clock_text(model.time()));
    let room = width.saturating_sub(level.chars().count() + time.chars().count());
    let title = format!("{:<room$}", cut(&format!(" {}", model.title), room));
    let bar = Style::new().add_modifier(Modifier::REVERSED);
    let level_style = picture.level.map_or(bar, |level| ink.level(level).add_modifier(Modifier::REVERSED));
    Line::from(vec![
        Span::styled(title, bar.add_modifier(Modifier::BOLD)),
        Span::styled(time, bar),
        Span::styled(level, level_style),
    ])
}

pub(super) fn bus_line(bus: &BusView, ink: Ink, width: usize) -> Line<'static> {
    let is_narrow = width < WIDE;
    let name = if is_narrow { 14 } else { 22 };
    let mut spans = vec![
        Span::styled("● ", ink.level(bus.level)),
        Span::raw(format!("{:<name$}", cut(&bus.name, name - 1))),
        Span::raw(format!("{:>6.0}/s ", bus.rate_hz)),
    ];
    if let Some(load) = bus.load_percent {
        let filled = (1..=BAR).filter(|cell| load >= 10.0 * f64::from(*cell) - 5.0).count();
        let (full, empty) = ("█".repeat(filled), "░".repeat(usize::from(BAR) - filled));
        let level = match load {
            ..60.0 => Level::Ok,
            60.0..85.0 => Level::Warn,
            _ => Level::Error,
        };
        let percent = Span::raw(format!(" {load:>3.0} %  "));
        spans.extend([Span::styled(full, ink.level(level)), Span::styled(empty, DIM), percent]);
    } else if !is_narrow {
        spans.push(Span::styled(" load unknown  ", DIM));
    }
    if bus.drops > 0 {
        spans.push(Span::styled(format!("{} dropped  ", bus.drops), ink.level(Level::Error)));
    }
    let used: usize = spans.iter().map(Span::width).sum();
    let style = if bus.level == Level::Ok { Style::new() } else { ink.level(bus.level) };
    spans.push(Span::styled(cut(&bus.details(), width.saturating_sub(used)), style));
    Line::from(spans)
}

pub(super) fn draw_log(frame: &mut Frame<'_>, model: &Model, ink: Ink, area: Rect) {
    let block = Block::new().borders(ratatui::widgets::Borders::TOP).border_style(DIM);
    let inner = block.inner(area);
    // Even when scrolled to the first line, the pane is full.
    let first_page = usize::from(inner.height).min(model.log.len());
    let end = model.log.len().saturating_sub(model.scroll).max(first_page);
    let start = end.saturating_sub(inner.height.into());
    let heading = match model.log.len() - end {
        0 => " log ".to_owned(),
        newer => format!(" log, {} below ", counted(newer as u64, "newer line")),
    };
    let block = block.title(heading);
    let lines = model.log.iter().skip(start).take(end - start).flat_map(|line| {
        let style = match line.level {
            None | Some(Level::Ok) => Style::new(),
            Some(level) => ink.level(level).remove_modifier(Modifier::BOLD),
        };
        rows_of(&line.text, inner.width.into()).into_iter().map(move |row| Line::styled(row, style))
    });
    let mut lines: Vec<_> = lines.collect();
    // The oldest lines are omitted, unless the log is scrolled to them.
    if end > first_page {
        lines.drain(..lines.len().saturating_sub(inner.height.into()));
    }
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// Returns the rows of a log line, broken between words, or within a word that is longer than a row.
fn rows_of(text: &str, width: usize) -> Vec<String> {
    let indent = if width > 2 * LOG_INDENT { LOG_INDENT } else { 0 };
    let mut rows = vec![String::new()];
    for word in text.split_inclusive(' ') {
        let mut rest = word;
        loop {
            let is_first = rows.len() == 1;
            let Some(row) = rows.last_mut() else { break };
            let room = width.saturating_sub(row.chars().count());
            if rest.trim_end().chars().count() <= room {
                row.push_str(rest);
                break;
            }
            let begins = row.chars().count() <= if is_first { 0 } else { indent };
            if begins {
                let end = rest.char_indices().nth(room.max(1)).map_or(rest.len(), |(at, _)| at);
                let (part, more) = rest.split_at(end);
                row.push_str(part);
                rest = more;
            }
            rows.push(" ".repeat(indent));
        }
    }
    rows.iter().map(|row| row.trim_end().to_owned()).collect()
}

/// Returns the footer: keys on the left, and on the right the address for a browser.
pub(super) fn footer(model: &Model, width: usize) -> Line<'static> {
    if model.is_paused {
        let style = Style::new().add_modifier(Modifier::REVERSED | Modifier::BOLD);
        let text = " PAUSED: only the picture stands still ";
        return Line::from(vec![Span::styled(text, style), Span::raw(" space")]);
    }
    let keys = if model.keys == Keys::Driver {
        " q quit  ← → stalk  o off  h hazard  ? help"
    } else {
        " q quit  space pause  ↑↓ log  ? help"
    };
    let Some(url) = &model.url else { return Line::styled(keys, DIM) };
    let room = width.saturating_sub(url.chars().count() + 1);
    let keys = if keys.chars().count() < room { keys } else { " q quit  ? help" };
    Line::from(vec![Span::styled(format!("{keys:<room$}"), DIM), Span::raw(format!("{url} "))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_log_is_broken_between_words_and_only_a_longer_word_inside() {
        let text = "   0:01.000 WARN  log: /a/long/path/to/a/file cannot be written";
        assert_eq!(rows_of(text, 80), [text]);
        let rows =
            ["   0:01.000 WARN  log:", "            /a/long/path/to/a/file cannot", "            be written"];
        assert_eq!(rows_of(text, 41), rows);
        let rows = [
            "   0:01.000 WARN  log:",
            "            /a/long/path/to/",
            "            a/file cannot be",
            "            written",
        ];
        assert_eq!(rows_of(text, 28), rows);
        assert_eq!(rows_of("abcdefgh", 3), ["abc", "def", "gh"]);
        assert_eq!(rows_of("", 3), [""]);
    }
}
