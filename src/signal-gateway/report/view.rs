//! Output of `run`, `demo` and `replay` while they run: lines, log records, or the live view.

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
    story: Option<ToldStory>,
    last_at: MonoTime,
}

/// Captions, and the text at the end: summary and commands to try next, with their width.
struct ToldStory {
    teller: Teller,
    summary: Summary,
    try_next: TryNext,
    width: Option<usize>,
}

/// Where a view writes.
pub enum Destination {
    /// One line per event, with its time, on standard output.
    Lines(OutputQueue),
    Json(Box<JsonTimeline>),
    /// The journal adds the time: one log record for the events of a moment.
    Journal,
    /// Nothing is shown, as with `--quiet`.
    Silent,
    Terminal(TerminalView),
}

/// Maximum time to wait at the end for the reader of standard output.
const LAST_TEXT: Duration = Duration::from_millis(300);

impl View {
    /// Creates a view with one line per event.
    pub fn lines() -> io::Result<Self> {
        Ok(Self::new(Destination::Lines(OutputQueue::start("view", &io::stdout())?)))
    }

    /// Creates a view without a story.
    pub fn new(destination: Destination) -> Self {
        let (changes, moment) = (Changes::default(), Vec::new());
        Self { destination, changes, moment, story: None, last_at: MonoTime::ZERO }
    }

    /// Adds captions, and at the end a summary followed by `try_next`, both wrapped at `width`.
    #[must_use]
    pub fn with_story(mut self, story: Story, try_next: TryNext, width: Option<usize>) -> Self {
        let (teller, summary) = (Teller::new(story), Summary::default());
        self.story = Some(ToldStory { teller, summary, try_next, width });
        self
    }

    /// Shows the changes of an earlier process, if the view has a scrollable log.
    pub fn earlier(&self, entries: &[HistoryEntry]) {
        if let Destination::Terminal(view) = &self.destination {
            view.earlier(entries.iter().map(|entry| (entry.level, line_text(entry))).collect());
        }
    }

    /// Shows the changes in an output. Fails if standard output is closed.
    pub fn show(&mut self, output: &Output, at: MonoTime) -> io::Result<()> {
        if let Destination::Json(timeline) = &self.destination {
            return timeline.line(output, at).map_or(Ok(()), |line| writeln!(io::stdout().lock(), "{line}"));
        }
        self.tell(at)?;
        let events = self.changes.of(output);
        if let Some(story) = &mut self.story {
            for event in &events {
                story.summary.count(&event.change, &self.changes.reports);
            }
        }
        match &self.destination {
            Destination::Journal | Destination::Silent | Destination::Json(_) => {}
            Destination::Terminal(view) => {
                for event in &events {
                    view.line(event.change.level, at, &event.to_string());
                }
            }
            Destination::Lines(_) if events.is_empty() => {}
            // All of an output are written, or none.
            Destination::Lines(out) => {
                let lines = events.iter().map(|event| format!("{} {event}\n", time_text(at)));
                write(out, &lines.collect::<String>())?;
            }
        }
        self.moment.extend(events);
        Ok(())
    }

    fn line(&self, level: Level, at: MonoTime, text: &str) -> io::Result<()> {
        match &self.destination {
            Destination::Journal | Destination::Silent | Destination::Json(_) => Ok(()),
            Destination::Terminal(view) => {
                view.line(level, at, text);
                Ok(())
            }
            Destination::Lines(out) => write(out, &format!("{} {text}\n", time_text(at))),
        }
    }

    /// Ends a moment: logs its events. Fails if standard output is closed.
    pub fn end_moment(&mut self, at: MonoTime) -> io::Result<()> {
        self.log_moment();
        self.tell(at)
    }

    /// Logs the events of this moment, which have one cause, as one record with the worst level.
    fn log_moment(&mut self) {
        let events = std::mem::take(&mut self.moment);
        let changes = || events.iter().map(|event| &event.change);
        let Some(worst) = events.iter().max_by_key(|event| event.change.level) else { return };
        let texts: Vec<_> = changes().map(|change| format!("{}: {}", change.subject, change.text)).collect();
        let text = escaped(&texts.join("; ")).into_owned();
        let subject = changes().next().map_or("", |change| &change.subject);
        let level = match worst.change.level {
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
            fields.push(field("TASK", &event.change.subject));
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

    pub fn begin_again(&mut self, at: MonoTime) {
        if let Some(story) = &mut self.story {
            story.teller.restart(at);
        }
    }

    /// Checks the current caption against the state if that is due, and shows changed traffic lights.
    /// Fails if the caption does not hold.
    pub fn check(&mut self, at: MonoTime, snapshot: impl FnOnce() -> Snapshot) -> Result<(), WrongCaption> {
        let Some(story) = self.story.as_mut().filter(|story| story.teller.is_check_due(at)) else {
            return Ok(());
        };
        for (light, bulbs) in story.teller.check(&snapshot(), at)? {
            let text = format!("{:<5} traffic light {light}: {bulbs}", Level::Ok.to_string());
            // The next event shows whether the reader is gone.
            let _ = self.line(Level::Ok, at, &text);
        }
        Ok(())
    }

    fn tell(&mut self, at: MonoTime) -> io::Result<()> {
        self.last_at = at;
        let Some(ToldStory { teller, .. }) = &mut self.story else { return Ok(()) };
        while let Some(caption) = teller.next_caption(at) {
            match &self.destination {
                Destination::Journal | Destination::Silent | Destination::Json(_) => {}
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
            Destination::Journal | Destination::Silent | Destination::Json(_) => None,
            // The terminal is restored before anything else is written.
            Destination::Terminal(view) => {
                drop(view);
                OutputQueue::start("end", &io::stdout()).ok()
            }
        };
        let Some(out) = out else { return };
        if let Some(ToldStory { summary, try_next, width, .. }) = &self.story {
            let text = summary.text(self.last_at, *width) + &try_next_text(try_next, *width);
            out.push(text.as_bytes());
        }
        out.flush(LAST_TEXT);
    }
}

/// Formats seconds with three decimals, right-aligned.
pub(crate) fn time_text(at: MonoTime) -> String {
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
