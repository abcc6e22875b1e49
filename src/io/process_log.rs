//! The log of the process on standard error: it never blocks and never fails, and one kind of message cannot flood it.
//!
//! Lines wait in an [`OutputQueue`]. Of one kind of message `MAX_LINES` are written within `WINDOW`, and then one that
//! says how many more there were and what the last one was. Debug and trace messages, which somebody has asked for, have
//! no such limit. Where standard error is the journal, a line is a record with a priority and fields.

mod warnings;

use std::backtrace::{Backtrace, BacktraceStatus};
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io;
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, MakeWriter};
use tracing_subscriber::layer::{Context, Filter, Layer, SubscriberExt as _};
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::journal;
use super::output_queue::{Loss, OutputQueue};
use crate::core::gateway::process_status::LogState;
pub use warnings::{Warning, Warnings, take_warnings};

/// Lines of one kind that are written within [`WINDOW`].
const MAX_LINES: u32 = 10;
const WINDOW: Duration = Duration::from_secs(6);
/// So long after the last of them, those that were left out are summed up.
const QUIET: Duration = Duration::from_secs(1);
/// Longest time that a thread which panics waits for its message to be written.
const PANIC_PATIENCE: Duration = Duration::from_millis(500);
/// Kinds that are distinguished; all others are one.
const MAX_KINDS: usize = 256;

static LOG: OnceLock<ProcessLog> = OnceLock::new();

struct ProcessLog {
    queue: OutputQueue,
    /// True if each text of the queue is a record of the journal.
    is_journal: bool,
    limits: Mutex<Limits>,
    /// Number of dropped lines that the log has reported.
    reported: AtomicU64,
}

/// The form of the log's lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogForm {
    /// With time and level, as of a process that runs for long; under systemd without time and colour, which the journal
    /// adds.
    Timed,
    /// With a word for the level, `warning: …`, as of a command that somebody waits for.
    Messages,
}

