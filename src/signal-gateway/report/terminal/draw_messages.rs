//! Draws the table: a line for each row, with its signals below.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::ink::{DIM, Ink};
use super::message_table::{MessageRow, MessageTable};
use super::parts::{bus_line, draw_log, footer, header, lines_of};
use super::view_model::Model;
use crate::report::text::{cut, wrapped};
use gateway_base::diagnostics::Level;

/// Width from which names and signals are placed beside the bytes.
const WIDE: usize = 100;
const BYTES: usize = 8;
/// Widths of the columns: identifier, bytes, rate, period.
const ID: usize = 9;
const DATA: usize = BYTES * 3;
const RATE: usize = 8;
const PERIOD: usize = 9;
/// Width of the interface column, if there are several interfaces.
const INTERFACE: usize = 8;
/// Width for describing a bus as on a narrow terminal, without its load, which is unknown.
const BUS_WIDTH: usize = 69;
const MAX_LOG: u16 = 4;
/// Times since a change until which it is bright, begins to fade, and is visible.
const BRIGHT: Duration = Duration::from_millis(300);
const FADING: Duration = Duration::from_millis(1_500);
const FADED: Duration = Duration::from_secs(3);

pub(super) fn draw_messages(frame: &mut Frame<'_>, model: &Model, table: &MessageTable, area: Rect) {
    let ink = Ink(model.has_color);
    let width = usize::from(area.width);
    let shown = table.shown();
    let buses: Vec<_> =
        model.picture.buses.iter().map(|bus| bus_line(bus, ink, width.min(BUS_WIDTH))).collect();
    let log = match u16::try_from(model.log.len()).unwrap_or(u16::MAX) {
        0 => 0,
        lines => lines.saturating_add(1).min(MAX_LOG),
    };
    let heights = [1, lines_of(&buses), 1].map(Constraint::Length);
    let rest = [Constraint::Fill(1), Constraint::Length(log), Constraint::Length(1)];
    let areas: [Rect; 6] = Layout::vertical(heights.into_iter().chain(rest)).areas(area);
    frame.render_widget(header(model, ink, width), areas[0]);
    frame.render_widget(Paragraph::new(buses), areas[1]);
    let columns = Columns::new(width, model.picture.buses.len() > 1);
    frame.render_widget(columns.heading(table, shown.len()), areas[2]);
    let height = usize::from(areas[3].height);
    // A filter may leave fewer rows than the scroll position.
    let first = table.first.min(shown.len().saturating_sub(1));
    let rows = shown.iter().skip(first);
    let lines = rows.flat_map(|row| columns.lines(row, table.has_all_signals, ink));
    let mut lines: Vec<_> = lines.take(height).collect();
    if table.rows.is_empty() {
        lines.push(Line::styled(" nothing received yet", DIM));
    } else if shown.is_empty() {
        lines.push(Line::styled(" no message contains the filter", DIM));
    }
    frame.render_widget(Paragraph::new(lines), areas[3]);
    if log > 0 {
        draw_log(frame, model, ink, areas[4]);
    }
    frame.render_widget(table_footer(model, table, width), areas[5]);
}

struct Columns {
    width: usize,
    /// Width of the interface column; 0 without it.
    interface: usize,
    /// Width of the period column; 0 without room for it, when the rate conveys the same.
    period: usize,
    /// Width of everything before names and signals.
    fixed: usize,
    /// True if names and signals are placed beside the bytes.
    is_wide: bool,
}

impl Columns {
    fn new(width: usize, has_interface: bool) -> Self {
        let interface = if has_interface { INTERFACE } else { 0 };
        let needed = interface + ID + DATA + RATE;
        let period = if width >= needed + PERIOD { PERIOD } else { 0 };
        Self { width, interface, period, fixed: needed + period, is_wide: width >= WIDE }
    }

