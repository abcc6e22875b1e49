//! Draws the view: the layout, and each part of it.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph};

use super::car;
use super::draw_messages::draw_messages;
use super::ink::{DIM, Ink};
use super::parts::{bus_line, draw_log, footer, header, lines_of};
use super::view_model::{Keys, Model, STRIP_MS};
use crate::report::gateway_view::{GatewayView, Mark, Outcome, RawView, ReportView, Step, bulb_text};
use crate::report::palette::{self, Lamp};
use crate::report::text::{cut, wrapped};
use gateway_base::diagnostics::Level;
use traffic_lights::bulb::{Bulb, Color as BulbColor};

/// Minimum size of a terminal for the view, columns and lines.
const MIN_SIZE: (u16, u16) = (40, 12);
/// Size from which the car is large, and placed beside the values.
const WIDE: (u16, u16) = (70, 22);
/// Width from which the log is placed beside everything else instead of below.
const SIDE_BY_SIDE: u16 = 160;
/// Minimum number of lines of the log, including its heading.
const MIN_LOG: u16 = 3;
/// Width of `right (command)`, the longest value in the middle column, plus a space.
const MAX_REPORTED: usize = 16;
/// Minimum number of columns beside the car for showing remedies: from a width of 100 on.
const MIN_REMEDY: usize = 74;
const NAME: usize = 8;
const STATUS_NAME: usize = 14;

/// Draws the whole view.
pub fn draw(frame: &mut Frame<'_>, model: &Model) {
    let area = frame.area();
    if (area.width, area.height) < MIN_SIZE || area.height < MIN_SIZE.1 {
        let text = format!("at least {} × {}, please", MIN_SIZE.0, MIN_SIZE.1);
        frame.render_widget(Paragraph::new(text), area);
        return;
    }
    match &model.messages {
        Some(table) => draw_messages(frame, model, table, area),
        None => draw_vehicle(frame, model, area),
    }
    if model.has_help {
        draw_help(frame, model, area);
    }
}

fn draw_vehicle(frame: &mut Frame<'_>, model: &Model, area: Rect) {
    let ink = Ink(model.has_color);
    let [head, body, foot] =
        Layout::vertical([Constraint::Length(1), Constraint::Fill(1), Constraint::Length(1)]).areas(area);
    frame.render_widget(header(model, ink, area.width.into()), head);
    frame.render_widget(footer(model, area.width.into()), foot);
    let log = if area.width >= SIDE_BY_SIDE && area.height >= WIDE.1 {
        let [left, _, log] =
            Layout::horizontal([Constraint::Fill(1), Constraint::Length(1), Constraint::Fill(1)]).areas(body);
        draw_state(frame, model, ink, left, 0);
        log
    } else {
        draw_state(frame, model, ink, body, MIN_LOG)
    };
    draw_log(frame, model, ink, log);
}

