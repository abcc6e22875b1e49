//! What Autoware gets: the reports with their reasons, their last minute, and the steps to each.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::ink::{DIM, Ink};
use super::view_model::{Model, Past, STRIP_MS};
use crate::report::gateway_view::{GatewayView, Mark, Outcome, RawView, ReportView, Step};
use crate::report::palette::{self, Meaning};
use crate::report::text::{cut, wrapped};
use gateway_base::diagnostics::Level;

/// Width of the column of names.
const NAME: usize = 9;
/// Width of the names in the last minute, with the range of a measured value.
const PAST_NAME: usize = 23;
/// Minimum number of columns beside the car for showing remedies: from a width of 100 on.
const MIN_REMEDY: usize = 74;
/// Heights of a measured value within its range.
const BARS: [&str; 8] = ["▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"];

/// Returns a line for each report: mark, value and age, with its reason below it.
pub(super) fn report_lines(view: &GatewayView, ink: Ink, width: usize, is_wide: bool) -> Vec<Line<'static>> {
    let reports = view.reports.iter();
    let mut lines: Vec<_> = reports.flat_map(|report| one_report(report, ink, width, is_wide)).collect();
    if !view.absent.is_empty() {
        let text = format!("not in the profile: {}", view.absent.join(", ").to_lowercase());
        lines.extend(wrapped(&text, Some(width), 0).into_iter().take(2).map(|line| Line::styled(line, DIM)));
    }
    lines
}

fn one_report(report: &ReportView, ink: Ink, width: usize, is_wide: bool) -> Vec<Line<'static>> {
    let ReportView { name, mark, reported, age, message, remedy, .. } = report;
    let level = reported.level;
    let (sign, sign_style) = match (level, mark) {
        (None, _) => (" ", DIM),
        (Some(Level::Ok), Mark::Withheld) => ("–", DIM),
        (Some(level), _) => (Meaning::of(level).sign, ink.level(level)),
    };
    let commanded = report.commanded.as_ref();
    let commanded = commanded.map_or_else(String::new, |of| format!("  (commanded {})", of.text));
    let room = width.saturating_sub(NAME + 2);
    let value = format!("{}{commanded}", reported.text);
    let mut values = wrapped(&value, Some(room), 0).into_iter();
    let first = cut(&values.next().unwrap_or_default(), room);
    let gap = room.saturating_sub(first.chars().count() + age.chars().count());
    let mut spans = vec![
        Span::raw(format!("{name:<NAME$}")),
        Span::styled(format!("{sign} "), sign_style),
        Span::styled(first, mark_style(*mark, level.unwrap_or_default(), ink)),
    ];
    if gap > 0 {
        spans.push(Span::styled(format!("{:gap$}{age}", ""), DIM));
    }
    let mut lines = vec![Line::from(spans)];
    lines.extend(values.map(|value| Line::raw(format!("{:1$}{value}", "", NAME + 2))));
    let bad = ink.level(level.unwrap_or_default());
    let reason = wrapped(message, Some(width.saturating_sub(2)), 0).into_iter();
    let reason = reason.filter(|line| !line.is_empty()).take(if is_wide { 2 } else { 1 });
    lines.extend(reason.map(|line| Line::styled(cut(&format!("  {line}"), width), bad)));
    if !remedy.is_empty() && width >= MIN_REMEDY {
        lines.push(Line::styled(cut(&format!("  → {remedy}"), width), DIM));
    }
    lines
}

/// Returns the style of a value; `level` is the level of a withheld one.
fn mark_style(mark: Mark, level: Level, ink: Ink) -> Style {
    match mark {
        Mark::Nothing | Mark::Measured | Mark::Named | Mark::Off => Style::new(),
        Mark::Left => ink.meaning(palette::LEFT),
        Mark::Right => ink.meaning(palette::RIGHT),
        Mark::Hazard => ink.meaning(palette::HAZARD),
        Mark::Withheld if level == Level::Ok => DIM,
        Mark::Withheld => ink.level(level),
    }
}

