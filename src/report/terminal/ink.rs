//! Styles of the view.

use ratatui::style::{Color, Modifier, Style};

use crate::core::diagnostics::Level;

/// What is less important.
pub(super) const DIM: Style = Style::new().add_modifier(Modifier::DIM);

/// Styles that are plain where colours are not wanted.
#[derive(Clone, Copy)]
pub(super) struct Ink(pub(super) bool);

impl Ink {
    pub(super) fn color(self, color: Color) -> Style {
        if self.0 { Style::new().fg(color) } else { Style::new() }
    }

    /// The amber of turn indicators.
    pub(super) fn amber(self) -> Style {
        self.color(Color::Indexed(214)).add_modifier(Modifier::BOLD)
    }

    pub(super) fn level(self, level: Level) -> Style {
        match level {
            Level::Ok => self.color(Color::Green),
            Level::Warn | Level::Stale => self.color(Color::Yellow).add_modifier(Modifier::BOLD),
            Level::Error => self.color(Color::Red).add_modifier(Modifier::BOLD),
        }
    }
}