/// Draws the caption, the vehicle, the last minute, the buses and further parts. Returns the area below,
/// which has at least `min_rest` lines.
fn draw_state(frame: &mut Frame<'_>, model: &Model, ink: Ink, area: Rect, min_rest: u16) -> Rect {
    let width = usize::from(area.width);
    // Includes the heading and the footer.
    let is_wide = area.width >= WIDE.0 && area.height + 2 >= WIDE.1;
    let (car, values_width) = if is_wide {
        (car::large(model, ink), width - usize::from(car::LARGE_WIDTH) - 1)
    } else {
        (car::small(model, ink, width), width)
    };
    let picture = &model.picture;
    let mut values = values(picture, ink, values_width, is_wide);
    if !picture.vehicle_status.is_empty() {
        values.push(Line::default());
        let reports = picture.vehicle_status.iter();
        values.extend(reports.flat_map(|report| status_lines(report, ink, values_width, is_wide)));
    }
    let more = more_lines(picture, ink, width);
    // Without a vehicle there are neither a car nor values.
    let has_vehicle = !picture.reports.is_empty() || !picture.vehicle_status.is_empty() || more.is_empty();
    let (car, values) = if has_vehicle { (car, values) } else { (Vec::new(), Vec::new()) };
    let [main_height, values_top] = match (lines_of(&car), lines_of(&values)) {
        (car, values) if is_wide => [car.max(values), 0],
        (car, values) => [car + values, car],
    };
    let caption = caption(model, ink, width);
    // Parts without room are omitted; buses last, since they may be the cause.
    let taken = main_height + lines_of(&caption) + min_rest;
    let mut room = usize::from(area.height.saturating_sub(taken));
    let mut fit = |mut lines: Vec<Line<'static>>| {
        if lines.len() > room && room > 1 {
            let left_out = lines.len() - room + 1;
            lines.truncate(room - 1);
            lines.push(Line::styled(format!("  … {left_out} more"), DIM));
        }
        lines.truncate(room);
        room -= lines.len();
        lines
    };
    let buses = fit(picture.buses.iter().map(|bus| bus_line(bus, ink, width)).collect());
    let strip = fit(strip(model, ink, width));
    let more = fit(more);
    // The remaining lines separate the strip from the rest.
    let (before, after) = match (room, strip.is_empty()) {
        (0, _) | (_, true) => (0, 0),
        (1, false) => (1, 0),
        (_, false) => (1, 1),
    };
    let strip = [vec![Line::default(); before], strip, vec![Line::default(); after]].concat();
    let parts = [strip, buses, more];
    let heights =
        [lines_of(&caption), main_height].into_iter().chain(parts.iter().map(|part| lines_of(part)));
    let heights = heights.map(Constraint::Length).chain([Constraint::Fill(1)]);
    let [caption_area, main_area, strip_area, buses_area, more_area, rest]: [Rect; 6] =
        Layout::vertical(heights).areas(area);
    frame.render_widget(Paragraph::new(caption), caption_area);
    let main = if is_wide {
        Layout::horizontal([Constraint::Length(car::LARGE_WIDTH + 1), Constraint::Fill(1)])
    } else {
        Layout::vertical([Constraint::Length(values_top), Constraint::Fill(1)])
    };
    let [car_area, values_area] = main.areas(main_area);
    frame.render_widget(Paragraph::new(car), car_area);
    frame.render_widget(Paragraph::new(values), values_area);
    for (area, part) in [strip_area, buses_area, more_area].into_iter().zip(parts) {
        frame.render_widget(Paragraph::new(part), area);
    }
    rest
}

/// Returns the caption, in two lines if one is too short; empty without a caption.
fn caption(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let style = ink.color(Color::Cyan).add_modifier(Modifier::BOLD);
    let lines = wrapped(&model.caption, Some(width.saturating_sub(3)), 0).into_iter().take(2);
    let marks = [" ▸ ", "   "].into_iter();
    let lines = marks.zip(lines).filter(|(_, line)| !line.is_empty());
    lines.map(|(mark, line)| Line::styled(cut(&format!("{mark}{line}"), width), style)).collect()
}

