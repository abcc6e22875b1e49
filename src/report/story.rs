//! The story of the demo's recording, and what was seen of it at the end.

use std::collections::BTreeMap;

use super::gateway::{Event, EventKind};
use super::text::{escaped, times, wrapped};
use crate::core::diagnostics::Level;
use crate::core::time::MonoTime;

/// Captions, each from its time on.
pub type Story = &'static [(MonoTime, &'static str)];

/// Commands that come next, each with what it does.
pub type TryNext = &'static [(&'static str, &'static str)];

/// The moments of `config/demo.log.gz`.
pub const DEMO: Story = &[
    at(0, "the car drives straight on: nothing flashes"),
    at(4_000, "the driver pulls the stalk left"),
    at(9_000, "the stalk goes back: off"),
    at(11_000, "the driver pushes the stalk right"),
    at(16_000, "off again"),
    at(18_000, "the driver presses the hazard button"),
    at(22_000, "hazard lights off"),
    at(24_000, "the car sends turn state 5, which has no meaning: nothing is made up, the report ends"),
    at(26_500, "a value with a meaning again: the report is back"),
    at(28_000, "the car sends “not available”: unknown is not off, the report ends"),
    at(30_500, "the state is available again"),
    at(32_000, "left, and the lamp breaks: the report goes on, with a warning"),
    at(35_000, "off, and the lamp is well again"),
    at(36_500, "the turn message is silent on a living bus: its last value gets stale"),
    at(39_000, "the message is back, with right"),
    at(41_000, "off to the end"),
];

/// The moments of `demo commands`.
pub const COMMANDS: Story = &[
    at(0, "Autoware drives towards a crossing; the decider knows map and route"),
    at(3_800, "60 m ahead is a left turn: the decider commands left, the vehicle obeys and reports it"),
    at(7_000, "the driver holds the stalk right: the driver comes first, and the gateway steps back"),
    at(9_000, "the driver lets go: the command counts again"),
    at(11_700, "the turn is driven: off"),
    at(15_000, "the vehicle does not hear commands any more, and nobody has noticed yet"),
    at(21_600, "the same drive once more"),
    at(27_000, "left is commanded, but off is reported: the gateway says who is to blame"),
    at(30_500, "the vehicle hears commands again"),
    at(33_400, "off to the end"),
];

/// What the driver and the vehicle do in it, as requests of `vehicle`.
pub const COMMANDS_SCRIPT: Story = &[
    at(7_000, "stalk right"),
    at(9_000, "stalk off"),
    at(15_000, "fault ignore-commands"),
    at(30_500, "clear"),
];

/// The moments of `demo lights`.
pub const LIGHTS: Story = &[
    at(0, "two controllers begin: the main road may go"),
    at(4_000, "red for the main road, green for its left arrow"),
    at(5_000, "the camera loses light 11: what it detects is unknown, what the light shows is not"),
    at(6_000, "people walk, and V2I sends yellow, flashing"),
    at(9_500, "the crosswalk is red again"),
    at(12_000, "the controllers go round"),
];

const fn at(ms: u64, text: &'static str) -> (MonoTime, &'static str) {
    (MonoTime::from_millis(ms), text)
}

/// What was published and withheld, for a summary.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Times of each value, by report; a report that ends is `None`.
    values: BTreeMap<String, BTreeMap<Option<String>, u64>>,
    /// Reasons of warnings and errors, in their order.
    reasons: Vec<String>,
}

impl Summary {
    /// Counts an event for the summary.
    pub fn count(&mut self, event: &Event) {
        match event.kind {
            EventKind::ReportPublished | EventKind::ReportWithdrawn => {
                let value = (event.kind == EventKind::ReportPublished).then(|| event.text.clone());
                *self.values.entry(event.task.clone()).or_default().entry(value).or_default() += 1;
            }
            EventKind::Status(Level::Ok) | EventKind::CommandSent => {}
            EventKind::Status(Level::Warn | Level::Error | Level::Stale) => {
                let reason = format!("{}: {}", event.task, event.text);
                if !self.reasons.contains(&reason) {
                    self.reasons.push(reason);
                }
            }
        }
    }

