//! The log of the process on standard error: it never blocks and never fails, and one kind of message cannot flood it.
//!
//! Lines wait in an [`OutputQueue`]. Of one kind of message `MAX_LINES` a second are written, and then one that says
//! how many more there were. Debug and trace messages, which somebody has asked for, have no such limit.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, MakeWriter};
use tracing_subscriber::layer::{Context, Filter, Layer as _, SubscriberExt as _};
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::output_queue::{Loss, OutputQueue};
use crate::core::gateway::process_status::LogState;

/// Lines of one kind that are written within [`WINDOW`].
const MAX_LINES: u32 = 20;
const WINDOW: Duration = Duration::from_secs(1);
/// Longest time that a thread which panics waits for its message to be written.
const PANIC_PATIENCE: Duration = Duration::from_millis(500);
/// Kinds that are distinguished; all others are one.
const MAX_KINDS: usize = 256;

static LOG: OnceLock<ProcessLog> = OnceLock::new();

struct ProcessLog {
    queue: OutputQueue,
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
    let log = ProcessLog {
        queue: OutputQueue::start("log", &io::stderr())?,
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

/// Writes a line as it is; directly, and perhaps in vain, where no log was started.
pub fn line(text: &str) {
    match LOG.get() {
        Some(log) => log.queue.push(format!("{text}\n").as_bytes()),
        None => drop(io::Write::write_all(&mut io::stderr(), format!("{text}\n").as_bytes())),
    }
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
        log.queue.push(format!("log: {unreported} lines were dropped\n").as_bytes());
    }
    let last_error = losses.last.map(|loss| match loss {
        Loss::Full => "standard error is not read".to_owned(),
        Loss::Error(kind) => format!("standard error: {kind}"),
    });
    Some(LogState { suppressed, dropped: losses.lines, last_error, is_failing: losses.is_losing })
}

impl ProcessLog {
    fn limits(&self) -> MutexGuard<'_, Limits> {
        self.limits.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Not as messages: this may be in the middle of one.
    fn write_summaries(&self, limits: &mut Limits) {
        for summary in limits.summaries.drain(..) {
            self.queue.push(format!("log: {summary}\n").as_bytes());
        }
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
        let mut limits = log.limits();
        let is_admitted = limits.admit(kind, &text.message, Instant::now());
        log.write_summaries(&mut limits);
        is_admitted
    }
}

/// The fields of an event that decide about its kind.
#[derive(Default)]
struct EventText {
    message: String,
    interface: String,
}

impl Visit for EventText {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let text = match field.name() {
            "message" => &mut self.message,
            "interface" => &mut self.interface,
            _ => return,
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
}

/// The kinds of messages of the last second.
#[derive(Debug, Default)]
struct Limits {
    kinds: BTreeMap<Kind, Second>,
    /// Messages suppressed since the start.
    suppressed: u64,
    /// Lines about suppressed messages, to be written.
    summaries: Vec<String>,
}

/// One second of one kind.
#[derive(Debug)]
struct Second {
    since: Instant,
    lines: u32,
    suppressed: u64,
    last: String,
}

impl Limits {
    /// Counts a message and returns true if it is to be written.
    fn admit(&mut self, mut kind: Kind, text: &str, now: Instant) -> bool {
        if !self.kinds.contains_key(&kind) && self.kinds.len() >= MAX_KINDS {
            self.settle(now);
            if self.kinds.len() >= MAX_KINDS {
                kind = Kind::default();
            }
        }
        if self.kinds.get(&kind).is_some_and(|second| second.is_over(now)) {
            self.settle(now);
        }
        let begin = || Second { since: now, lines: 0, suppressed: 0, last: String::new() };
        let second = self.kinds.entry(kind).or_insert_with(begin);
        if second.lines < MAX_LINES {
            second.lines += 1;
            return true;
        }
        second.suppressed += 1;
        text.clone_into(&mut second.last);
        self.suppressed += 1;
        false
    }

    /// Forgets the seconds that are over, each with a summary of what was suppressed in it.
    fn settle(&mut self, now: Instant) {
        let summaries = &mut self.summaries;
        self.kinds.retain(|_, second| {
            let is_over = second.is_over(now);
            if is_over && second.suppressed > 0 {
                summaries.push(format!("{} more suppressed, the last: {}", second.suppressed, second.last));
            }
            !is_over
        });
    }
}

impl Second {
    fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= WINDOW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(subject: &str) -> Kind {
        Kind { subject: subject.to_owned(), ..Kind::default() }
    }

    fn admitted(limits: &mut Limits, subject: &str, count: u32, now: Instant) -> usize {
        (0..count).filter(|number| limits.admit(kind(subject), &format!("{subject}: {number}"), now)).count()
    }

    #[test]
    fn flood_of_one_kind_is_cut_and_summed_up_while_others_are_written() {
        let mut limits = Limits::default();
        let begin = Instant::now();
        assert_eq!(admitted(&mut limits, "turn", 5000, begin), 20);
        assert_eq!(admitted(&mut limits, "can0", 3, begin), 3);
        limits.settle(begin);
        assert_eq!(limits.summaries, [""; 0], "the second is not over");
        assert_eq!(admitted(&mut limits, "turn", 5000, begin + WINDOW), 20);
        limits.settle(begin + 2 * WINDOW);
        assert_eq!(limits.summaries, ["4980 more suppressed, the last: turn: 4999"; 2]);
        assert_eq!((limits.suppressed, limits.kinds.len()), (2 * 4980, 0));
    }

    #[test]
    fn kinds_are_bounded() {
        let mut limits = Limits::default();
        let begin = Instant::now();
        let admitted =
            (0..10_000).filter(|number| limits.admit(kind(&number.to_string()), "", begin)).count();
        assert_eq!((admitted, limits.kinds.len()), (MAX_KINDS + 20, MAX_KINDS + 1));
        assert!(limits.admit(kind("again"), "", begin + WINDOW));
        assert_eq!((limits.kinds.len(), limits.summaries.len()), (1, 1));
    }

    #[test]
    fn messages_are_of_one_kind_by_their_subject_or_else_by_their_line() {
        let text = |message: &str, interface: &str| EventText {
            message: message.to_owned(),
            interface: interface.to_owned(),
        };
        let kind = |line, text| Kind::new("io", Some(line), &text);
        assert_eq!(kind(1, text("turn: a", "")), kind(2, text("turn: b", "")));
        assert_ne!(kind(1, text("turn: a", "")), kind(1, text("hazard: a", "")));
        assert_ne!(kind(1, text("a", "")), kind(2, text("a", "")));
        assert_ne!(kind(1, text("down", "can0")), kind(1, text("down", "can1")));
    }
}