/// Returns the values of each function side by side, with their validation steps below.
fn values(picture: &GatewayView, ink: Ink, width: usize, is_wide: bool) -> Vec<Line<'static>> {
    let reported = picture.reports.iter().map(|function| function.reported.text.chars().count() + 1);
    let needed = reported.max().unwrap_or(0).min(MAX_REPORTED);
    let columns = if width < 60 { [10, needed.max(13)] } else { [12, needed.max(15)] };
    let last = width.saturating_sub(NAME + columns[0] + columns[1]);
    let row = |name: &str, values: [&str; 3], styles: [Style; 3]| {
        Line::from(vec![
            Span::raw(format!("{name:<NAME$}")),
            Span::styled(format!("{:<1$}", cut(values[0], columns[0] - 1), columns[0]), styles[0]),
            Span::styled(format!("{:<1$}", cut(values[1], columns[1] - 1), columns[1]), styles[1]),
            Span::styled(cut(values[2], last), styles[2]),
        ])
    };
    // A simulated vehicle has no level.
    let titles = if picture.level.is_some() { ["reported", "raw"] } else { ["lights", "lamps"] };
    let mut lines = vec![row("", ["commanded", titles[0], titles[1]], [DIM; 3])];
    for function in &picture.reports {
        let commanded = function.commanded.as_ref().map_or("–", |commanded| &commanded.text);
        let raw = function.raw.iter().map(RawView::text).collect::<Vec<_>>().join("  ");
        let raw = if raw.is_empty() { "–" } else { &raw };
        let styles = [Style::new(), mark_style(function.mark, ink), Style::new()];
        lines.push(row(function.name, [commanded, &function.reported.text, raw], styles));
    }
    if let Some(ReportView { steps, .. }) = picture.reports.iter().find(|report| !report.steps.is_empty()) {
        let widths = step_widths(steps, width);
        let heads = steps.iter().zip(&widths).map(|(step, width)| {
            let name = step.name.to_lowercase().chars().take(width - 1).collect::<String>();
            format!("{name:<width$}")
        });
        let heads = format!("{:<NAME$}{}", "trust", heads.collect::<String>());
        lines.push(Line::default());
        lines.push(Line::styled(heads.trim_end().to_owned(), DIM));
        lines.extend(picture.reports.iter().map(|function| steps_line(function, &widths, ink)));
    }
    for function in &picture.reports {
        let text = format!("{}: {}", function.name, function.message);
        lines.extend(reason_lines(function, wrapped(&text, Some(width.saturating_sub(3)), 0), ink));
        lines.extend(remedy_line(&function.remedy, width).filter(|_| is_wide));
    }
    lines
}

/// Returns a status report in a line with its fault, which is on a separate line if there is room for both.
fn status_lines(report: &ReportView, ink: Ink, width: usize, is_wide: bool) -> Vec<Line<'static>> {
    let (name, value, level) = (report.name, &report.reported.text, bad_level(report));
    let both = format!("{value}: {}", report.message);
    let value = if level.is_none() || is_wide { value } else { &both };
    let style = level.map_or(Style::new(), |level| ink.level(level));
    let room = width.saturating_sub(STATUS_NAME);
    let mut lines = vec![Line::from(vec![
        Span::raw(format!("{name:<STATUS_NAME$}")),
        Span::styled(cut(value, room), style),
    ])];
    if is_wide {
        lines.extend(reason_lines(report, vec![cut(&report.message, width.saturating_sub(2))], ink));
        lines.extend(remedy_line(&report.remedy, width));
    }
    lines
}

/// Returns the fault of a report in these lines of text; empty if it is simply published.
fn reason_lines(report: &ReportView, text: Vec<String>, ink: Ink) -> Vec<Line<'static>> {
    let Some(level) = bad_level(report) else { return Vec::new() };
    let lines = ["└ "].into_iter().chain(std::iter::repeat("  ")).zip(text);
    lines.map(|(indent, text)| Line::styled(format!("{indent}{text}"), ink.level(level))).collect()
}

/// Returns the level of a report that is not simply published.
fn bad_level(report: &ReportView) -> Option<Level> {
    report.reported.level.filter(|level| *level > Level::Ok)
}

/// Returns the remedy for the line above; `None` if there is none, or no room for it.
fn remedy_line(remedy: &str, width: usize) -> Option<Line<'static>> {
    (!remedy.is_empty() && width >= MIN_REMEDY)
        .then(|| Line::styled(cut(&format!("  → {remedy}"), width), DIM))
}

/// Returns the widths of the step columns: the whole of each name if there is room, otherwise its beginning.
fn step_widths(steps: &[Step], width: usize) -> Vec<usize> {
    let widths: Vec<_> = steps.iter().map(|step| step.name.len() + 1).collect();
    let room = width.saturating_sub(NAME) + 1;
    let is_wide = widths.iter().sum::<usize>() <= room;
    if is_wide { widths } else { vec![(room / steps.len()).max(2); steps.len()] }
}

