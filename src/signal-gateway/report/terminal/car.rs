//! The car from above, front up, with its turn indicators.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::ink::{DIM, Ink};
use super::view_model::Model;
use crate::report::gateway_view::Lamp;
use gateway_base::diagnostics::Level;

/// Width of [`large`].
pub(super) const LARGE_WIDTH: u16 = 25;

/// Roof, windows and bonnet.
const BODY: [&str; 8] = [
    "╭─────────╮",
    "│ ╭─────╮ │",
    "│ │     │ │",
    "│ ├─────┤ │",
    "│ │     │ │",
    "│ ├─────┤ │",
    "│ ╰─────╯ │",
    "╰─────────╯",
];
/// Lines with arrows: at the headlights, and at the rear lights.
const ARROWS: [usize; 2] = [1, 6];

/// Draws the car in nine lines, the last of which describes the lights in a word.
pub(super) fn large(model: &Model, ink: Ink) -> Vec<Line<'static>> {
    let [left, right] = model.picture.lamps;
    let mut lines: Vec<_> = (0..)
        .zip(BODY)
        .map(|(index, body)| {
            if !ARROWS.contains(&index) {
                return Line::raw(format!("       {body}"));
            }
            let (left, left_style) = arrow(left, ["◀━━━", "◁───"], model, ink);
            let (right, right_style) = arrow(right, ["━━━▶", "───▷"], model, ink);
            Line::from(vec![
                Span::raw("  "),
                Span::styled(left, left_style),
                Span::raw(format!(" {body} ")),
                Span::styled(right, right_style),
            ])
        })
        .collect();
    lines.push(caption(model, ink, LARGE_WIDTH.into()));
    lines
}

/// Draws the car in three lines across the whole width, with the word beside it.
pub(super) fn small(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let [left, right] = model.picture.lamps;
    let (left, left_style) = arrow(left, ["◀━━━━", "◁────"], model, ink);
    let (right, right_style) = arrow(right, ["━━━━▶", "────▷"], model, ink);
    let pad = " ".repeat(width.saturating_sub(23) / 2);
    vec![
        Line::raw(format!("{pad}      ╭─┬─────┬─╮")),
        Line::from(vec![
            Span::raw(pad.clone()),
            Span::styled(left, left_style),
            Span::raw(" │ │     │ │ "),
            Span::styled(right, right_style),
        ]),
        Line::raw(format!("{pad}      ╰─┴─────┴─╯")),
        caption(model, ink, width),
    ]
}

/// Returns an arrow, full while the lamp is lit and otherwise hollow.
fn arrow(lamp: Lamp, [full, hollow]: [&'static str; 2], model: &Model, ink: Ink) -> (String, Style) {
    let length = full.chars().count();
    match lamp {
        Lamp::Unknown => (format!("{:^length$}", "?"), ink.level(Level::Error)),
        Lamp::Off => (hollow.to_owned(), DIM),
        Lamp::Lit => (full.to_owned(), ink.amber()),
        Lamp::Flashing if model.is_bright() => (full.to_owned(), ink.amber()),
        Lamp::Flashing => (hollow.to_owned(), ink.amber()),
    }
}

fn caption(model: &Model, ink: Ink, width: usize) -> Line<'static> {
    let lamps = model.picture.lamps;
    let style = if lamps.iter().any(|lamp| matches!(lamp, Lamp::Flashing | Lamp::Lit)) {
        ink.amber()
    } else if lamps.contains(&Lamp::Unknown) {
        ink.level(Level::Error)
    } else {
        Style::new()
    };
    Line::styled(format!("{:^width$}", model.picture.caption), style)
}
