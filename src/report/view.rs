//! The live view of `run` and `demo`: log lines, and on a terminal the present state.

use std::fmt::Write as _;
use std::io::{self, IsTerminal};
use std::time::Duration;

use crate::core::diagnostics::{Level, Status};
use crate::core::gateway::event::Output;
use crate::core::time::MonoTime;
use crate::io::output_queue::{Loss, Losses, OutputQueue};
use crate::io::process_log;
use crate::report::gateway::{Changes, Event, task_of};
use crate::report::text::escaped;

/// Parts of the view beside the events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// One line per event, with its time.
    Lines,
    /// The journal keeps the time: one log record per event.
    Journal,
    /// Events, and one status line below them.
    StatusLine,
    /// Events, and the whole state below them.
    Panel,
}

impl Style {
    /// `on_terminal` if standard output is one, else `otherwise`.
    pub fn choose(on_terminal: Self, otherwise: Self) -> Self {
        if io::stdout().is_terminal() { on_terminal } else { otherwise }
    }
}

/// Shows events, and the present state below them.
#[derive(Debug)]
pub struct View {
    style: Style,
    title: String,
    /// Standard output; `None` where every event is a log record.
    out: Option<OutputQueue>,
    changes: Changes,
    statuses: Vec<Status>,
    /// Lines of the live part on the screen.
    /// Events of the present moment, which the journal gets as one record.
    moment: Vec<Event>,
    drawn: usize,
    drawn_at: Option<MonoTime>,
    footer: String,
}

/// Least time between two drawings of the live part.
const FRAME_TIME: Duration = Duration::from_millis(100);
/// Longest time that the end waits for the reader of standard output.
const LAST_TEXT: Duration = Duration::from_millis(300);
const RESET: &str = "\x1b[0m";
const DIM: &str = "\x1b[2m";

impl View {
    /// An empty view with a heading for the panel.
    ///
    /// # Errors
    /// When standard output cannot be used.
    pub fn new(style: Style, title: String) -> io::Result<Self> {
        let is_log = style == Style::Journal;
        let out = if is_log { None } else { Some(OutputQueue::start("view", &io::stdout())?) };
        let (changes, footer) = (Changes::default(), String::new());
        Ok(Self {
            style,
            title,
            out,
            changes,
            statuses: vec![],
            moment: vec![],
            drawn: 0,
            drawn_at: None,
            footer,
        })
    }

    /// Prints the changes in an output.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn show(&mut self, output: &Output, at: MonoTime) -> io::Result<()> {
        if let Output::Diagnostics { diagnostics, .. } = output {
            for status in &diagnostics.statuses {
                match self.statuses.iter_mut().find(|known| known.name == status.name) {
                    Some(known) => known.clone_from(status),
                    None => self.statuses.push(status.clone()),
                }
            }
        }
        let events = self.changes.of(output);
        if events.is_empty() {
            return Ok(());
        }
        if self.style == Style::Journal {
            self.moment.extend(events);
            return Ok(());
        }
        let mut text = self.erase();
        for event in &events {
            let (begin, end) = if self.is_coloured() { (colour(event.level), RESET) } else { ("", "") };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{begin}{} {event}{end}", time_text(at));
        }
        self.drawn_at = None;
        self.write(&text)
    }

    /// Ends a moment: logs its events, and draws the live part again when it is due; `footer` is its last line.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn refresh(&mut self, at: MonoTime, footer: impl FnOnce() -> String) -> io::Result<()> {
        log(&std::mem::take(&mut self.moment));
        let due = self.drawn_at.is_none_or(|before| at.since(before) >= FRAME_TIME);
        if !due || !self.is_coloured() {
            return Ok(());
        }
        self.footer = footer();
        self.drawn_at = Some(at);
        let mut text = self.erase();
        let lines = if self.style == Style::Panel { self.panel(at) } else { vec![self.status_line(at)] };
        let width = terminal_width();
        for line in &lines {
            text += &clip(line, width);
            text += "\n";
        }
        self.drawn = lines.len();
        self.write(&text)
    }

    /// Writes without waiting for the reader; an error is that of an earlier text.
    fn write(&self, text: &str) -> io::Result<()> {
        let Some(out) = &self.out else { return Ok(()) };
        out.push(text.as_bytes());
        match out.losses() {
            Losses { last: Some(Loss::Error(kind)), is_losing: true, .. } => Err(kind.into()),
            _ => Ok(()),
        }
    }

    fn is_coloured(&self) -> bool {
        matches!(self.style, Style::Panel | Style::StatusLine)
    }

    /// The control sequence that moves back over the live part and clears it.
    fn erase(&mut self) -> String {
        match std::mem::take(&mut self.drawn) {
            0 => String::new(),
            lines => format!("\x1b[{lines}F\x1b[J"),
        }
    }

    fn status_line(&self, at: MonoTime) -> String {
        let worst = self.statuses.iter().map(|status| status.level).max().unwrap_or(Level::Ok);
        let interfaces = self.statuses.iter().filter(|status| value(status, "link").is_some());
        let buses: Vec<_> = interfaces
            .map(|status| {
                let rate = value(status, "rate_hz").unwrap_or("0.0");
                format!("{} {rate}/s", task_of(&status.name))
            })
            .collect();
        format!(
            "{}{worst}{RESET} {} | turn {} | hazard {} | {} | {}",
            colour(worst),
            time_text(at).trim_start(),
            self.changes.turn().unwrap_or("not published"),
            self.changes.hazard().unwrap_or("not published"),
            buses.join(", "),
            self.footer
        )
    }

    fn panel(&self, at: MonoTime) -> Vec<String> {
        let (turn, hazard) = (self.changes.turn(), self.changes.hazard());
        let lamp = |on: bool, text: &str| {
            if on { format!("\x1b[30;43m {text} {RESET}") } else { format!("{DIM} {text} {RESET}") }
        };
        let unknown = |value: Option<&str>| match value {
            Some(value) => value.to_owned(),
            None => format!("{}not published{RESET}", colour(Level::Error)),
        };
        let mut lines = vec![
            String::new(),
            format!(
                "{DIM}──{RESET} {} {DIM}──{RESET} {} s",
                escaped(&self.title),
                time_text(at).trim_start()
            ),
            format!(
                "   {}   {}   {}",
                lamp(turn == Some("ENABLE_LEFT"), "◀ LEFT"),
                lamp(hazard == Some("ENABLE"), "▲ HAZARD"),
                lamp(turn == Some("ENABLE_RIGHT"), "RIGHT ▶")
            ),
            format!("   turn_indicators_status  {}", unknown(turn)),
            format!("   hazard_lights_status    {}", unknown(hazard)),
        ];
        lines.extend(self.statuses.iter().map(|status| {
            let level = format!("{}{:<5}{RESET}", colour(status.level), status.level.to_string());
            let detail = match (value(status, "age_ms"), value(status, "frames")) {
                (Some(age), _) => format!("{DIM}age {age} ms{RESET}"),
                (None, Some(frames)) => format!("{DIM}{frames} frames{RESET}"),
                (None, None) => String::new(),
            };
            format!("   {level} {:<16} {}  {detail}", task_of(&status.name), escaped(&status.message))
        }));
        lines.push(format!("   {DIM}{}{RESET}", self.footer));
        lines
    }
}

