//! The log of the process on standard error: it never blocks and never fails, and one kind of message cannot
//! flood it.
//!
//! Lines wait in an [`OutputQueue`]. At most `MAX_LINES` of one kind are written within `WINDOW`, followed by
//! a line with the number of further messages and the last of them. Debug and trace messages, which must be
//! requested, are not limited. If standard error is the journal, a line is a record with a priority and
//! fields.

mod limits;
mod warnings;

use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt;
use std::io;
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::{Context, Filter, Layer, SubscriberExt as _};
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::journal;
pub use super::journal::JournalField;
use super::lock::lock;
use super::output_queue::{Loss, OutputQueue};
use crate::process_status::log::LogState;
use limits::{EventText, LogLimits, MessageKind, WINDOW};
use ros_transport::link::LostLines;
pub use warnings::{TakenWarnings, Warning, take_warnings};

/// Longest time that a panicking thread waits for its message to be written.
const PANIC_PATIENCE: Duration = Duration::from_millis(500);

/// Our other crates that log; a level set for this crate also applies to them.
pub const LOGGING_CRATES: [&str; 1] = ["ros_transport"];

static LOG: OnceLock<ProcessLog> = OnceLock::new();

struct ProcessLog {
    queue: OutputQueue,
    /// Format of a line; `None` if each text of the queue is a record of the journal.
    format: Option<LineFormat>,
    limits: Mutex<LogLimits>,
    /// Number of dropped lines that the log has reported.
    reported: AtomicU64,
}

/// The form of the log's lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogForm {
    /// With time and level, for a long-running process; without time and colour under systemd, since the
    /// journal adds them.
    Timed,
    /// With the level as a word, `warning: …`, for a command.
    Messages,
}

/// Starts the log with the messages that `filter` lets through. A second start changes nothing. Fails if
/// standard error cannot be duplicated or the thread cannot be started.
pub fn start(filter: EnvFilter, form: LogForm, has_color: bool) -> io::Result<()> {
    if LOG.get().is_some() {
        return Ok(());
    }
    let journal = journal::open();
    let has_time = std::env::var_os("JOURNAL_STREAM").is_none();
    let format =
        LineFormat { form, has_time, has_color: has_color && (has_time || form == LogForm::Messages) };
    let log = ProcessLog {
        queue: match &journal {
            Some(journal) => OutputQueue::start_datagrams("log", journal)?,
            None => OutputQueue::start("log", &io::stderr())?,
        },
        format: journal.is_none().then_some(format),
        limits: Mutex::default(),
        reported: AtomicU64::new(0),
    };
    if LOG.set(log).is_err() {
        return Ok(());
    }
    let layer = if journal.is_some() {
        JournalLayer.boxed()
    } else {
        tracing_subscriber::fmt::layer()
            .with_writer(|| LineWriter)
            .log_internal_errors(false)
            .with_ansi(format.has_color)
            .event_format(format)
            .boxed()
    };
    let subscriber = tracing_subscriber::registry().with(filter).with(layer.with_filter(KindLimit));
    // A subscriber is already installed; nothing to do.
    drop(subscriber.try_init());
    std::panic::set_hook(Box::new(|panic| {
        let trace = Backtrace::capture();
        if trace.status() == BacktraceStatus::Captured {
            tracing::error!("{panic}\n{trace}");
        } else {
            tracing::error!("{panic}");
        }
        flush(PANIC_PATIENCE);
    }));
    Ok(())
}

/// Writes lines unchanged. Before the log is started they go straight to standard error, and errors are
/// ignored. With the journal they go to standard error as well, since the process may be about to end: the
/// journal cannot assign a record of a process that is gone to its unit, so `journalctl -u` would not show
/// it.
pub fn lines(level: Level, text: &str) {
    match LOG.get() {
        Some(log) if !log.is_journal() => log.write(level, text, &[]),
        Some(_) => write_directly(&journal::with_priority(level, text)),
        None => write_directly(&format!("{text}\n")),
    }
}

