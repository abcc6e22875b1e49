//! The current state as text.

use std::fmt::Write as _;

use super::gateway_view::{DeciderView, Fact, GatewayView, LightsView, RawView, ReportView};
use super::text::{escaped, wrapped};
use gateway_base::diagnostics::Level;

/// Returns the whole state in sections with headings, wrapped at a width if there is one.
pub fn text(view: &GatewayView, width: Option<usize>) -> String {
    let mut text = Text { width, ..Text::default() };
    let process = view.process.as_ref();
    let about = process
        .map_or_else(String::new, |process| format!(": {}, {}", process.vehicle, process.about.join(", ")));
    let level = view.level.map_or_else(String::new, |level| level.to_string());
    text.line(&format!("{level:<5} {}{about}", view.node));
    text.reports(view);
    text.signals(&view.signals);
    if let Some(commands) = &view.commands {
        text.section(&commands.title, &commands.facts);
    }
    text.line("buses");
    for bus in &view.buses {
        let facts: String = bus.facts.iter().map(|fact| format!(", {} {}", fact.name, fact.text)).collect();
        text.row(&bus.name, &(bus.details() + &facts));
    }
    if let Some(lights) = &view.traffic_lights {
        text.traffic_lights(lights);
    }
    if let Some(decider) = &view.decider {
        text.decider(decider);
    }
    text.diagnostics(view);
    for section in process.iter().flat_map(|process| &process.sections) {
        text.section(&section.title, &section.facts);
    }
    text.finish()
}

/// Lines of text: a heading, with rows in two columns below.
#[derive(Default)]
struct Text {
    width: Option<usize>,
    written: String,
    rows: Vec<(String, String)>,
}

/// Maximum width of the first column before the second one moves below it.
const MAX_NAME: usize = 44;
/// Minimum width of the second column; a narrower column is placed below the first.
const MIN_COLUMN: usize = 30;
/// Indentation of the wrapped part of a heading, and of a row whose second column is below the first.
const INDENT: usize = 6;

impl Text {
    /// Adds a heading. It is escaped, since names may come from files.
    fn line(&mut self, text: &str) {
        self.write_rows();
        let room = self.width.map(|width| width.saturating_sub(INDENT));
        let lines = wrapped(&escaped(text.trim_end()), room, 0);
        // Writing to a String cannot fail.
        let _ = writeln!(self.written, "{}", lines.join(&format!("\n{:INDENT$}", "")));
    }

    fn row(&mut self, name: &str, text: &str) {
        self.rows.push((escaped(name).into_owned(), escaped(text).into_owned()));
    }

    fn write_rows(&mut self) {
        let names = self.rows.iter().map(|(name, _)| name.chars().count());
        let width = names.filter(|length| *length <= MAX_NAME).max().unwrap_or_default();
        let column = 2 + width + 2;
        let is_narrow = self.width.is_some_and(|total| total < column + MIN_COLUMN);
        for (name, text) in self.rows.drain(..) {
            let (mut row, indent) = if is_narrow {
                (format!("  {name}\n{:INDENT$}", ""), INDENT)
            } else {
                (format!("  {name:<width$}  "), column)
            };
            let room = self.width.map(|total| total.saturating_sub(indent));
            row += &wrapped(&text, room, 0).join(&format!("\n{:indent$}", ""));
            let _ = writeln!(self.written, "{}", row.trim_end());
        }
    }

    fn finish(mut self) -> String {
        self.write_rows();
        self.written
    }

    fn section(&mut self, title: &str, facts: &[Fact]) {
        self.line(title);
        self.facts(facts);
    }

    fn facts(&mut self, facts: &[Fact]) {
        for fact in facts {
            self.row(&fact.name, &fact.text);
        }
    }

    fn reports(&mut self, view: &GatewayView) {
        self.line("reports");
        for ReportView { key, reported, age, message, .. } in &view.reports {
            let age = [age].into_iter().filter(|age| !age.is_empty());
            let lines: String = age.chain(&reported.lines).map(|line| format!(", {line}")).collect();
            let message = if message.is_empty() { String::new() } else { format!(": {message}") };
            self.row(key, &format!("{}{lines}{message}", reported.text));
        }
        if !view.absent.is_empty() {
            self.row("not in the profile", &view.absent.join(", ").to_lowercase());
        }
    }

    fn signals(&mut self, signals: &[RawView]) {
        if signals.is_empty() {
            return;
        }
        self.line("signals");
        for signal in signals {
            let old = if signal.age.is_empty() { "" } else { " old" };
            let integrity = signal.integrity.iter().map(|text| format!(", integrity: {text}"));
            let missing = signal.missing.iter().map(|text| format!(": {text}"));
            let rest: String = integrity.chain(missing).collect();
            self.row(&signal.name, &format!("{}{old}{rest}", signal.text()));
        }
    }

    fn traffic_lights(&mut self, lights: &LightsView) {
        self.line("traffic lights");
        for channel in &lights.channels {
            self.row(&channel.name, &channel.counts);
            for light in &channel.lights {
                self.row(&format!("  {}", light.name), &light.text);
            }
        }
        self.facts(&lights.controllers);
    }

    fn decider(&mut self, decider: &DeciderView) {
        self.line("turn signal decider");
        self.row("state", &decider.message);
        if decider.turn.is_some() {
            self.row("decision", &decider.decision);
        }
        for candidate in &decider.candidates {
            self.row(&candidate.subject, &format!("{}, {}", candidate.turn, candidate.outcome));
        }
        for text in &decider.remarks {
            self.row("", text);
        }
        self.facts(&decider.facts);
    }

    fn diagnostics(&mut self, view: &GatewayView) {
        let bad = view.diagnostics.iter().filter(|status| status.level > Level::Ok);
        let all = view.diagnostics.len();
        self.line(&format!("diagnostics ({} of {all} OK)", all - bad.clone().count()));
        for status in bad {
            self.row(&status.task, &format!("{} {}", status.level, status.message));
            for text in [&status.remedy, &status.document].into_iter().flatten() {
                self.row("", &format!("→ {text}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_wrapped_between_words_and_a_wide_name_stands_above_its_text() {
        let words = "link up, receiving, 122.14 frames of the profile/s, 255.9 frames/s in all";
        let text = |width| {
            let mut text = Text { width, ..Text::default() };
            text.line(words);
            text.row("body (vcan0)", words);
            text.line("signals");
            text.row("BCM_TurnIndicators.TurnIndicatorState", words);
            text.finish()
        };
        let in_words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        for width in [50, 80, 120] {
            let wrapped = text(Some(width));
            assert!(wrapped.lines().all(|line| line.chars().count() <= width), "{wrapped}");
            assert_eq!(in_words(&wrapped), in_words(&text(None)));
        }
        let narrow = text(Some(50));
        assert!(
            narrow.contains("\n  BCM_TurnIndicators.TurnIndicatorState\n      link up, receiving,"),
            "{narrow}"
        );
        assert!(
            narrow.contains("\n  body (vcan0)  link up, receiving, 122.14 frames\n                of the"),
            "{narrow}"
        );
        assert_eq!(text(None).lines().count(), 4);
    }
}
