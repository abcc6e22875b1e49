//! Contents of the view, independent of a terminal: its data, and the effects of its keys.

use std::collections::VecDeque;
use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::message_table::{MessageRow, MessageTable};
use crate::report::gateway_view::{GatewayView, Mark, ReportView};
use gateway_base::diagnostics::Level;

/// Span of the strip, ms.
pub const STRIP_MS: i64 = 60_000;
/// Maximum number of stored log lines: some hours of changes.
const MAX_LINES: usize = 20_000;
const PAGE: usize = 10;
/// Half a period of a blinking arrow: 1.5 Hz.
const HALF_BLINK: Duration = Duration::from_millis(333);

/// Everything that the view shows.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Heading: what is running.
    pub title: String,
    /// Address of the live page for a browser; `None` while it is off.
    pub url: Option<String>,
    /// True to draw in colour.
    pub has_color: bool,
    /// Effect of the keys.
    pub keys: Keys,
    /// Time since the start of the view, for blinking parts.
    pub elapsed: Duration,
    /// Time of the gateway since its start; `None` without a gateway.
    pub at: Option<Duration>,
    /// Caption for the current situation, in a sentence; empty without one.
    pub caption: String,
    /// The current state, or while paused the state at the pause.
    pub picture: GatewayView,
    /// Messages on the buses, shown in place of the vehicle; `None` if they are not shown.
    pub messages: Option<MessageTable>,
    /// Past states within [`STRIP_MS`], oldest first: a stamp in ms, and the state of each report.
    pub history: VecDeque<(i64, Vec<Past>)>,
    /// Log, oldest line first.
    pub log: VecDeque<LogLine>,
    /// Number of lines by which the log is scrolled back.
    pub scroll: usize,
    /// True while the picture is frozen.
    pub is_paused: bool,
    /// True while the help is shown.
    pub has_help: bool,
}

/// Additional keys besides the keys of every view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Keys {
    /// No additional keys.
    #[default]
    View,
    /// Keys for the driver's stalk and button.
    Driver,
}

/// A past state of a report.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Past {
    /// The kind of value that was published.
    pub mark: Mark,
    /// The first measured value, in the unit for display; `None` without one.
    pub value: Option<f64>,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// Severity; `None` if unknown.
    pub level: Option<Level>,
    /// The line, without control sequences.
    pub text: String,
}

/// Request of a key that is not handled by the view itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyRequest {
    /// End of the command.
    Quit,
    /// A line for the simulated vehicle.
    Driver(&'static str),
}

impl Model {
    /// Shows a new state, unless the picture is frozen.
    pub fn show(&mut self, picture: GatewayView) {
        if self.is_paused {
            return;
        }
        let at = picture.stamp_ms;
        // A clock that was set back starts a new history.
        if self.history.back().is_some_and(|(last, _)| *last > at) {
            self.history.clear();
        }
        let past = |report: &ReportView| {
            let value = report.measures.first().map(|measure| measure.value);
            Past { mark: report.mark, value }
        };
        self.history.push_back((at, picture.reports.iter().map(past).collect()));
        while self.history.front().is_some_and(|(first, _)| at - first > STRIP_MS) {
            self.history.pop_front();
        }
        self.picture = picture;
    }

    /// Shows new rows of the table, unless the picture is frozen.
    pub fn show_messages(&mut self, rows: Vec<MessageRow>) {
        if let Some(table) = self.messages.as_mut().filter(|_| !self.is_paused) {
            table.rows = rows;
        }
    }

    /// Adds a line to the log.
    pub fn add_line(&mut self, level: Option<Level>, text: String) {
        if self.log.len() == MAX_LINES {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { level, text });
        // Older lines that are being read stay in view.
        if self.scroll > 0 {
            self.scroll = (self.scroll + 1).min(self.log.len() - 1);
        }
    }

    /// Returns the time for heading and log: the gateway's time, otherwise the view's.
    pub fn time(&self) -> Duration {
        self.at.unwrap_or(self.elapsed)
    }

    /// Returns true in the bright half of a blink.
    pub fn is_bright(&self) -> bool {
        (self.elapsed.as_millis() / HALF_BLINK.as_millis()).is_multiple_of(2)
    }

    /// Handles a key; returns a request that the view does not handle itself.
    #[allow(clippy::wildcard_enum_match_arm)] // all other keys have no meaning
    pub fn press(&mut self, key: KeyEvent) -> Option<KeyRequest> {
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        if self.messages.as_mut().is_some_and(|table| !self.has_help && table.press(key)) {
            return None;
        }
        let last = self.log.len().saturating_sub(1);
        match key.code {
            KeyCode::Char('c') if is_control => return Some(KeyRequest::Quit),
            KeyCode::Char('?') => self.has_help = !self.has_help,
            KeyCode::Esc => self.has_help = false,
            KeyCode::Char('q') => return Some(KeyRequest::Quit),
            KeyCode::Char(' ') => self.is_paused = !self.is_paused,
            KeyCode::Up => self.scroll = (self.scroll + 1).min(last),
            KeyCode::Down => self.scroll = self.scroll.saturating_sub(1),
            KeyCode::PageUp => self.scroll = (self.scroll + PAGE).min(last),
            KeyCode::PageDown => self.scroll = self.scroll.saturating_sub(PAGE),
            KeyCode::Home => self.scroll = last,
            KeyCode::End => self.scroll = 0,
            code if self.keys == Keys::Driver => return driver(code).map(KeyRequest::Driver),
            _ => {}
        }
        None
    }
}

#[allow(clippy::wildcard_enum_match_arm)] // as above
fn driver(code: KeyCode) -> Option<&'static str> {
    Some(match code {
        KeyCode::Left => "stalk left",
        KeyCode::Right => "stalk right",
        KeyCode::Char('o') => "stalk off",
        KeyCode::Char('h') => "hazard press",
        KeyCode::Char('f') => "fault bulb left",
        KeyCode::Char('c') => "clear",
        _ => return None,
    })
}