fn write_directly(text: &str) {
    // An error cannot be reported anywhere else.
    drop(io::Write::write_all(&mut io::stderr(), text.as_bytes()));
}

/// Logs an error, a warning or information about a subject, with these fields in the journal. Messages about
/// one subject are limited together.
pub fn record(level: Level, subject: &str, text: &str, fields: &[JournalField<'_>]) {
    let Some(log) = LOG.get().filter(|log| log.is_journal()) else {
        match level {
            Level::ERROR => tracing::error!(log.subject = subject, "{text}"),
            Level::WARN => tracing::warn!(log.subject = subject, "{text}"),
            _ => tracing::info!(log.subject = subject, "{text}"),
        }
        return;
    };
    let is_enabled = match level {
        Level::ERROR => tracing::enabled!(Level::ERROR),
        Level::WARN => tracing::enabled!(Level::WARN),
        _ => tracing::enabled!(Level::INFO),
    };
    let kind = MessageKind::of_subject(subject);
    if is_enabled {
        warnings::offer(kind.clone(), Warning::new(level, text));
    }
    if is_enabled && log.admits(kind, text, level) {
        log.write(level, text, fields);
    }
}

/// Passes a message about a subject to the warnings queue, without logging it.
pub fn warn_others(level: Level, subject: &str, text: &str) {
    warnings::offer(MessageKind::of_subject(subject), Warning::new(level, text));
}

/// Writes to a duplicate of another file from the next line on, unless the log goes to the journal.
pub fn redirect(to: &impl AsFd) {
    // If the file cannot be duplicated, the log keeps its present destination.
    let _ = LOG.get().filter(|log| !log.is_journal()).map(|log| log.queue.redirect(to));
}

/// Waits until everything is written, including lines about suppressed messages, at most for `patience`.
pub fn flush(patience: Duration) {
    if let Some(log) = LOG.get() {
        let mut limits = lock(&log.limits);
        limits.settle(Instant::now() + WINDOW);
        log.write_summaries(&mut limits);
        drop(limits);
        log.queue.flush(patience);
    }
}

/// Returns how many lines the log of this process has lost; see [`state`].
pub fn lost_lines() -> LostLines {
    state().unwrap_or_default().lost_lines()
}

/// Returns the state of the log; `None` without one. Call it regularly, since it also writes the lines about
/// suppressed or dropped messages.
pub fn state() -> Option<LogState> {
    let log = LOG.get()?;
    let suppressed = {
        let mut limits = lock(&log.limits);
        limits.settle(Instant::now());
        log.write_summaries(&mut limits);
        limits.suppressed
    };
    let losses = log.queue.losses();
    let unreported = losses.lines - log.reported.load(Ordering::Relaxed);
    if unreported > 0 && !losses.is_losing {
        log.reported.store(losses.lines, Ordering::Relaxed);
        log.write_own(Level::WARN, &format!("{unreported} lines were dropped"));
    }
    let last_error = losses.last.map(|loss| match loss {
        Loss::Full if log.is_journal() => "the journal does not read".to_owned(),
        Loss::Full => "standard error is not read".to_owned(),
        Loss::Error(kind) if log.is_journal() => format!("the journal: {kind}"),
        Loss::Error(kind) => format!("standard error: {kind}"),
    });
    Some(LogState { suppressed, dropped: losses.lines, last_error, is_failing: losses.is_losing })
}

impl ProcessLog {
    /// Counts a message and returns true if it is to be written.
    fn admits(&self, kind: MessageKind, text: &str, level: Level) -> bool {
        let mut limits = lock(&self.limits);
        let is_admitted = limits.admit(kind, text, level, Instant::now());
        self.write_summaries(&mut limits);
        is_admitted
    }

    /// Writes directly, since this may be called while a message is being logged.
    fn write_summaries(&self, limits: &mut LogLimits) {
        for (level, summary) in limits.summaries.drain(..) {
            self.write_own(level, &summary);
        }
    }

    fn is_journal(&self) -> bool {
        self.format.is_none()
    }

    /// Writes a message of the log about itself in the form of all other messages.
    fn write_own(&self, level: Level, text: &str) {
        let prefix = self.format.map_or(String::new(), |format| format.prefix(level));
        self.write(level, &format!("{prefix}log: {text}"), &[]);
    }

    /// Queues a line, or a record of the journal.
    fn write(&self, level: Level, text: &str, fields: &[JournalField<'_>]) {
        if self.is_journal() {
            self.queue.push(&journal::datagram(level, text, fields));
        } else {
            self.queue.push(format!("{text}\n").as_bytes());
        }
    }
}

/// Turns each event into a record of the journal with its fields.
struct JournalLayer;

impl<S: Subscriber> Layer<S> for JournalLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let Some(log) = LOG.get() else { return };
        let mut text = EventText::default();
        event.record(&mut text);
        let fields = [
            JournalField { name: "TARGET", text: event.metadata().target() },
            JournalField { name: "INTERFACE", text: &text.interface },
        ];
        log.write(*event.metadata().level(), &text.whole(), &fields);
    }
}