impl Drop for View {
    fn drop(&mut self) {
        log(&self.moment);
        // The last panel stays on the screen; a shell prompt follows below it.
        self.out.iter().for_each(|out| _ = out.flush(LAST_TEXT));
    }
}

/// Logs the events of one moment as one record, which has the level of the worst: what happens at once has one cause.
fn log(events: &[Event]) {
    let Some(worst) = events.iter().max_by_key(|event| event.level) else { return };
    let texts: Vec<_> = events.iter().map(|Event { task, text, .. }| format!("{task}: {text}")).collect();
    let text = texts.join("; ");
    let level = match worst.level {
        Level::Ok => tracing::Level::INFO,
        Level::Warn | Level::Stale => tracing::Level::WARN,
        Level::Error => tracing::Level::ERROR,
    };
    // A field may come several times: each task of the moment is found.
    let mut fields = vec![("MESSAGE_ID", worst.kind.message_id()), ("CAUSE", worst.cause())];
    for event in events {
        fields.push(("TASK", event.task.as_str()));
        fields.extend(event.signals.split(", ").map(|signal| ("SIGNAL", signal)));
    }
    process_log::record(level, &escaped(&text), &fields);
}

fn value<'a>(status: &'a Status, key: &str) -> Option<&'a str> {
    status.values.iter().find(|(name, _)| *name == key).map(|(_, value)| value.as_str())
}

fn colour(level: Level) -> &'static str {
    match level {
        Level::Ok => "\x1b[32m",
        Level::Warn | Level::Stale => "\x1b[33m",
        Level::Error => "\x1b[31m",
    }
}

/// Seconds with three decimals, right-aligned.
pub fn time_text(at: MonoTime) -> String {
    let millis = at.as_nanos() / 1_000_000;
    format!("{:>8}.{:03}", millis / 1000, millis % 1000)
}

fn terminal_width() -> usize {
    terminal_size::terminal_size().map_or(100, |(terminal_size::Width(width), _)| usize::from(width))
}

/// Cuts a line to `width` visible characters; colour codes do not count.
fn clip(line: &str, width: usize) -> String {
    let mut clipped = String::new();
    let (mut visible, mut in_code) = (0, false);
    for char in line.chars() {
        if char == '\x1b' {
            in_code = true;
        } else if !in_code {
            visible += 1;
        }
        if in_code || visible < width {
            clipped.push(char);
        }
        if in_code && char.is_ascii_alphabetic() {
            in_code = false;
        }
    }
    clipped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_clipped_by_its_visible_characters() {
        assert_eq!(clip("\x1b[31mabcdef\x1b[0m", 4), "\x1b[31mabc\x1b[0m");
        assert_eq!(clip("◀ LEFT", 40), "◀ LEFT");
    }

    #[test]
    fn times_are_written_in_seconds() {
        assert_eq!(time_text(MonoTime::from_millis(61_007)), "      61.007");
    }
}