/// Starts the log with the messages that `filter` lets through. A second start changes nothing.
///
/// # Errors
/// Standard error that cannot be duplicated, or a thread that cannot be started.
pub fn start(filter: EnvFilter, form: LogForm, has_color: bool) -> io::Result<()> {
    if LOG.get().is_some() {
        return Ok(());
    }
    let journal = journal::open();
    let is_journal = journal.is_some();
    let log = ProcessLog {
        queue: match &journal {
            Some(journal) => OutputQueue::start_datagrams("log", journal)?,
            None => OutputQueue::start("log", &io::stderr())?,
        },
        is_journal,
        limits: Mutex::default(),
        reported: AtomicU64::new(0),
    };
    if LOG.set(log).is_err() {
        return Ok(());
    }
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(LineWriter)
        .with_target(false)
        .log_internal_errors(false)
        .with_ansi(has_color);
    let layer = match form {
        _ if is_journal => JournalLayer.boxed(),
        LogForm::Messages => layer.event_format(MessageFormat).boxed(),
        LogForm::Timed if std::env::var_os("JOURNAL_STREAM").is_some() => {
            layer.without_time().with_ansi(false).boxed()
        }
        LogForm::Timed => layer.boxed(),
    };
    let subscriber = tracing_subscriber::registry().with(filter).with(layer.with_filter(KindLimit));
    // Already started by somebody else: nothing to do.
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

/// Writes lines as they are. Where no log was started, directly and perhaps in vain; for the journal to standard error as
/// well, since this may be the reason for which the process ends: a record of a process that is gone by the time that
/// the journal reads it belongs to no unit, and `journalctl -u` does not show it. What comes by standard error does.
pub fn lines(level: Level, text: &str) {
    match LOG.get() {
        Some(log) if !log.is_journal => log.write(level, text, &[]),
        Some(_) => write_directly(&journal::with_priority(level, text)),
        None => write_directly(&format!("{text}\n")),
    }
}

fn write_directly(text: &str) {
    // Where nobody reads standard error, there is nobody to tell.
    drop(io::Write::write_all(&mut io::stderr(), text.as_bytes()));
}

/// Logs a message, in the journal with these fields, whose names are in capitals.
pub fn record(level: Level, text: &str, fields: &[(&str, &str)]) {
    let Some(log) = LOG.get().filter(|log| log.is_journal) else {
        match level {
            Level::ERROR => tracing::error!("{text}"),
            Level::WARN => tracing::warn!("{text}"),
            Level::INFO => tracing::info!("{text}"),
            Level::DEBUG => tracing::debug!("{text}"),
            Level::TRACE => tracing::trace!("{text}"),
        }
        return;
    };
    let is_enabled = match level {
        Level::ERROR => tracing::enabled!(Level::ERROR),
        Level::WARN => tracing::enabled!(Level::WARN),
        Level::INFO => tracing::enabled!(Level::INFO),
        Level::DEBUG => tracing::enabled!(Level::DEBUG),
        Level::TRACE => tracing::enabled!(Level::TRACE),
    };
    let kind = Kind::of_text(text);
    if is_enabled {
        warnings::offer(kind.clone(), Warning::new(level, text));
    }
    if is_enabled && log.admits(kind, text, level) {
        log.write(level, text, fields);
    }
}

/// Hands a message that the log does not have to whoever takes the warnings.
pub fn warn_others(level: Level, text: &str) {
    warnings::offer(Kind::of_text(text), Warning::new(level, text));
}

/// Writes to a duplicate of another file from the next line on; the journal keeps its records.
pub fn redirect(to: &impl AsFd) {
    // One that cannot be duplicated leaves the log where it is.
    let _ = LOG.get().filter(|log| !log.is_journal).map(|log| log.queue.redirect(to));
}

/// Waits until everything is written, lines on what was suppressed included, at most for `patience`.
pub fn flush(patience: Duration) {
    if let Some(log) = LOG.get() {
        let mut limits = log.limits();
        limits.settle(Instant::now() + WINDOW);
        log.write_summaries(&mut limits);
        drop(limits);
        log.queue.flush(patience);
    }
}

/// The state of the log; `None` without one. To be called regularly, since it also writes the lines on
/// what was suppressed or dropped.
pub fn state() -> Option<LogState> {
    let log = LOG.get()?;
    let suppressed = {
        let mut limits = log.limits();
        limits.settle(Instant::now());
        log.write_summaries(&mut limits);
        limits.suppressed
    };
    let losses = log.queue.losses();
    let unreported = losses.lines - log.reported.load(Ordering::Relaxed);
    if unreported > 0 && !losses.is_losing {
        log.reported.store(losses.lines, Ordering::Relaxed);
        log.write(Level::WARN, &format!("log: {unreported} lines were dropped"), &[]);
    }
    let last_error = losses.last.map(|loss| match loss {
        Loss::Full if log.is_journal => "the journal does not read".to_owned(),
        Loss::Full => "standard error is not read".to_owned(),
        Loss::Error(kind) if log.is_journal => format!("the journal: {kind}"),
        Loss::Error(kind) => format!("standard error: {kind}"),
    });
    Some(LogState { suppressed, dropped: losses.lines, last_error, is_failing: losses.is_losing })
}

impl ProcessLog {
    fn limits(&self) -> MutexGuard<'_, Limits> {
        self.limits.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a message and returns true if it is to be written.
    fn admits(&self, kind: Kind, text: &str, level: Level) -> bool {
        let mut limits = self.limits();
        let is_admitted = limits.admit(kind, text, level, Instant::now());
        self.write_summaries(&mut limits);
        is_admitted
    }

    /// Not as messages: this may be in the middle of one.
    fn write_summaries(&self, limits: &mut Limits) {
        for (level, summary) in limits.summaries.drain(..) {
            self.write(level, &format!("log: {summary}"), &[]);
        }
    }

    /// Queues a line, or a record of the journal.
    fn write(&self, level: Level, text: &str, fields: &[(&str, &str)]) {
        if self.is_journal {
            self.queue.push(&journal::datagram(level, text, fields));
        } else {
            self.queue.push(format!("{text}\n").as_bytes());
        }
    }
}

/// Makes a record of the journal of each event: its fields are those of the event.
struct JournalLayer;

impl<S: Subscriber> Layer<S> for JournalLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let Some(log) = LOG.get() else { return };
        let mut text = EventText::default();
        event.record(&mut text);
        let fields = [("TARGET", event.metadata().target()), ("INTERFACE", text.interface.as_str())];
        log.write(*event.metadata().level(), &text.whole(), &fields);
    }
}

