//! Limits of the log: messages of one kind are written a few times, and then counted.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::time::{Duration, Instant};

use tracing::Level;
use tracing::field::{Field, Visit};

/// Maximum number of lines of one kind within [`WINDOW`].
const MAX_LINES: u32 = 10;
pub(super) const WINDOW: Duration = Duration::from_secs(6);
/// Time without messages of a kind after which its suppressed messages are summed up.
pub(super) const QUIET: Duration = Duration::from_secs(1);
/// Maximum number of kinds; all further messages share one kind.
pub(super) const MAX_KINDS: usize = 256;
/// Field with the subject of a message.
const SUBJECT: &str = "log.subject";
/// Target of texts passed to the log functions, which are logged from this module.
pub(super) const TARGET: &str = concat!(env!("CARGO_CRATE_NAME"), "::io::process_log");

/// The fields of an event; subject or interface determine its kind.
#[derive(Default)]
pub(super) struct EventText {
    pub(super) message: String,
    /// Subject of the message. Lines do not show it: tracing omits all fields whose names begin with `log.`.
    pub(super) subject: String,
    pub(super) interface: String,
    /// All other fields, as ` name=value`.
    pub(super) more: String,
}

impl EventText {
    /// Returns the interface, the message, and the other fields.
    pub(super) fn whole(&self) -> String {
        let Self { message, interface, more, .. } = self;
        let subject = if interface.is_empty() { String::new() } else { format!("{interface}: ") };
        format!("{subject}{message}{more}")
    }
}

impl Visit for EventText {
    fn record_str(&mut self, field: &Field, value: &str) {
        match field.name() {
            "interface" => value.clone_into(&mut self.interface),
            SUBJECT => value.clone_into(&mut self.subject),
            // A message from the crate `log`, which has no source line here.
            "log.target" => {
                value.clone_into(&mut self.subject);
                self.record_debug(field, &value);
            }
            _ => self.record_debug(field, &value),
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let text = match field.name() {
            "message" => &mut self.message,
            "interface" => &mut self.interface,
            name => {
                let _ = write!(self.more, " {name}={value:?}");
                return;
            }
        };
        // Writing to a String cannot fail.
        let _ = write!(text, "{value:?}");
    }
}

/// A group of messages that are limited together: messages with the same subject, or from the same source
/// line.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) struct MessageKind {
    pub(super) target: String,
    pub(super) line: u32,
    pub(super) subject: String,
}

impl MessageKind {
    pub(super) fn new(target: &str, line: Option<u32>, text: &EventText) -> Self {
        if !text.subject.is_empty() {
            return Self { target: target.to_owned(), line: 0, subject: text.subject.clone() };
        }
        Self { target: target.to_owned(), line: line.unwrap_or(0), subject: text.interface.clone() }
    }

    /// Returns the kind of a text about a subject that is not an event.
    pub(super) fn of_subject(subject: &str) -> Self {
        Self { target: TARGET.to_owned(), line: 0, subject: subject.to_owned() }
    }
}

/// The kinds of messages of the last seconds.
#[derive(Debug, Default)]
pub(super) struct LogLimits {
    pub(super) kinds: BTreeMap<MessageKind, Flood>,
    /// Number of suppressed messages since the start.
    pub(super) suppressed: u64,
    /// Lines about suppressed messages that are to be written, with their worst level.
    pub(super) summaries: Vec<(Level, String)>,
}

/// The messages of one kind within [`WINDOW`].
#[derive(Debug)]
pub(super) struct Flood {
    since: Instant,
    last_at: Instant,
    lines: u32,
    /// Number of suppressed messages since the last summary.
    suppressed: u64,
    /// The worst level of the suppressed messages.
    level: Level,
    last: String,
}

impl LogLimits {
    /// Counts a message and returns true if it is to be written.
    pub(super) fn admit(&mut self, mut kind: MessageKind, text: &str, level: Level, now: Instant) -> bool {
        if !self.kinds.contains_key(&kind) && self.kinds.len() >= MAX_KINDS {
            self.settle(now);
            if self.kinds.len() >= MAX_KINDS {
                kind = MessageKind::default();
            }
        }
        if self.kinds.get(&kind).is_some_and(|flood| flood.is_over(now)) {
            self.settle(now);
        }
        let begin =
            || Flood { since: now, last_at: now, lines: 0, suppressed: 0, level, last: String::new() };
        let flood = self.kinds.entry(kind).or_insert_with(begin);
        flood.last_at = now;
        if flood.lines < MAX_LINES {
            flood.lines += 1;
            return true;
        }
        // A more severe tracing level compares as smaller.
        flood.level = if flood.suppressed == 0 { level } else { flood.level.min(level) };
        flood.suppressed += 1;
        text.clone_into(&mut flood.last);
        self.suppressed += 1;
        false
    }

    /// Sums up the suppressed messages of kinds that are over or quiet, and forgets kinds that are over.
    pub(super) fn settle(&mut self, now: Instant) {
        let summaries = &mut self.summaries;
        self.kinds.retain(|_, flood| {
            let is_over = flood.is_over(now);
            let is_quiet = now.saturating_duration_since(flood.last_at) >= QUIET;
            if (is_over || is_quiet) && flood.suppressed > 0 {
                let seconds = flood.last_at.saturating_duration_since(flood.since).as_secs() + 1;
                let count = flood.suppressed;
                let times = if count == 1 { "once more".to_owned() } else { format!("{count} more times") };
                let text = format!("{times} in {seconds} s, the last: {}", flood.last);
                summaries.push((flood.level, text));
                flood.suppressed = 0;
            }
            !is_over
        });
    }
}

impl Flood {
    fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= WINDOW
    }
}
