//! What `run`, `demo` and `replay` show while they run: lines, log records, or the live view.

use std::fmt::Write as _;
use std::io;
use std::time::Duration;

use super::story::{Story, Summary, TryNext, try_next_text};
use super::terminal::TerminalView;
use crate::core::diagnostics::Level;
use crate::core::gateway::event::Output;
use crate::core::gateway::snapshot::Snapshot;
use crate::core::time::MonoTime;
use crate::io::output_queue::{Loss, Losses, OutputQueue};
use crate::io::process_log;
use crate::report::gateway::{Changes, Event};
use crate::report::text::escaped;

/// Shows what happens while a command runs.
pub struct View {
    destination: Destination,
    changes: Changes,
    /// Events of the present moment, which the journal gets as one record, and others as one warning.
    moment: Vec<Event>,
    /// Captions that are still to come.
    story: Story,
    /// What was seen, and the text behind it at the end; `None` without a story.
    summary: Option<(Summary, Ending)>,
    last_at: MonoTime,
}

/// What follows the summary, and the width of both.
struct Ending {
    try_next: TryNext,
    width: Option<usize>,
}

enum Destination {
    /// One line per event, with its time, on standard output.
    Lines(OutputQueue),
    /// The journal keeps the time: one log record for the events of a moment.
    Journal,
    /// The live view.
    Terminal(TerminalView),
}

/// Longest time that the end waits for the reader of standard output.
const LAST_TEXT: Duration = Duration::from_millis(300);

impl View {
    /// One line per event.
    ///
    /// # Errors
    /// When standard output cannot be used.
    pub fn lines() -> io::Result<Self> {
        Ok(Self::new(Destination::Lines(OutputQueue::start("view", &io::stdout())?)))
    }

    /// One log record for each moment.
    pub fn journal() -> Self {
        Self::new(Destination::Journal)
    }

    /// The live view.
    pub fn terminal(view: TerminalView) -> Self {
        Self::new(Destination::Terminal(view))
    }

    fn new(destination: Destination) -> Self {
        Self {
            destination,
            changes: Changes::default(),
            moment: Vec::new(),
            story: &[],
            summary: None,
            last_at: MonoTime::ZERO,
        }
    }

    /// The view with captions, and at the end a summary with `try_next` behind it, both wrapped at `width`.
    #[must_use]
    pub fn with_story(mut self, story: Story, try_next: TryNext, width: Option<usize>) -> Self {
        (self.story, self.summary) = (story, Some((Summary::default(), Ending { try_next, width })));
        self
    }

    /// Shows the changes in an output.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn show(&mut self, output: &Output, at: MonoTime) -> io::Result<()> {
        self.tell(at)?;
        let events = self.changes.of(output);
        if let Some((summary, _)) = &mut self.summary {
            for event in &events {
                summary.count(event);
            }
        }
        match &self.destination {
            Destination::Journal => {}
            Destination::Terminal(view) => {
                for event in &events {
                    view.line(event.level, format!("{} {event}", time_text(at)));
                }
            }
            Destination::Lines(_) if events.is_empty() => {}
            Destination::Lines(out) => {
                let mut text = String::new();
                for event in &events {
                    // Writing to a String cannot fail.
                    let _ = writeln!(text, "{} {event}", time_text(at));
                }
                write(out, &text)?;
            }
        }
        self.moment.extend(events);
        Ok(())
    }

    /// Ends a moment: logs its events.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn end_moment(&mut self, at: MonoTime) -> io::Result<()> {
        self.log_moment();
        self.tell(at)
    }

    /// Logs the events of this moment as one record, which has the level of the worst: what happens at once has one cause.
    fn log_moment(&mut self) {
        let events = std::mem::take(&mut self.moment);
        let Some(worst) = events.iter().max_by_key(|event| event.level) else { return };
        let texts: Vec<_> = events.iter().map(|Event { task, text, .. }| format!("{task}: {text}")).collect();
        let text = escaped(&texts.join("; ")).into_owned();
        let subject = events.first().map_or("", |event| event.task.as_str());
        let level = match worst.level {
            Level::Ok => tracing::Level::INFO,
            Level::Warn | Level::Stale => tracing::Level::WARN,
            Level::Error => tracing::Level::ERROR,
        };
        if !matches!(self.destination, Destination::Journal) {
            process_log::warn_others(level, subject, &text);
            return;
        }
        // A field may come several times: each task of the moment is found.
        let mut fields = vec![("MESSAGE_ID", worst.kind.message_id()), ("CAUSE", worst.cause())];
        for event in &events {
            fields.push(("TASK", event.task.as_str()));
            fields.extend(event.signals.iter().map(|signal| ("SIGNAL", signal.as_str())));
        }
        process_log::record(level, subject, &text, &fields);
    }

    /// True if a new snapshot would be shown.
    pub fn is_due(&self) -> bool {
        matches!(&self.destination, Destination::Terminal(view) if view.is_due())
    }

    /// Shows the present state, where there is a live view.
    pub fn snapshot(&mut self, snapshot: Snapshot) {
        if let Destination::Terminal(view) = &mut self.destination {
            view.snapshot(snapshot);
        }
    }

    /// Shows the captions that are due.
    fn tell(&mut self, at: MonoTime) -> io::Result<()> {
        self.last_at = at;
        while let Some(((from, text), later)) = self.story.split_first().filter(|((from, _), _)| *from <= at)
        {
            self.story = later;
            match &self.destination {
                Destination::Journal => {}
                Destination::Terminal(view) => view.caption(text),
                Destination::Lines(out) => write(out, &format!("{} ▸ {text}\n", time_text(*from)))?,
            }
        }
        Ok(())
    }
}

/// Writes without waiting for the reader; an error concerns an earlier text.
fn write(out: &OutputQueue, text: &str) -> io::Result<()> {
    out.push(text.as_bytes());
    match out.losses() {
        Losses { last: Some(Loss::Error(kind)), is_losing: true, .. } => Err(kind.into()),
        _ => Ok(()),
    }
}

impl Drop for View {
    fn drop(&mut self) {
        self.log_moment();
        let out = match std::mem::replace(&mut self.destination, Destination::Journal) {
            Destination::Lines(out) => Some(out),
            Destination::Journal => None,
            // The terminal is given back before anything else is written.
            Destination::Terminal(view) => {
                drop(view);
                OutputQueue::start("end", &io::stdout()).ok()
            }
        };
        let Some(out) = out else { return };
        if let Some((summary, ending)) = &self.summary {
            let Ending { try_next, width } = *ending;
            let text = summary.text(self.last_at, width) + &try_next_text(try_next, width);
            out.push(text.as_bytes());
        }
        out.flush(LAST_TEXT);
    }
}

/// Seconds with three decimals, right-aligned.
pub fn time_text(at: MonoTime) -> String {
    let millis = at.as_nanos() / 1_000_000;
    format!("{:>8}.{:03}", millis / 1000, millis % 1000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_in_seconds() {
        assert_eq!(time_text(MonoTime::from_millis(61_007)), "      61.007");
    }
}
