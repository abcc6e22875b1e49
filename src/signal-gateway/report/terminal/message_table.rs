//! A table of the messages on the buses, as `decode --live` shows it: rows, their order, and the filter.

use std::cmp::Reverse;
use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use serde::Serialize;

use can_signal::can::CanId;
use gateway_base::names::variant_name;

const PAGE: usize = 10;
/// Maximum length of the filter, characters.
const MAX_FILTER: usize = 40;
/// Minimum silence that is shown as such.
const SILENCE: Duration = Duration::from_secs(1);

/// The last frame of an identifier.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageRow {
    /// Interface that received it.
    pub interface: String,
    /// Identifier.
    pub id: CanId,
    /// Name in the DBC; `None` if it has none.
    pub name: Option<String>,
    /// Data bytes, each with the time since it changed; `None` if it never did.
    pub bytes: Vec<(u8, Option<Duration>)>,
    /// Mean time between frames; `None` after the first frame.
    pub period: Option<Duration>,
    /// Time since the frame.
    pub age: Duration,
    /// Reason why the gateway would reject it; `None` if it would not.
    pub rejected: Option<String>,
    /// Signals that the profile binds, with their values.
    pub bound_signals: Vec<String>,
    /// The other signals of the DBC.
    pub other_signals: Vec<String>,
}

/// The table, with its order, filter and scroll position.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MessageTable {
    /// All rows, by bus and identifier.
    pub rows: Vec<MessageRow>,
    /// Order in which they are shown.
    pub order: Order,
    /// Only rows that contain this text are shown.
    pub filter: String,
    /// True while the filter is being typed.
    pub is_typing: bool,
    /// True to show all signals of the DBC.
    pub has_all_signals: bool,
    /// Index of the first row in view.
    pub first: usize,
}

/// Order of the rows; equal rows are ordered by bus and identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// By bus and identifier.
    #[default]
    Id,
    /// The most frequent first.
    Rate,
    /// The most recently changed first.
    Change,
}

impl MessageRow {
    /// Returns the frame rate, Hz; `None` after the first frame, and once frames have stopped.
    pub fn rate_hz(&self) -> Option<f64> {
        let period = self.period.filter(|period| !period.is_zero() && !self.is_silent())?;
        Some(1.0 / period.as_secs_f64())
    }

    /// Returns true if far more time than usual has passed since the last frame.
    pub fn is_silent(&self) -> bool {
        self.age > self.period.map_or(SILENCE, |period| (period * 3).max(SILENCE))
    }

    /// Returns the time since any byte changed; `None` if none ever did.
    pub fn since_change(&self) -> Option<Duration> {
        self.bytes.iter().filter_map(|(_, since)| *since).min()
    }

    /// Returns true if identifier, name, interface or a signal contains `text`, which is in lower case.
    fn contains(&self, text: &str) -> bool {
        let id = self.id.to_string();
        let texts = [&id, &self.interface].into_iter().chain(&self.name);
        let signals = self.bound_signals.iter().chain(&self.other_signals);
        texts.chain(signals).any(|part| part.to_lowercase().contains(text))
    }
}

impl MessageTable {
    /// Returns the rows that pass the filter, in order.
    pub fn shown(&self) -> Vec<&MessageRow> {
        let text = self.filter.to_lowercase();
        let mut rows: Vec<_> = self.rows.iter().filter(|row| row.contains(&text)).collect();
        match self.order {
            Order::Id => {}
            // In steps of a quarter, so that rows of equal rate do not constantly change places.
            Order::Rate => rows.sort_by_key(|row| {
                #[allow(clippy::cast_possible_truncation)] // far from the limits
                let step = |rate: f64| (rate.log2() * 3.0).round() as i64;
                Reverse(row.rate_hz().map_or(i64::MIN, step))
            }),
            // In seconds, as above.
            Order::Change => {
                rows.sort_by_key(|row| row.since_change().map_or(u64::MAX, |since| since.as_secs()));
            }
        }
        rows
    }

    /// Handles a key; returns false if it is not a key of the table.
    #[allow(clippy::wildcard_enum_match_arm)] // all other keys have no meaning here
    pub fn press(&mut self, key: KeyEvent) -> bool {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return false;
        }
        if self.is_typing {
            self.type_filter(key.code);
            return true;
        }
        let last = self.shown().len().saturating_sub(1);
        match key.code {
            KeyCode::Char('/') => self.is_typing = true,
            KeyCode::Char('s') => self.order = self.order.next(),
            KeyCode::Char('d') => self.has_all_signals = !self.has_all_signals,
            KeyCode::Esc if !self.filter.is_empty() => self.filter.clear(),
            KeyCode::Up => self.first = self.first.saturating_sub(1),
            KeyCode::Down => self.first = (self.first + 1).min(last),
            KeyCode::PageUp => self.first = self.first.saturating_sub(PAGE),
            KeyCode::PageDown => self.first = (self.first + PAGE).min(last),
            KeyCode::Home => self.first = 0,
            KeyCode::End => self.first = last,
            _ => return false,
        }
        true
    }

    #[allow(clippy::wildcard_enum_match_arm)] // as above
    fn type_filter(&mut self, key: KeyCode) {
        match key {
            KeyCode::Char(char) if self.filter.chars().count() < MAX_FILTER => self.filter.push(char),
            KeyCode::Backspace => drop(self.filter.pop()),
            KeyCode::Enter => self.is_typing = false,
            KeyCode::Esc => {
                self.filter.clear();
                self.is_typing = false;
            }
            _ => {}
        }
        self.first = 0;
    }
}

impl Order {
    /// Returns the name shown in the footer.
    pub fn name(self) -> &'static str {
        variant_name(&self)
    }

    fn next(self) -> Self {
        match self {
            Self::Id => Self::Rate,
            Self::Rate => Self::Change,
            Self::Change => Self::Id,
        }
    }
}
