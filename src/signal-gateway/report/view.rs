//! Output of `run`, `demo` and `replay` while they run: lines, log records, or the live view.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::time::Duration;

use super::story::{Story, Summary, Teller, TryNext, WrongCaption, try_next_text};
use super::terminal::TerminalView;
use crate::io::output_queue::{Loss, Losses, OutputQueue};
use crate::io::process_log::{self, JournalField};
use crate::process_status::snapshot::Snapshot;
use crate::report::gateway::{Changes, Event, JsonTimeline};
use crate::report::gateway_view::GatewayView;
use crate::report::history::line_text;
use crate::report::text::escaped;
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::Output;
use gateway_core::gateway::history::HistoryEntry;

/// Shows what happens while a command runs.
pub struct View {
    destination: Destination,
    changes: Changes,
    /// Events of the current moment, which are one record in the journal, and otherwise one warning.
    moment: Vec<Event>,
    /// Captions, and the text at the end; `None` without a story.
    story: Option<(Teller, Ending)>,
    last_at: MonoTime,
}

/// The text at the end: summary and commands to try next, with their width.
struct Ending {
    summary: Summary,
    try_next: TryNext,
    width: Option<usize>,
}

enum Destination {
    /// One line per event, with its time, on standard output.
    Lines(OutputQueue),
    /// Lines of JSON on standard output.
    Json(Box<JsonTimeline>),
    /// The journal adds the time: one log record for the events of a moment.
    Journal,
    /// The live view.
    Terminal(TerminalView),
}

/// Maximum time to wait at the end for the reader of standard output.
const LAST_TEXT: Duration = Duration::from_millis(300);

impl View {
    /// Creates a view with one line per event.
    ///
    /// # Errors
    /// Fails if standard output cannot be used.
    pub fn lines() -> io::Result<Self> {
        Ok(Self::new(Destination::Lines(OutputQueue::start("view", &io::stdout())?)))
    }

    /// Creates a view with lines of JSON, without a story.
    pub fn json(timeline: JsonTimeline) -> Self {
        Self::new(Destination::Json(Box::new(timeline)))
    }

    /// Creates a view with one log record per moment.
    pub fn journal() -> Self {
        Self::new(Destination::Journal)
    }

    /// Creates the live view.
    pub fn terminal(view: TerminalView) -> Self {
        Self::new(Destination::Terminal(view))
    }

    fn new(destination: Destination) -> Self {
        Self {
            destination,
            changes: Changes::default(),
            moment: Vec::new(),
            story: None,
            last_at: MonoTime::ZERO,
        }
    }

    /// Adds captions, and at the end a summary followed by `try_next`, both wrapped at `width`.
    #[must_use]
    pub fn with_story(mut self, story: Story, try_next: TryNext, width: Option<usize>) -> Self {
        self.story = Some((Teller::new(story), Ending { summary: Summary::default(), try_next, width }));
        self
    }

    /// Shows the changes of an earlier process, if the view has a scrollable log.
    pub fn earlier(&self, entries: &[HistoryEntry]) {
        if let Destination::Terminal(view) = &self.destination {
            view.earlier(entries.iter().map(|entry| (entry.level, line_text(entry))).collect());
        }
    }

    /// Shows the changes in an output.
    ///
    /// # Errors
    /// Fails if standard output is closed.
    pub fn show(&mut self, output: &Output, at: MonoTime) -> io::Result<()> {
        if let Destination::Json(timeline) = &self.destination {
            return timeline.line(output, at).map_or(Ok(()), |line| writeln!(io::stdout().lock(), "{line}"));
        }
        self.tell(at)?;
        let events = self.changes.of(output);
        if let Some((_, ending)) = &mut self.story {
            for event in &events {
                ending.summary.count(event);
            }
        }
        match &self.destination {
            Destination::Journal | Destination::Json(_) => {}
            Destination::Terminal(view) => {
                for event in &events {
                    view.line(event.level, at, &event.to_string());
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
    /// Fails if standard output is closed.
    pub fn end_moment(&mut self, at: MonoTime) -> io::Result<()> {
        self.log_moment();
        self.tell(at)
    }

    /// Logs the events of this moment as one record with the worst level, since simultaneous events have one
    /// cause.
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
        // A field may occur several times, so that each task of the moment can be found.
        let field = |name, text| JournalField { name, text };
        let mut fields = vec![field("MESSAGE_ID", worst.message_id()), field("CAUSE", worst.cause())];
        for event in &events {
            fields.push(field("TASK", &event.task));
            fields.extend(event.signals.iter().map(|signal| field("SIGNAL", signal)));
        }
        process_log::record(level, subject, &text, &fields);
    }

    /// Returns true if a new snapshot would be shown.
    pub fn is_due(&self) -> bool {
        matches!(&self.destination, Destination::Terminal(view) if view.is_due())
    }

    /// Shows the current state, if there is a live view.
    pub fn snapshot(&mut self, at: MonoTime, snapshot: Snapshot) {
        if let Destination::Terminal(view) = &mut self.destination {
            view.show(at, move || GatewayView::of(&snapshot));
        }
    }

    /// Begins the story again.
    pub fn begin_again(&mut self, at: MonoTime) {
        if let Some((teller, _)) = &mut self.story {
            teller.restart(at);
        }
    }

    /// Checks the current caption against the state if that is due, and shows changed traffic lights.
    ///
    /// # Errors
    /// Fails if a caption does not hold.
    pub fn check(&mut self, at: MonoTime, snapshot: impl FnOnce() -> Snapshot) -> Result<(), WrongCaption> {
        let Some((teller, _)) = &mut self.story else { return Ok(()) };
        if !teller.is_check_due(at) {
            return Ok(());
        }
        for (light, bulbs) in teller.check(&snapshot(), at)? {
            let text = format!("{:<5} traffic light {light}: {bulbs}", Level::Ok.to_string());
            match &self.destination {
                Destination::Journal | Destination::Json(_) => {}
                Destination::Terminal(view) => view.line(Level::Ok, at, &text),
                // The next event shows whether the reader is gone.
                Destination::Lines(out) => out.push(format!("{} {text}\n", time_text(at)).as_bytes()),
            }
        }
        Ok(())
    }

    /// Shows the due captions.
    fn tell(&mut self, at: MonoTime) -> io::Result<()> {
        self.last_at = at;
        let Some((teller, _)) = &mut self.story else { return Ok(()) };
        while let Some(caption) = teller.next_caption(at) {
            match &self.destination {
                Destination::Journal | Destination::Json(_) => {}
                Destination::Terminal(view) => view.caption(caption.text),
                Destination::Lines(out) => {
                    write(out, &format!("{} ▸ {}\n", time_text(teller.time_of(caption)), caption.text))?;
                }
            }
        }
        Ok(())
    }
}

/// Writes without waiting for the reader. An error refers to an earlier text.
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
            Destination::Journal | Destination::Json(_) => None,
            // The terminal is restored before anything else is written.
            Destination::Terminal(view) => {
                drop(view);
                OutputQueue::start("end", &io::stdout()).ok()
            }
        };
        let Some(out) = out else { return };
        if let Some((_, Ending { summary, try_next, width })) = &self.story {
            let (try_next, width) = (*try_next, *width);
            let text = summary.text(self.last_at, width) + &try_next_text(try_next, width);
            out.push(text.as_bytes());
        }
        out.flush(LAST_TEXT);
    }
}

/// Formats seconds with three decimals, right-aligned.
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
