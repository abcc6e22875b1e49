//! Draws the table: a line for each row, with its signals below.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::ink::{DIM, Ink};
use super::message_table::{MessageRow, MessageTable};
use super::parts::{bus_line, cut, draw_log, footer, header, lines_of};
use super::view_model::Model;
use crate::report::text::wrapped;
use gateway_base::diagnostics::Level;

/// Width from which names and signals are placed beside the bytes.
const WIDE: usize = 100;
/// Number of bytes in a line.
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
/// Maximum number of lines of the log.
const MAX_LOG: u16 = 4;
/// Times since a change: until when it is bright, until when it has begun to fade, and until when it is
/// visible.
const BRIGHT: Duration = Duration::from_millis(300);
const FADING: Duration = Duration::from_millis(1_500);
const FADED: Duration = Duration::from_secs(3);

/// Draws the whole view.
pub(super) fn draw_messages(frame: &mut Frame<'_>, model: &Model, table: &MessageTable, area: Rect) {
    let ink = Ink(model.has_color);
    let width = usize::from(area.width);
    let shown = table.shown();
    let buses: Vec<_> =
        model.picture.buses.iter().map(|bus| bus_line(bus, ink, width.min(BUS_WIDTH))).collect();
    let log = u16::try_from(model.log.len()).unwrap_or(u16::MAX).saturating_add(1).min(MAX_LOG);
    let log = if model.log.is_empty() { 0 } else { log };
    let heights = [1, lines_of(&buses), 1].map(Constraint::Length);
    let rest = [Constraint::Fill(1), Constraint::Length(log), Constraint::Length(1)];
    let areas: [Rect; 6] = Layout::vertical(heights.into_iter().chain(rest)).areas(area);
    frame.render_widget(header(model, ink, width), areas[0]);
    frame.render_widget(Paragraph::new(buses), areas[1]);
    let columns = Columns { width, has_interface: model.picture.buses.len() > 1 };
    frame.render_widget(columns.heading(table, shown.len()), areas[2]);
    let height = usize::from(areas[3].height);
    // A filter may leave fewer rows than the scroll position.
    let first = table.first.min(shown.len().saturating_sub(1));
    let mut lines = Vec::new();
    for row in shown.iter().skip(first) {
        if lines.len() >= height {
            break;
        }
        lines.extend(columns.lines(row, table.has_all_signals, ink));
    }
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

/// The columns that fit a width.
struct Columns {
    width: usize,
    has_interface: bool,
}

impl Columns {
    /// Returns true if names and signals are placed beside the bytes.
    fn is_wide(&self) -> bool {
        self.width >= WIDE
    }

    fn interface_width(&self) -> usize {
        if self.has_interface { INTERFACE } else { 0 }
    }

    /// Returns true if there is room for the period. Otherwise the rate conveys the same.
    fn has_period(&self) -> bool {
        self.width >= self.interface_width() + ID + DATA + RATE + PERIOD
    }

    /// Returns the width of everything before names and signals.
    fn fixed(&self) -> usize {
        let period = if self.has_period() { PERIOD } else { 0 };
        self.interface_width() + ID + DATA + RATE + period
    }

    fn heading(&self, table: &MessageTable, shown: usize) -> Line<'static> {
        let mut text = String::new();
        if self.has_interface {
            text += &format!("{:<INTERFACE$}", "bus");
        }
        let data = match (shown, table.rows.len()) {
            (shown, all) if shown == all => format!("data of {all} ids"),
            (shown, all) => format!("data of {shown} of {all} ids"),
        };
        text += &format!("{:<ID$}{:<DATA$}{:>RATE$}", "id", data, "rate ");
        if self.has_period() {
            text += &format!("{:>PERIOD$}", "period ");
        }
        if self.is_wide() {
            text += " message and signals";
        }
        let text = format!("{text:<width$}", width = self.width);
        Line::styled(text, DIM.add_modifier(Modifier::UNDERLINED))
    }

    /// Returns the lines of a row.
    fn lines(&self, row: &MessageRow, has_all_signals: bool, ink: Ink) -> Vec<Line<'static>> {
        let mut lines: Vec<Vec<Span<'static>>> = vec![self.first_columns(row, ink)];
        let mut parts = row.bytes.chunks(BYTES);
        let first = parts.next().unwrap_or_default();
        lines[0].extend(bytes(first, ink));
        lines[0].extend(self.times(row));
        let indent = self.interface_width() + ID;
        for part in parts {
            let mut spans = vec![Span::raw(" ".repeat(indent))];
            spans.extend(bytes(part, ink));
            spans.push(Span::raw(" ".repeat(self.fixed().saturating_sub(indent + DATA))));
            lines.push(spans);
        }
        let texts = self.texts(row, has_all_signals, ink);
        if self.is_wide() {
            for (index, text) in texts.into_iter().enumerate() {
                if index == lines.len() {
                    lines.push(vec![Span::raw(" ".repeat(self.fixed()))]);
                }
                lines[index].push(Span::raw(" "));
                lines[index].push(text);
            }
        } else {
            lines.extend(texts.into_iter().map(|text| vec![Span::raw("  "), text]));
        }
        lines.into_iter().map(Line::from).collect()
    }

    fn first_columns(&self, row: &MessageRow, ink: Ink) -> Vec<Span<'static>> {
        let mut spans = Vec::new();
        if self.has_interface {
            spans.push(Span::styled(format!("{:<INTERFACE$}", cut(&row.interface, INTERFACE - 1)), DIM));
        }
        let style = if row.rejected.is_some() { ink.level(Level::Error) } else { Style::new() };
        let style = if row.is_silent() { DIM } else { style };
        spans.push(Span::styled(format!("{:<ID$}", row.id.to_string()), style));
        spans
    }

    /// Returns rate and period, or the time since the last frame.
    fn times(&self, row: &MessageRow) -> Vec<Span<'static>> {
        let width = RATE + if self.has_period() { PERIOD } else { 0 };
        if row.is_silent() {
            return vec![Span::styled(format!("{:>width$}", format!("{} s ago ", row.age.as_secs())), DIM)];
        }
        let rate = row.rate_hz().map_or_else(|| "– ".to_owned(), |rate| format!("{rate:.0}/s "));
        let mut spans = vec![Span::raw(format!("{rate:>RATE$}"))];
        if self.has_period() {
            let period = row.period.map_or_else(String::new, |period| {
                let ms = period.as_secs_f64() * 1000.0;
                if ms < 100.0 { format!("{ms:.1} ms ") } else { format!("{ms:.0} ms ") }
            });
            spans.push(Span::styled(format!("{period:>PERIOD$}"), DIM));
        }
        spans
    }

    /// Returns name, reason of a rejection and signals, wrapped; a single line if no signal is bound, unless
    /// all signals are requested.
    fn texts(&self, row: &MessageRow, has_all_signals: bool, ink: Ink) -> Vec<Span<'static>> {
        let Some(name) = &row.name else { return Vec::new() };
        let room = self.width.saturating_sub(if self.is_wide() { self.fixed() + 1 } else { 2 });
        let is_bound = !row.bound_signals.is_empty() || row.rejected.is_some();
        let others = row.other_signals.iter().filter(|_| has_all_signals || !is_bound);
        let signals: Vec<_> = row.bound_signals.iter().chain(others).map(String::as_str).collect();
        let text = format!("{name}  {}", signals.join(", "));
        let style = if is_bound { Style::new() } else { DIM };
        let mut texts: Vec<_> = if is_bound || has_all_signals {
            wrapped(text.trim_end(), Some(room), 0)
        } else {
            vec![text.trim_end().to_owned()]
        }
        .into_iter()
        .map(|line| Span::styled(cut(&line, room), style))
        .collect();
        if let Some(reason) = &row.rejected {
            let text = cut(&format!("✗ rejected: {reason}"), room);
            texts.push(Span::styled(text, ink.level(Level::Error)));
        }
        texts
    }
}

/// Returns up to [`BYTES`] bytes; changed bytes are highlighted, and fade.
fn bytes(bytes: &[(u8, Option<Duration>)], ink: Ink) -> Vec<Span<'static>> {
    let mut spans: Vec<_> = bytes
        .iter()
        .flat_map(|(byte, since)| {
            [Span::styled(format!("{byte:02X}"), change_style(*since, ink)), Span::raw(" ")]
        })
        .collect();
    spans.push(Span::raw("   ".repeat(BYTES - bytes.len())));
    spans
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