fn steps_line(function: &ReportView, widths: &[usize], ink: Ink) -> Line<'static> {
    let mut spans = vec![Span::raw(format!("{:<NAME$}", function.name))];
    for (index, (step, width)) in function.steps.iter().zip(widths).enumerate() {
        let (mark, style) = match step.outcome {
            Outcome::Passed => ("✓", ink.level(Level::Ok)),
            Outcome::Absent => ("–", DIM),
            Outcome::Partial => ("!", ink.level(Level::Warn)),
            Outcome::Failed => ("✗", ink.level(Level::Error)),
            Outcome::NotReached => ("·", DIM),
        };
        let is_end = matches!(step.outcome, Outcome::Failed | Outcome::NotReached);
        let is_joined = !is_end && index + 1 < widths.len();
        let joint = if is_joined { "─" } else { " " }.repeat(width.saturating_sub(3));
        spans.push(Span::styled(mark, style));
        spans.push(Span::styled(format!(" {joint} "), DIM));
    }
    Line::from(spans)
}

fn mark_style(mark: Mark, ink: Ink) -> Style {
    match mark {
        Mark::Nothing | Mark::Measured | Mark::Named | Mark::Off => Style::new(),
        Mark::Left => ink.meaning(palette::LEFT),
        Mark::Right => ink.meaning(palette::RIGHT),
        Mark::Hazard => ink.meaning(palette::HAZARD),
        Mark::Withheld => ink.level(Level::Error),
    }
}

fn strip(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let functions = &model.picture.reports;
    let columns = width.saturating_sub(NAME + 1);
    let Some((now, _)) = model.history.back().filter(|_| !functions.is_empty()) else { return Vec::new() };
    let start = now - STRIP_MS;
    let column_of = |at: i64| {
        let column = (at - start) * i64::try_from(columns).unwrap_or(i64::MAX) / (STRIP_MS + 1);
        usize::try_from(column).unwrap_or(0)
    };
    let axis = format!("{:<NAME$}{:<left$}{:>6}", "60 s", "", "now", left = columns.saturating_sub(6));
    let mut lines = vec![Line::styled(axis, DIM)];
    for (index, function) in functions.iter().enumerate() {
        let mut marks = vec![None; columns];
        for (at, states) in &model.history {
            if let (Some(cell), Some(mark)) = (marks.get_mut(column_of(*at)), states.get(index)) {
                *cell = (*cell).max(Some(*mark));
            }
        }
        let mut spans = vec![Span::raw(format!("{:<NAME$}", function.name))];
        let mut shown = Mark::Nothing;
        for mark in marks {
            // A column without its own state continues the previous one.
            shown = mark.unwrap_or(shown);
            let sign = match shown {
                Mark::Nothing | Mark::Measured | Mark::Named => " ",
                Mark::Off => "─",
                Mark::Left => palette::LEFT.sign,
                Mark::Right => palette::RIGHT.sign,
                Mark::Hazard => palette::HAZARD.sign,
                Mark::Withheld => "×",
            };
            let style = if shown == Mark::Off { DIM } else { mark_style(shown, ink) };
            spans.push(Span::styled(sign, style));
        }
        lines.push(Line::from(spans));
    }
    lines
}

const MORE_NAME: usize = 28;

/// Returns a line each for the decider, the traffic lights and ROS 2.
fn more_lines(view: &GatewayView, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let text = |text: &str| vec![(text.to_owned(), Style::new())];
    let mut lines = Vec::new();
    let mut add = |name: &str, parts| lines.push(more_line(name, parts, width));
    if let Some(decider) = &view.decider {
        add("decider", text(&decider.decision));
    }
    let lights = view.traffic_lights.as_ref();
    for controller in lights.iter().flat_map(|lights| &lights.controllers) {
        add(&controller.name, text(&controller.text));
    }
    for channel in lights.iter().flat_map(|lights| &lights.channels) {
        for light in &channel.lights {
            let lamps = light.bulbs.iter().map(|bulb| lamp_text(*bulb, ink));
            let parts = if light.bulbs.is_empty() { text(&light.text) } else { lamps.collect() };
            add(&format!("{} {}", channel.name, light.name), parts);
        }
    }
    if let Some(process) = &view.process {
        add("ROS 2", text(&process.ros));
    }
    lines
}