    fn heading(&self, table: &MessageTable, shown: usize) -> Line<'static> {
        let mut text = format!("{:<1$}", if self.interface > 0 { "bus" } else { "" }, self.interface);
        let all = table.rows.len();
        let data =
            if shown == all { format!("data of {all} ids") } else { format!("data of {shown} of {all} ids") };
        text += &format!("{:<ID$}{data:<DATA$}{:>RATE$}", "id", "rate ");
        text += &format!("{:>1$}", if self.period > 0 { "period " } else { "" }, self.period);
        if self.is_wide {
            text += " message and signals";
        }
        let text = format!("{text:<width$}", width = self.width);
        Line::styled(text, DIM.add_modifier(Modifier::UNDERLINED))
    }

    fn lines(&self, row: &MessageRow, has_all_signals: bool, ink: Ink) -> Vec<Line<'static>> {
        let blank = |width: usize| Span::raw(" ".repeat(width));
        let mut parts = row.bytes.chunks(BYTES);
        let mut first = self.first_columns(row, ink);
        first.extend(bytes(parts.next().unwrap_or_default(), ink));
        first.extend(self.times(row));
        let mut lines = vec![first];
        let indent = self.interface + ID;
        for part in parts {
            let mut spans = vec![blank(indent)];
            spans.extend(bytes(part, ink));
            spans.push(blank(self.fixed.saturating_sub(indent + DATA)));
            lines.push(spans);
        }
        let texts = self.texts(row, has_all_signals, ink);
        if self.is_wide {
            for (index, text) in texts.into_iter().enumerate() {
                if index == lines.len() {
                    lines.push(vec![blank(self.fixed)]);
                }
                lines[index].extend([Span::raw(" "), text]);
            }
        } else {
            lines.extend(texts.into_iter().map(|text| vec![Span::raw("  "), text]));
        }
        lines.into_iter().map(Line::from).collect()
    }

    fn first_columns(&self, row: &MessageRow, ink: Ink) -> Vec<Span<'static>> {
        let interface = (self.interface > 0)
            .then(|| Span::styled(format!("{:<INTERFACE$}", cut(&row.interface, INTERFACE - 1)), DIM));
        let style = match row.rejected {
            _ if row.is_silent() => DIM,
            Some(_) => ink.level(Level::Error),
            None => Style::new(),
        };
        let id = Span::styled(format!("{:<ID$}", row.id.to_string()), style);
        interface.into_iter().chain([id]).collect()
    }

    /// Returns rate and period, or the time since the last frame.
    fn times(&self, row: &MessageRow) -> Vec<Span<'static>> {
        if row.is_silent() {
            let silence = format!("{} s ago ", row.age.as_secs());
            return vec![Span::styled(format!("{silence:>0$}", RATE + self.period), DIM)];
        }
        let rate = row.rate_hz().map_or_else(|| "– ".to_owned(), |rate| format!("{rate:.0}/s "));
        let period = row.period.filter(|_| self.period > 0).map_or_else(String::new, |period| {
            let ms = period.as_secs_f64() * 1000.0;
            if ms < 100.0 { format!("{ms:.1} ms ") } else { format!("{ms:.0} ms ") }
        });
        let period = Span::styled(format!("{period:>0$}", self.period), DIM);
        vec![Span::raw(format!("{rate:>RATE$}")), period]
    }

    /// Returns name, signals and reason of a rejection, wrapped if a signal is bound or all are requested.
    fn texts(&self, row: &MessageRow, has_all_signals: bool, ink: Ink) -> Vec<Span<'static>> {
        let Some(name) = &row.name else { return Vec::new() };
        let room = self.width.saturating_sub(if self.is_wide { self.fixed + 1 } else { 2 });
        let is_bound = !row.bound_signals.is_empty() || row.rejected.is_some();
        let others = row.other_signals.iter().filter(|_| has_all_signals || !is_bound);
        let signals: Vec<_> = row.bound_signals.iter().chain(others).map(String::as_str).collect();
        let text = format!("{name}  {}", signals.join(", "));
        let style = if is_bound { Style::new() } else { DIM };
        let width = (is_bound || has_all_signals).then_some(room);
        let lines = wrapped(text.trim_end(), width, 0).into_iter();
        let rejected = row
            .rejected
            .as_ref()
            .map(|reason| Span::styled(cut(&format!("✗ rejected: {reason}"), room), ink.level(Level::Error)));
        lines.map(|line| Span::styled(cut(&line, room), style)).chain(rejected).collect()
    }
}

/// Returns up to [`BYTES`] bytes; changed bytes are highlighted, and fade.
fn bytes(bytes: &[(u8, Option<Duration>)], ink: Ink) -> Vec<Span<'static>> {
    let shown = bytes.iter().flat_map(|(byte, since)| {
        [Span::styled(format!("{byte:02X}"), change_style(*since, ink)), Span::raw(" ")]
    });
    shown.chain([Span::raw("   ".repeat(BYTES - bytes.len()))]).collect()
}

/// Without colours: reverse, then underlined.
fn change_style(since: Option<Duration>, ink: Ink) -> Style {
    match since {
        Some(since) if since < BRIGHT => ink.amber().add_modifier(Modifier::REVERSED),
        Some(since) if since < FADED => {
            let style = if since < FADING { ink.amber() } else { ink.color(Color::Indexed(179)) };
            if ink.0 { style } else { style.add_modifier(Modifier::UNDERLINED) }
        }
        Some(_) | None => Style::new(),
    }
}

fn table_footer(model: &Model, table: &MessageTable, width: usize) -> Line<'static> {
    if table.is_typing {
        let style = Style::new().add_modifier(Modifier::REVERSED);
        let filter = Span::styled(format!(" /{}▏", table.filter), style);
        return Line::from(vec![filter, Span::styled(" Enter keeps, Esc clears", DIM)]);
    }
    if model.is_paused {
        return footer(model, width);
    }
    let filter = if table.filter.is_empty() { "filter".to_owned() } else { table.filter.clone() };
    Line::styled(format!(" q quit  s by {}  / {filter}  d all  ? help", table.order.name()), DIM)
}
