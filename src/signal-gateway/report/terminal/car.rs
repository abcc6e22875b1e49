//! The car from above, front up, with its turn indicators.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::ink::{DIM, Ink};
use super::view_model::Model;
use crate::report::gateway_view::Lamp;
use gateway_base::diagnostics::Level;

pub(super) const LARGE_WIDTH: u16 = 25;

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
    let line = |(index, body)| {
        if !ARROWS.contains(&index) {
            return Line::raw(format!("       {body}"));
        }
        let left = arrow(left, ["◀━━━", "◁───"], model, ink);
        let right = arrow(right, ["━━━▶", "───▷"], model, ink);
        Line::from(vec![Span::raw("  "), left, Span::raw(format!(" {body} ")), right])
    };
    let lines = BODY.into_iter().enumerate().map(line);
    lines.chain([caption(model, ink, LARGE_WIDTH.into())]).collect()
}

/// Draws the car in three lines across the whole width, with the word beside it.
pub(super) fn small(model: &Model, ink: Ink, width: usize) -> Vec<Line<'static>> {
    let [left, right] = model.picture.lamps;
    let left = arrow(left, ["◀━━━━", "◁────"], model, ink);
    let right = arrow(right, ["━━━━▶", "────▷"], model, ink);
    let pad = " ".repeat(width.saturating_sub(23) / 2);
    vec![
        Line::raw(format!("{pad}      ╭─┬─────┬─╮")),
        Line::from(vec![Span::raw(pad.clone()), left, Span::raw(" │ │     │ │ "), right]),
        Line::raw(format!("{pad}      ╰─┴─────┴─╯")),
        caption(model, ink, width),
    ]
}

/// Returns an arrow, full while the lamp is lit and otherwise hollow.
fn arrow(lamp: Lamp, [full, hollow]: [&'static str; 2], model: &Model, ink: Ink) -> Span<'static> {
    let length = full.chars().count();
    match lamp {
        Lamp::Unknown => Span::styled(format!("{:^length$}", "?"), ink.level(Level::Error)),
        Lamp::Off => Span::styled(hollow, DIM),
        Lamp::Flashing if !model.is_bright() => Span::styled(hollow, ink.amber()),
        Lamp::Lit | Lamp::Flashing => Span::styled(full, ink.amber()),
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
