//! Styles of the view.

use ratatui::style::{Color, Modifier, Style};

use crate::report::palette::{self, Meaning};
use gateway_base::diagnostics::Level;

/// What is less important.
pub(super) const DIM: Style = Style::new().add_modifier(Modifier::DIM);

/// Styles that are plain where colours are not wanted.
#[derive(Clone, Copy)]
pub(super) struct Ink(pub(super) bool);

impl Ink {
    pub(super) fn color(self, color: Color) -> Style {
        if self.0 { Style::new().fg(color) } else { Style::new() }
    }

    /// A colour of the palette; the first of them have names, which every terminal knows.
    pub(super) fn terminal(self, number: u8) -> Style {
        self.color(match number {
            1 => Color::Red,
            2 => Color::Green,
            3 => Color::Yellow,
            number => Color::Indexed(number),
        })
    }

    /// The amber of turn indicators that are lit.
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