    /// The summary in lines, wrapped at `width`.
    pub fn text(&self, until: MonoTime, width: Option<usize>) -> String {
        let seconds = until.as_nanos() / 1_000_000_000;
        if self.values.is_empty() {
            return String::new();
        }
        let mut text = format!("\nWhat the gateway did in {seconds} s\n");
        for (task, values) in &self.values {
            let values = values.iter().rev().map(|(value, count)| match value {
                Some(value) => format!("{value} {}", times(*count)),
                None => format!("withheld {}", times(*count)),
            });
            text += &indented(&format!("{task:<16} {}", values.collect::<Vec<_>>().join(", ")), width);
        }
        if !self.reasons.is_empty() {
            text += "and why it warned\n";
            text.extend(self.reasons.iter().map(|reason| indented(&escaped(reason), width)));
        }
        text
    }
}

/// A text two columns in, and wrapped four.
fn indented(text: &str, width: Option<usize>) -> String {
    let lines = wrapped(text, width.map(|width| width.saturating_sub(4)), 0);
    format!("  {}\n", lines.join("\n    "))
}

/// What comes next, in two columns, or each below its command where the width is not enough.
pub fn try_next_text(commands: TryNext, width: Option<usize>) -> String {
    let longest = |text: fn(&(&'static str, &'static str)) -> &'static str| {
        commands.iter().map(|row| text(row).chars().count()).max().unwrap_or(0)
    };
    let column = longest(|row| row.0) + 2;
    let is_wide = width.is_none_or(|width| 2 + column + longest(|row| row.1) <= width);
    let mut text = "\nTry next\n".to_owned();
    for (command, purpose) in commands {
        text += &if is_wide {
            format!("  {command:<column$}{purpose}\n")
        } else {
            format!("  {command}\n      {purpose}\n")
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(task: &str, text: &str, kind: EventKind) -> Event {
        Event { level: Level::Ok, task: task.to_owned(), text: text.to_owned(), kind, signals: Vec::new() }
    }

    #[test]
    fn summary_counts_values_and_names_each_reason_once() {
        let mut summary = Summary::default();
        for event in [
            event("turn", "ENABLE_LEFT", EventKind::ReportPublished),
            event("turn", "no longer published", EventKind::ReportWithdrawn),
            event("turn", "stale", EventKind::Status(Level::Error)),
            event("turn", "ENABLE_LEFT", EventKind::ReportPublished),
            event("turn", "stale", EventKind::Status(Level::Error)),
            event("can0", "fine", EventKind::Status(Level::Ok)),
        ] {
            summary.count(&event);
        }
        let expected = "\nWhat the gateway did in 45 s\n  turn             ENABLE_LEFT 2 times, withheld once\n\
                        and why it warned\n  turn: stale\n";
        assert_eq!(summary.text(MonoTime::from_millis(45_100), None), expected);
    }

    #[test]
    fn summary_and_what_comes_next_are_wrapped_between_words() {
        const NEXT: TryNext = &[("signal-gateway demo lights", "the traffic lights of a scenario")];
        let mut summary = Summary::default();
        summary.count(&event("turn", "ENABLE_LEFT", EventKind::ReportPublished));
        summary.count(&event(
            "turn",
            "a reason that is longer than a narrow line",
            EventKind::Status(Level::Warn),
        ));
        let text = summary.text(MonoTime::from_millis(45_100), Some(40)) + &try_next_text(NEXT, Some(40));
        assert!(text.lines().all(|line| line.chars().count() <= 40), "{text}");
        assert!(text.contains("\n  turn: a reason that is longer than a\n    narrow line\n"), "{text}");
        assert!(try_next_text(NEXT, Some(80)).contains("lights  the traffic"));
    }
}
