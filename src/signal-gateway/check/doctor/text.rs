//! A diagnosis as text and as JSON.

use serde_json::json;

use super::facts::Facts;
use super::{Diagnosis, Finding, Outcome};
use crate::report::text::{Layout, counted, escaped, wrapped};
use gateway_base::diagnostics::Level;

/// Width of the column of levels, and of both columns before the texts.
const LEVEL: usize = 7;
const COLUMNS: usize = 25;
/// Width of the labels below a finding.
const LABEL: usize = 8;
const RESET: &str = "\u{1b}[0m";

impl Diagnosis {
    /// Formats all outcomes, or only the problems with `only_findings`, and the counts.
    pub fn text(&self, layout: Layout, only_findings: bool) -> String {
        let mut text = String::new();
        for check in &self.checks {
            for outcome in &check.outcomes {
                match outcome {
                    Outcome::Found(found) => add_finding(&mut text, check.name, found, layout),
                    Outcome::Sound { .. } | Outcome::NotChecked { .. } if only_findings => {}
                    Outcome::Sound { text: seen } => {
                        add(&mut text, "ok", "\u{1b}[32m", check.name, seen, layout);
                    }
                    Outcome::NotChecked { reason } => {
                        add(&mut text, "-", "", check.name, &format!("not checked: {reason}"), layout);
                    }
                }
            }
        }
        let [errors, warnings] = [(self.errors, "error"), (self.warnings, "warning")]
            .map(|(count, noun)| counted(count as u64, noun));
        text + &format!("\n{errors}, {warnings}, {} not checked\n", self.not_checked)
    }

    /// Formats the outcomes and the underlying facts as one JSON object.
    pub fn json(&self, facts: &Facts) -> String {
        let mut whole = json!(self);
        whole["facts"] = json!(facts);
        format!("{whole}\n")
    }
}

fn add_finding(text: &mut String, check: &str, found: &Finding, layout: Layout) {
    let (level, color) = match found.level {
        Level::Error | Level::Stale => ("ERROR", "\u{1b}[1m\u{1b}[31m"),
        Level::Warn | Level::Ok => ("WARN", "\u{1b}[1m\u{1b}[33m"),
    };
    add(text, level, color, check, &found.text, layout);
    for (label, part) in [("why", found.why.as_str()), ("remedy", &found.remedy), ("see", found.see)] {
        let indent = " ".repeat(COLUMNS);
        let width = layout.width.map(|width| width.saturating_sub(COLUMNS + LABEL));
        let lines = wrapped(&escaped(part), width, 0).join(&format!("\n{indent}{}", " ".repeat(LABEL)));
        text.push_str(&format!("{indent}{:LABEL$}{lines}\n", format!("{label}:")));
    }
}

/// Adds a line in three columns, the last one wrapped between words.
fn add(text: &mut String, level: &str, color: &str, check: &str, body: &str, layout: Layout) {
    let (color, reset) = if layout.has_color && !color.is_empty() { (color, RESET) } else { ("", "") };
    let padding = " ".repeat(LEVEL.saturating_sub(level.len()));
    let width = layout.width.map(|width| width.saturating_sub(COLUMNS));
    let lines = wrapped(&escaped(body), width, 0).join(&format!("\n{}", " ".repeat(COLUMNS)));
    let name = COLUMNS - LEVEL;
    text.push_str(&format!("{color}{level}{reset}{padding}{check:name$}{lines}\n"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::doctor::examine;
    use crate::check::doctor::facts::{ConfigurationFacts, ConfigurationProblem};

    #[test]
    fn finding_has_reason_remedy_and_document_below_it_and_wraps_in_its_column() {
        let problem = Some(ConfigurationProblem::Denied);
        let path = "/etc/\u{1b}gateway.toml".to_owned();
        let configuration = Some(ConfigurationFacts { path, vehicle: String::new(), problem });
        let facts = Facts { configuration, ..Facts::default() };
        let diagnosis = examine(&facts);
        let text = diagnosis.text(Layout { has_color: true, width: Some(100) }, true);
        let expected = "\u{1b}[1m\u{1b}[31mERROR\u{1b}[0m  configuration     /etc/\\u{1b}gateway.toml: this user may not read it\n\
            \x20                        why:    a gateway of this user does not start\n\
            \x20                        remedy: chmod a+r /etc/\\u{1b}gateway.toml, and a+x for its folders; or run\n\
            \x20                                doctor as root, to examine the service\n";
        assert!(text.starts_with(expected), "{text}");
        let json: serde_json::Value = serde_json::from_str(&diagnosis.json(&facts)).unwrap();
        assert_eq!((&json["level"], &json["errors"]), (&json!("ERROR"), &json!(1)));
        let found = &json["checks"][0]["outcomes"][0];
        assert_eq!(
            (&found["outcome"], &found["finding"]),
            (&json!("found"), &json!("configuration_unreadable"))
        );
        let read: Facts = serde_json::from_value(json["facts"].clone()).unwrap();
        assert_eq!(read, facts);
    }
}
