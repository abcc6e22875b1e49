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
use super::reports::{report_lines, signal_lines, strip, trust};
use super::view_model::{Keys, Model};
use crate::report::gateway_view::{GatewayView, bulb_text};
use crate::report::palette::Lamp;
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
/// Number of lines of the log before the received values get room.
const LOG: usize = 6;

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
    let values = report_lines(picture, ink, values_width, is_wide);
    let more = more_lines(picture, ink, width);
    // Without a vehicle there are neither a car nor values.
    let has_vehicle = !values.is_empty() || more.is_empty();
    let car = if has_vehicle { car } else { Vec::new() };
    let [main_height, values_top] = match (lines_of(&car), lines_of(&values)) {
        (car, values) if is_wide => [car.max(values), 0],
        (car, values) => [car + values, car],
    };
    let caption = caption(model, ink, width);
    // Parts without room are omitted; buses last, since they may be the cause.
    let taken = main_height + lines_of(&caption) + min_rest;
    let mut room = usize::from(area.height.saturating_sub(taken));
    let mut fit = |lines| fitting(lines, &mut room);
    let buses = fit(picture.buses.iter().map(|bus| bus_line(bus, ink, width)).collect());
    let trust = fit(trust(picture, ink, width));
    let strip = fit(strip(model, ink, width));
    let more = fit(more);
    let mut parts = [strip, trust, buses, more];
    // The remaining lines separate the parts; then comes the log, and the received values.
    for part in parts.iter_mut().filter(|part| !part.is_empty()).take(3) {
        if room > 0 {
            part.insert(0, Line::default());
            room -= 1;
        }
    }
    room = room.saturating_sub(if min_rest > 0 { LOG } else { 1 });
    let mut signals = fitting(signal_lines(picture, width), &mut room);
    if !signals.is_empty() {
        signals.insert(0, Line::default());
    }
    let below = [parts.concat(), signals].concat();
    let heights = [lines_of(&caption), main_height, lines_of(&below)].map(Constraint::Length);
    let [caption_area, main_area, below_area, rest]: [Rect; 4] =
        Layout::vertical(heights.into_iter().chain([Constraint::Fill(1)])).areas(area);
    frame.render_widget(Paragraph::new(caption), caption_area);
    let main = if is_wide {
        Layout::horizontal([Constraint::Length(car::LARGE_WIDTH + 1), Constraint::Fill(1)])
    } else {
        Layout::vertical([Constraint::Length(values_top), Constraint::Fill(1)])
    };
    let [car_area, values_area] = main.areas(main_area);
    frame.render_widget(Paragraph::new(car), car_area);
    frame.render_widget(Paragraph::new(values), values_area);
    frame.render_widget(Paragraph::new(below), below_area);
    rest
}

/// Takes the lines that there is room for, and counts the others in the last of them.
fn fitting(mut lines: Vec<Line<'static>>, room: &mut usize) -> Vec<Line<'static>> {
    if lines.len() > *room && *room > 1 {
        let left_out = lines.len() - *room + 1;
        lines.truncate(*room - 1);
        lines.push(Line::styled(format!("  … {left_out} more"), DIM));
    }
    lines.truncate(*room);
    *room -= lines.len();
    lines
}

/// Returns the caption, in two lines if one is too short; empty without a caption.
fn caption(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let style = ink.color(Color::Cyan).add_modifier(Modifier::BOLD);
    let lines = wrapped(&model.caption, Some(width.saturating_sub(3)), 0).into_iter().take(2);
    let marks = [" ▸ ", "   "].into_iter();
    let lines = marks.zip(lines).filter(|(_, line)| !line.is_empty());
    lines.map(|(mark, line)| Line::styled(cut(&format!("{mark}{line}"), width), style)).collect()
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

const HELP: [&str; 18] = [
    "q, Ctrl-C     end",
    "space         let the picture stand still",
    "↑ ↓ PgUp PgDn scroll the log; Home, End",
    "?             this help",
    "",
    "◀ ▶ ▲         left, right, hazard lights",
    "─  ×          off; withheld, nothing published",
    "▁▄█           measured, in its range",
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