fn more_line(name: &str, parts: Vec<(String, Style)>, width: usize) -> Line<'static> {
    let name_width = if width < WIDE.0.into() { MORE_NAME - 8 } else { MORE_NAME };
    let room = width.saturating_sub(name_width + 2);
    let mut spans = vec![Span::styled(format!("  {:<name_width$}", cut(name, name_width - 1)), DIM)];
    let mut used = 0;
    for (text, style) in parts {
        let text = cut(&text, room.saturating_sub(used));
        used += text.chars().count();
        spans.push(Span::styled(text, style));
    }
    Line::from(spans)
}

/// Returns the text for a lamp of a traffic light, e.g. `● green left`, with its style.
fn lamp_text(bulb: Bulb, ink: Ink) -> (String, Style) {
    let (sign, style) = match Lamp::of(bulb.color).terminal {
        _ if bulb.color == BulbColor::Unknown => ("?", ink.level(Level::Warn)),
        number => ("●", number.map_or(Style::new(), |number| ink.terminal(number))),
    };
    (format!("{sign} {}  ", bulb_text(&bulb)), style)
}

const TABLE_HELP: [&str; 12] = [
    "q, Ctrl-C     end",
    "s             sort by id, rate or last change",
    "/             filter by id, name or signal",
    "d             all signals, or only the bound",
    "space         let the picture stand still",
    "↑ ↓ PgUp PgDn scroll; Home, End",
    "?             this help",
    "",
    "lit bytes     changed within the last 3 s",
    "rejected      the gateway does not use it:",
    "              checksum, counter or length",
    "dim           no signal is bound, or silent",
];

const HELP: [&str; 17] = [
    "q, Ctrl-C     end",
    "space         let the picture stand still",
    "↑ ↓ PgUp PgDn scroll the log; Home, End",
    "?             this help",
    "",
    "◀ ▶ ▲         left, right, hazard lights",
    "─  ×          off; withheld, nothing published",
    "✓ – !         passed; nothing to check; in part",
    "✗ ·           failed; not reached",
    "",
    "link          the interface",
    "controller    its CAN controller",
    "frames        they are received from the bus",
    "checks        checksum and counter",
    "age           the value is recent",
    "value         the profile gives it a meaning",
    "report        it goes to ROS 2",
];

/// Number of rows of [`HELP`] that also apply to a simulated vehicle.
const DRIVER_ROWS: usize = 6;

const DRIVER_HELP: [&str; 6] = [
    "← →           stalk left, right",
    "o             stalk off",
    "h             hazard button",
    "f             left bulb broken",
    "c             all faults end",
    "",
];

fn draw_help(frame: &mut Frame<'_>, model: &Model, area: Rect) {
    let driver = DRIVER_HELP.iter().filter(|_| model.keys == Keys::Driver);
    // A simulated vehicle has no validation steps.
    let rows = if model.keys == Keys::Driver { DRIVER_ROWS } else { HELP.len() };
    let help = if model.messages.is_some() { TABLE_HELP.iter() } else { HELP[..rows].iter() };
    let lines: Vec<_> = driver.chain(help).map(|line| Line::raw(format!(" {line}"))).collect();
    let height = (lines_of(&lines) + 2).min(area.height);
    let width = 52.min(area.width);
    let help = Rect::new((area.width - width) / 2, (area.height - height) / 2, width, height);
    frame.render_widget(Clear, help);
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" help ")), help);
}