/// The format of a line: `warning: …` as compilers write it, or time, level and message.
#[derive(Debug, Clone, Copy)]
struct LineFormat {
    form: LogForm,
    /// True if a timed line begins with its time.
    has_time: bool,
    has_color: bool,
}

impl LineFormat {
    /// Returns what a line has before its message.
    fn prefix(self, level: Level) -> String {
        let colored = |codes: &str, text: &str| {
            if self.has_color { format!("\u{1b}[{codes}m{text}\u{1b}[0m") } else { text.to_owned() }
        };
        let (word, color) = match level {
            Level::ERROR => ("error", "31"),
            Level::WARN => ("warning", "33"),
            Level::INFO => ("note", "32"),
            Level::DEBUG => ("note", "34"),
            Level::TRACE => ("note", "35"),
        };
        if self.form == LogForm::Messages {
            return format!("{}: ", colored(&format!("1;{color}"), word));
        }
        let mut time = String::new();
        // Writing to a String cannot fail.
        let _ = SystemTime.format_time(&mut Writer::new(&mut time));
        let time = if self.has_time { format!("{} ", colored("2", &time)) } else { String::new() };
        format!("{time}{} ", colored(color, &format!("{level:>5}")))
    }
}

impl<S, N> FormatEvent<S, N> for LineFormat
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut line: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        write!(line, "{}", self.prefix(*event.metadata().level()))?;
        context.format_fields(line.by_ref(), event)?;
        writeln!(line)
    }
}

struct LineWriter;

impl io::Write for LineWriter {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        if let Some(log) = LOG.get() {
            log.queue.push(text);
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Filters messages by [`LogLimits`].
struct KindLimit;

impl<S: Subscriber> Filter<S> for KindLimit {
    fn enabled(&self, _: &Metadata<'_>, _: &Context<'_, S>) -> bool {
        true
    }

    fn event_enabled(&self, event: &Event<'_>, _: &Context<'_, S>) -> bool {
        let metadata = event.metadata();
        let Some(log) = LOG.get() else { return true };
        if *metadata.level() > Level::INFO {
            return true;
        }
        let mut text = EventText::default();
        event.record(&mut text);
        let kind = MessageKind::new(metadata.target(), metadata.line(), &text);
        if is_for_others(metadata.target()) {
            warnings::offer(kind.clone(), Warning::of_event(metadata, &text));
        }
        log.admits(kind, &text.message, *metadata.level())
    }
}

/// Returns true for our own messages, except messages of the ROS side, which would be sent over the transport
/// that they report on.
fn is_for_others(target: &str) -> bool {
    target.starts_with(env!("CARGO_CRATE_NAME"))
        && !target.starts_with(concat!(env!("CARGO_CRATE_NAME"), "::io::ros"))
}

#[cfg(test)]
mod tests;
