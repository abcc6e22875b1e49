//! A bounded queue of warnings and errors for `/rosout`.
//!
//! They are limited like the messages of the log. If the queue is full, the oldest are dropped.

use std::collections::VecDeque;
use std::sync::{LazyLock, Mutex};
use std::time::Instant;

use tracing::{Level, Metadata};

use super::limits::{EventText, LogLimits, MessageKind, TARGET};
use crate::io::clock::Clock;
use crate::io::lock::lock;
use gateway_base::time::WallStamp;

const MAX_WAITING: usize = 128;
/// Maximum length of a warning's text, bytes.
const MAX_TEXT: usize = 4096;

static WAITING: LazyLock<Mutex<WarningQueue>> = LazyLock::new(Mutex::default);

/// A warning or an error of this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// When it was logged.
    pub at: WallStamp,
    /// Level: warning or error.
    pub level: Level,
    /// The message, followed by its fields.
    pub text: String,
    /// Source file, or empty if unknown.
    pub file: String,
    /// Module, or empty if unknown.
    pub module: String,
    /// Line in the file, or 0 if unknown.
    pub line: u32,
}

/// The warnings since they were last taken.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct TakenWarnings {
    /// The warnings, oldest first.
    pub warnings: VecDeque<Warning>,
    /// Number of warnings that were dropped because there was no room.
    pub dropped: u64,
}

#[derive(Debug, Default)]
struct WarningQueue {
    limits: LogLimits,
    queue: TakenWarnings,
}

impl Warning {
    /// Creates a warning with the current time and without a source location.
    pub(super) fn new(level: Level, text: &str) -> Self {
        let end =
            (0..=text.len().min(MAX_TEXT)).rev().find(|end| text.is_char_boundary(*end)).unwrap_or_default();
        let text = text.get(..end).unwrap_or_default().to_owned();
        let at = Clock::start().now().wall;
        Self { at, level, text, file: String::new(), module: String::new(), line: 0 }
    }

    pub(super) fn of_event(metadata: &Metadata<'_>, event: &EventText) -> Self {
        let warning = Self::new(*metadata.level(), &event.whole());
        // Texts passed to the log functions originate elsewhere.
        if metadata.target() == TARGET {
            return warning;
        }
        Self {
            file: metadata.file().unwrap_or_default().to_owned(),
            module: metadata.target().to_owned(),
            line: metadata.line().unwrap_or_default(),
            ..warning
        }
    }
}

/// Queues a message if it is at least a warning and its kind is within the limit.
pub(super) fn offer(kind: MessageKind, warning: Warning) {
    lock(&WAITING).offer(kind, warning, Instant::now());
}

/// Takes the queued warnings. Suppressed ones are summed up once their time window is over.
pub fn take_warnings() -> TakenWarnings {
    lock(&WAITING).take(Instant::now())
}

impl WarningQueue {
    fn offer(&mut self, kind: MessageKind, warning: Warning, now: Instant) {
        // A more severe tracing level compares as smaller.
        if warning.level <= Level::WARN && self.limits.admit(kind, &warning.text, warning.level, now) {
            self.add(warning);
        }
        self.add_summaries();
    }

    fn take(&mut self, now: Instant) -> TakenWarnings {
        self.limits.settle(now);
        self.add_summaries();
        std::mem::take(&mut self.queue)
    }

    fn add_summaries(&mut self) {
        for (level, summary) in std::mem::take(&mut self.limits.summaries) {
            self.add(Warning::new(level, &format!("log: {summary}")));
        }
    }

    fn add(&mut self, warning: Warning) {
        if self.queue.warnings.len() >= MAX_WAITING {
            self.queue.warnings.pop_front();
            self.queue.dropped += 1;
        }
        self.queue.warnings.push_back(warning);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn kind(subject: u32) -> MessageKind {
        MessageKind { subject: subject.to_string(), ..MessageKind::default() }
    }

    fn texts(taken: &TakenWarnings) -> Vec<&str> {
        taken.warnings.iter().map(|warning| warning.text.as_str()).collect()
    }

    #[test]
    fn warnings_and_errors_wait_until_they_are_taken_and_nothing_else_does() {
        let (mut waiting, now) = (WarningQueue::default(), Instant::now());
        for level in [Level::TRACE, Level::DEBUG, Level::INFO, Level::WARN, Level::ERROR] {
            waiting.offer(kind(0), Warning::new(level, level.as_str()), now);
        }
        assert_eq!(texts(&waiting.take(now)), ["WARN", "ERROR"]);
        assert_eq!(waiting.take(now), TakenWarnings::default());
    }

    #[test]
    fn many_of_a_kind_are_summed_up_and_what_finds_no_room_is_counted() {
        let (mut waiting, now) = (WarningQueue::default(), Instant::now());
        (0..30).for_each(|number| {
            waiting.offer(kind(0), Warning::new(Level::WARN, &format!("can0: {number}")), now);
        });
        let first = waiting.take(now);
        assert_eq!((first.warnings.len(), first.dropped), (10, 0));
        let later = waiting.take(now + Duration::from_secs(60));
        assert_eq!(texts(&later), ["log: 20 more times in 1 s, the last: can0: 29"]);
        (0..200).for_each(|number| waiting.offer(kind(number), Warning::new(Level::ERROR, "x"), now));
        let taken = waiting.take(now);
        assert_eq!((taken.warnings.len(), taken.dropped), (MAX_WAITING, 72));
    }

    #[test]
    fn a_long_text_is_cut_between_characters() {
        let warning = Warning::new(Level::WARN, &"ä".repeat(MAX_TEXT));
        assert_eq!(warning.text.len(), MAX_TEXT);
        let warning = Warning::new(Level::WARN, &format!("a{}", "ä".repeat(MAX_TEXT)));
        assert_eq!(warning.text.len(), MAX_TEXT - 1);
    }

    #[test]
    fn the_ros_side_does_not_speak_of_itself_to_its_readers() {
        for (target, expected) in [
            ("signal_gateway::daemon::reload", true),
            ("signal_gateway::io::recorder", true),
            ("signal_gateway::io::ros::session::exchange", false),
            ("ros_transport::dds::worker", false),
            ("rustdds::rtps::writer", false),
            ("log", false),
        ] {
            assert_eq!(super::super::is_for_others(target), expected, "{target}");
        }
    }
}
