//! Summary of a demo, and commands to try next.

use std::collections::BTreeMap;

use crate::report::text::{escaped, times, wrapped};
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::gateway::history::{Change, ChangeKind};

/// Commands to try next, each with a description.
pub type TryNext = &'static [(&'static str, &'static str)];

/// Published and withheld values, for a summary.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Number of occurrences of each value, by report; the end of a report counts as `None`.
    values: BTreeMap<String, BTreeMap<Option<String>, u64>>,
    reasons: Vec<String>,
}

impl Summary {
    /// Counts a change for the summary; `reports` has the names of the published values, without the measured
    /// ones, by report.
    pub fn count(&mut self, change: &Change, reports: &BTreeMap<&'static str, String>) {
        match change.kind {
            ChangeKind::ReportPublished | ChangeKind::ReportWithdrawn => {
                let value = reports.get(change.subject.as_str()).cloned();
                *self.values.entry(change.subject.clone()).or_default().entry(value).or_default() += 1;
            }
            ChangeKind::Status if change.level > Level::Ok => {
                let reason = format!("{}: {}", change.subject, change.text);
                if !self.reasons.contains(&reason) {
                    self.reasons.push(reason);
                }
            }
            ChangeKind::Status
            | ChangeKind::CommandSent
            | ChangeKind::Started
            | ChangeKind::Stopped
            | ChangeKind::Missing => {}
        }
    }

    /// Returns the summary in lines, wrapped at `width`.
    pub fn text(&self, until: MonoTime, width: Option<usize>) -> String {
        let seconds = until.as_nanos() / 1_000_000_000;
        if self.values.is_empty() {
            return String::new();
        }
        let mut text = format!("\nWhat the gateway did in {seconds} s\n");
        for (task, values) in &self.values {
            let values = values.iter().rev().map(|(value, count)| {
                format!("{} {}", value.as_deref().unwrap_or("withheld"), times(*count))
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

/// Indents a text by two columns, and its wrapped lines by four.
fn indented(text: &str, width: Option<usize>) -> String {
    let lines = wrapped(text, width.map(|width| width.saturating_sub(4)), 0);
    format!("  {}\n", lines.join("\n    "))
}

/// Returns the commands to try next, with their descriptions beside them, or below if there is no room.
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

    fn event(subject: &str, text: &str, kind: ChangeKind, level: Level) -> Change {
        let (subject, text) = (subject.to_owned(), text.to_owned());
        Change { level, subject, text, kind, remedy: String::new() }
    }

    #[test]
    fn summary_counts_values_and_names_each_reason_once() {
        let mut summary = Summary::default();
        let (none, left) = (BTreeMap::new(), BTreeMap::from([("turn", "left".to_owned())]));
        for event in [
            event("turn", "left, measured", ChangeKind::ReportPublished, Level::Ok),
            event("turn", "no longer published", ChangeKind::ReportWithdrawn, Level::Ok),
            event("turn", "stale", ChangeKind::Status, Level::Error),
            event("turn", "left", ChangeKind::ReportPublished, Level::Ok),
            event("turn", "stale", ChangeKind::Status, Level::Error),
            event("can0", "fine", ChangeKind::Status, Level::Ok),
        ] {
            let is_withdrawn = event.kind == ChangeKind::ReportWithdrawn;
            summary.count(&event, if is_withdrawn { &none } else { &left });
        }
        let expected = "\nWhat the gateway did in 45 s\n  turn             left 2 times, withheld once\n\
                        and why it warned\n  turn: stale\n";
        assert_eq!(summary.text(MonoTime::from_millis(45_100), None), expected);
    }

    #[test]
    fn summary_and_what_comes_next_are_wrapped_between_words() {
        const NEXT: TryNext = &[("signal-gateway demo lights", "the traffic lights of a scenario")];
        let mut summary = Summary::default();
        let reports = BTreeMap::from([("turn", "left".to_owned())]);
        summary.count(&event("turn", "left", ChangeKind::ReportPublished, Level::Ok), &reports);
        let reason = "a reason that is longer than a narrow line";
        summary.count(&event("turn", reason, ChangeKind::Status, Level::Warn), &reports);
        let text = summary.text(MonoTime::from_millis(45_100), Some(40)) + &try_next_text(NEXT, Some(40));
        assert!(text.lines().all(|line| line.chars().count() <= 40), "{text}");
        assert!(text.contains("\n  turn: a reason that is longer than a\n    narrow line\n"), "{text}");
        assert!(try_next_text(NEXT, Some(80)).contains("lights  the traffic"));
    }
}