/// Writes an event as compilers do: `warning: …`.
struct MessageFormat;

impl<S, N> FormatEvent<S, N> for MessageFormat
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
        let (word, color) = match *event.metadata().level() {
            Level::ERROR => ("error", "31"),
            Level::WARN => ("warning", "33"),
            _ => ("note", "32"),
        };
        if line.has_ansi_escapes() {
            write!(line, "\u{1b}[1m\u{1b}[{color}m{word}\u{1b}[0m: ")?;
        } else {
            write!(line, "{word}: ")?;
        }
        context.format_fields(line.by_ref(), event)?;
        writeln!(line)
    }
}

/// Takes each event as one text.
struct LineWriter;

impl MakeWriter<'_> for LineWriter {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        Self
    }
}

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

/// Lets through what [`Limits`] admit.
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
        let kind = Kind::new(metadata.target(), metadata.line(), &text);
        if is_for_others(metadata.target()) {
            warnings::offer(kind.clone(), Warning::of_event(metadata, &text));
        }
        log.admits(kind, &text.message, *metadata.level())
    }
}

/// True for messages of our own, but for those of the ROS side: they would take the way that they are about.
fn is_for_others(target: &str) -> bool {
    target.starts_with(env!("CARGO_CRATE_NAME"))
        && !target.starts_with(concat!(env!("CARGO_CRATE_NAME"), "::io::ros"))
}

/// The fields of an event; message and interface decide about its kind.
#[derive(Default)]
struct EventText {
    message: String,
    interface: String,
    /// The other ones, as ` name=value`.
    more: String,
}

impl EventText {
    /// The interface, the message, and the other fields.
    fn whole(&self) -> String {
        let Self { message, interface, more } = self;
        let subject = if interface.is_empty() { String::new() } else { format!("{interface}: ") };
        format!("{subject}{message}{more}")
    }
}

impl Visit for EventText {
    fn record_str(&mut self, field: &Field, value: &str) {
        match field.name() {
            "interface" => value.clone_into(&mut self.interface),
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

/// Messages that are limited together: those on one subject, which stands before the first `: `, else those of one
/// line of the source.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Kind {
    target: String,
    line: u32,
    subject: String,
}

impl Kind {
    fn new(target: &str, line: Option<u32>, text: &EventText) -> Self {
        let (line, subject) = match text.message.split_once(": ") {
            Some((subject, _)) => (0, subject),
            None => (line.unwrap_or(0), text.interface.as_str()),
        };
        Self { target: target.to_owned(), line, subject: subject.to_owned() }
    }

    /// The kind of a text that is no event.
    fn of_text(text: &str) -> Self {
        Self::new(module_path!(), None, &EventText { message: text.to_owned(), ..EventText::default() })
    }
}

/// The kinds of messages of the last seconds.
#[derive(Debug, Default)]
struct Limits {
    kinds: BTreeMap<Kind, Flood>,
    /// Messages suppressed since the start.
    suppressed: u64,
    /// Lines about suppressed messages, to be written, with the worst level of them.
    summaries: Vec<(Level, String)>,
}

/// The messages of one kind within [`WINDOW`].
#[derive(Debug)]
struct Flood {
    since: Instant,
    last_at: Instant,
    lines: u32,
    /// Those since the last summary that were not written.
    suppressed: u64,
    /// The worst of them.
    level: Level,
    last: String,
}

impl Limits {
    /// Counts a message and returns true if it is to be written.
    fn admit(&mut self, mut kind: Kind, text: &str, level: Level, now: Instant) -> bool {
        if !self.kinds.contains_key(&kind) && self.kinds.len() >= MAX_KINDS {
            self.settle(now);
            if self.kinds.len() >= MAX_KINDS {
                kind = Kind::default();
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
        // Levels of tracing are the smaller the worse.
        flood.level = if flood.suppressed == 0 { level } else { flood.level.min(level) };
        flood.suppressed += 1;
        text.clone_into(&mut flood.last);
        self.suppressed += 1;
        false
    }

    /// Sums up what was suppressed of the kinds that are over or quiet, and forgets those that are over.
    fn settle(&mut self, now: Instant) {
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

#[cfg(test)]
mod tests;
