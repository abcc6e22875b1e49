//! Styles of the view.

use ratatui::style::{Color, Modifier, Style};

use crate::report::palette::{self, Meaning};
use gateway_base::diagnostics::Level;

/// Style of less important text.
pub(super) const DIM: Style = Style::new().add_modifier(Modifier::DIM);

/// Styles, which are plain if colours are not wanted.
#[derive(Clone, Copy)]
pub(super) struct Ink(pub(super) bool);

impl Ink {
    pub(super) fn color(self, color: Color) -> Style {
        if self.0 { Style::new().fg(color) } else { Style::new() }
    }

    /// Returns the style of a palette colour; the first colours have names that every terminal supports.
    pub(super) fn terminal(self, number: u8) -> Style {
        self.color(match number {
            1 => Color::Red,
            2 => Color::Green,
            3 => Color::Yellow,
            number => Color::Indexed(number),
        })
    }

    pub(super) fn amber(self) -> Style {
        self.terminal(palette::AMBER_TERMINAL).add_modifier(Modifier::BOLD)
    }

    pub(super) fn meaning(self, meaning: Meaning) -> Style {
        self.terminal(meaning.terminal).add_modifier(Modifier::BOLD)
    }

    pub(super) fn level(self, level: Level) -> Style {
        match level {
            Level::Ok => self.terminal(palette::OK.terminal),
            Level::Warn | Level::Error | Level::Stale => self.meaning(Meaning::of(level)),
        }
    }
}