/// Returns the last minute of the lights as signs, and of measured values as bars.
pub(super) fn strip(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let name_width = PAST_NAME.min(width / 3);
    let columns = width.saturating_sub(name_width + 1);
    let is_shown = |report: &ReportView| report.is_of_lights() || !report.measures.is_empty();
    let reports = model.picture.reports.iter().enumerate();
    let shown: Vec<_> = reports.filter(|(_, report)| is_shown(report)).collect();
    let Some((now, _)) = model.history.back().filter(|_| !shown.is_empty()) else { return Vec::new() };
    let start = now - STRIP_MS;
    let column_of = |at: i64| {
        let column = (at - start) * i64::try_from(columns).unwrap_or(i64::MAX) / (STRIP_MS + 1);
        usize::try_from(column).unwrap_or(0)
    };
    let axis = format!("{:<name_width$}{:<left$}{:>6}", "", "60 s", "now", left = columns.saturating_sub(6));
    let mut lines = vec![Line::styled(axis, DIM)];
    for (index, report) in shown {
        let mut cells: Vec<Option<Past>> = vec![None; columns];
        for (at, states) in &model.history {
            if let (Some(cell), Some(past)) = (cells.get_mut(column_of(*at)), states.get(index)) {
                *cell = Some(cell.filter(|before| before.mark > past.mark).unwrap_or(*past));
            }
        }
        let values = || model.history.iter().filter_map(|(_, states)| states.get(index)?.value);
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let range = if low > high { String::new() } else { format!(" {low:.1} to {high:.1}") };
        let mut spans = vec![Span::raw(format!(
            "{:<name_width$}",
            cut(&format!("{}{range}", report.name), name_width - 1)
        ))];
        let mut shown = Past::default();
        for cell in cells {
            // A column without its own state continues the previous one.
            shown = cell.unwrap_or(shown);
            let sign = match shown.mark {
                Mark::Nothing | Mark::Named => " ",
                Mark::Measured => shown.value.map_or(" ", |value| bar(value, low, high)),
                Mark::Off => "─",
                Mark::Left => palette::LEFT.sign,
                Mark::Right => palette::RIGHT.sign,
                Mark::Hazard => palette::HAZARD.sign,
                Mark::Withheld => "×",
            };
            let style = if shown.mark == Mark::Off { DIM } else { mark_style(shown.mark, Level::Error, ink) };
            spans.push(Span::styled(sign, style));
        }
        lines.push(Line::from(spans));
    }
    lines
}

/// Returns the bar of a value between the lowest and the highest.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // between 0 and 7
fn bar(value: f64, low: f64, high: f64) -> &'static str {
    let share = if high > low { (value - low) / (high - low) } else { 0.0 };
    BARS[(share * 7.0).round().clamp(0.0, 7.0) as usize]
}

/// Returns the steps to the reports, with one line for all that have the same marks.
pub(super) fn trust(view: &GatewayView, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let mut groups: Vec<(Vec<&str>, &[Step])> = Vec::new();
    for ReportView { name, steps, .. } in view.reports.iter().filter(|report| !report.steps.is_empty()) {
        let is_same = |steps: &[Step], other: &[Step]| {
            steps.iter().map(|step| step.outcome).eq(other.iter().map(|step| step.outcome))
        };
        match groups.iter_mut().find(|(_, known)| is_same(known, steps)) {
            Some((names, _)) => names.push(name),
            None => groups.push((vec![*name], steps.as_slice())),
        }
    }
    // The largest comes last, as the others.
    groups.sort_by_key(|(names, _)| names.len());
    let Some((_, steps)) = groups.first() else { return Vec::new() };
    let name_width = PAST_NAME.min(width / 3);
    let widths = step_widths(steps, width.saturating_sub(name_width));
    let heads = steps.iter().zip(&widths).map(|(step, width)| {
        let name = step.name.to_lowercase().chars().take(width - 1).collect::<String>();
        format!("{name:<width$}")
    });
    let heads = format!("{:<name_width$}{}", "trust", heads.collect::<String>());
    let mut lines = vec![Line::styled(heads.trim_end().to_owned(), DIM)];
    let count = groups.len();
    for (index, (names, steps)) in groups.into_iter().enumerate() {
        let name = match (names.len(), count) {
            (2.., 1) => "all".to_owned(),
            (2.., _) if index + 1 == count => "others".to_owned(),
            _ => names.join(", "),
        };
        let name = Span::raw(format!("{:<name_width$}", cut(&name, name_width - 1)));
        lines.push(Line::from([vec![name], steps_of(steps, &widths, ink)].concat()));
    }
    lines
}

/// Returns the widths of the step columns: the whole of each name if there is room, otherwise its beginning.
fn step_widths(steps: &[Step], width: usize) -> Vec<usize> {
    let widths: Vec<_> = steps.iter().map(|step| step.name.len() + 1).collect();
    let room = width + 1;
    let is_wide = widths.iter().sum::<usize>() <= room;
    if is_wide { widths } else { vec![(room / steps.len()).max(2); steps.len()] }
}

fn steps_of(steps: &[Step], widths: &[usize], ink: Ink) -> Vec<Span<'static>> {
    let mut spans = Vec::new();
    for (index, (step, width)) in steps.iter().zip(widths).enumerate() {
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
    spans
}

/// Returns the received signals, each with its raw value, meaning and age.
pub(super) fn signal_lines(view: &GatewayView, width: usize) -> Vec<Line<'static>> {
    let names = view.signals.iter().map(|signal| signal.name.chars().count()).max().unwrap_or(0);
    let names = names.min(width / 2);
    let line = |signal: &RawView| {
        let name = format!("{:<names$}", cut(&signal.name, names));
        Line::from(vec![
            Span::styled(format!("  {name}  "), DIM),
            Span::raw(cut(&signal.text(), width.saturating_sub(names + 4))),
        ])
    };
    view.signals.iter().map(line).collect()
}
