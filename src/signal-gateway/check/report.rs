//! The result of a check: facts, and findings by their severity.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::json;

use super::kind::CheckKind;
use super::patch::Fix;
use crate::report::text::{Layout, counted, escaped, wrapped};
use gateway_base::names::variant_name;
use vehicle_bringup::plausibility::finding::Severity;

/// Facts and findings of a check.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CheckReport {
    facts: Vec<Fact>,
    findings: Vec<ReportedFinding>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Fact {
    heading: String,
    text: String,
}

/// A finding as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportedFinding {
    /// Kind of the finding.
    pub kind: CheckKind,
    /// Severity, by which findings are sorted.
    pub severity: Severity,
    /// The text without its severity.
    pub text: String,
    /// Remedy of a warning or an error; empty for a note.
    pub remedy: String,
    /// A line of the vehicle profile that fixes it.
    pub fix: Option<Fix>,
}

impl ReportedFinding {
    fn as_json(&self) -> JsonFinding<'_> {
        JsonFinding {
            kind: self.kind,
            severity: variant_name(&self.severity),
            text: &self.text,
            remedy: Some(self.remedy.as_str()).filter(|remedy| !remedy.is_empty()),
            fix: self.fix.as_ref().map(|fix| JsonFix { section: fix.section(), line: &fix.line }),
        }
    }
}

/// The report as JSON.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "Result of signal-gateway check")]
pub struct JsonReport<'a> {
    /// Number of errors. With an error or a warning, the exit code is 4.
    errors: usize,
    /// Number of warnings.
    warnings: usize,
    /// Number of notes, which need no action.
    notes: usize,
    /// All findings, most severe first.
    findings: Vec<JsonFinding<'a>>,
    /// What was checked and counted, for people.
    facts: Vec<JsonFact<'a>>,
}

/// A finding as JSON.
#[derive(Debug, Serialize, JsonSchema)]
struct JsonFinding<'a> {
    /// Kind of the finding.
    kind: CheckKind,
    /// Severity: `error`, `warning` or `note`.
    severity: &'static str,
    /// What was found, for people.
    text: &'a str,
    /// What to do about it, for people; `None` for a note.
    remedy: Option<&'a str>,
    /// A line for the vehicle profile that fixes it; `None` if there is none.
    fix: Option<JsonFix<'a>>,
}

/// A line for the vehicle profile.
#[derive(Debug, Serialize, JsonSchema)]
struct JsonFix<'a> {
    /// Section of the profile, without brackets.
    section: String,
    /// The line, as TOML.
    line: &'a str,
}

/// A fact, for people.
#[derive(Debug, Serialize, JsonSchema)]
struct JsonFact<'a> {
    /// Heading; empty for a fact that continues the one before.
    about: &'a str,
    /// The fact.
    text: &'a str,
}

const MAX_HEADING: usize = 10;

impl CheckReport {
    pub(super) fn line(&mut self, heading: &str, text: impl Into<String>) {
        self.facts.push(Fact { heading: heading.to_owned(), text: text.into() });
    }

    /// Adds a finding with the remedy of its kind.
    pub(super) fn find(&mut self, severity: Severity, kind: CheckKind, text: impl Into<String>) {
        self.find_with(severity, kind, text, kind.remedy());
    }

    /// Adds a finding with its own remedy, which a note does not have.
    pub(super) fn find_with(
        &mut self,
        severity: Severity,
        kind: CheckKind,
        text: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        let remedy = if severity == Severity::Note { String::new() } else { remedy.into() };
        self.findings.push(ReportedFinding { kind, severity, text: text.into(), remedy, fix: None });
    }

    /// Adds a finding with the remedy of its kind and a line that fixes it.
    pub(super) fn find_fixable(
        &mut self,
        severity: Severity,
        kind: CheckKind,
        text: impl Into<String>,
        fix: Option<Fix>,
    ) {
        self.find(severity, kind, text);
        if let Some(finding) = self.findings.last_mut() {
            finding.fix = fix;
        }
    }

    /// Appends the facts and findings of another report.
    pub fn append(&mut self, mut other: Self) {
        self.facts.append(&mut other.facts);
        self.findings.append(&mut other.findings);
    }

    /// Returns the findings, most severe first.
    pub fn findings(&self) -> Vec<&ReportedFinding> {
        let mut findings: Vec<_> = self.findings.iter().collect();
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        findings
    }

    /// Returns a report with only the findings.
    pub fn without_facts(&self) -> Self {
        Self { facts: Vec::new(), findings: self.findings.clone() }
    }

    /// Returns the number of findings with a severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|finding| finding.severity == severity).count()
    }

    /// Formats the facts as text.
    pub fn facts_text(&self, layout: Layout) -> String {
        let mut text = String::new();
        for Fact { heading, text: fact } in &self.facts {
            add(&mut text, &escaped(heading), "", &escaped(fact), layout);
        }
        text
    }

    /// Formats the facts, the findings and their counts as text.
    pub fn text(&self, layout: Layout) -> String {
        let mut text = self.facts_text(layout);
        if !self.facts.is_empty() && !self.findings.is_empty() {
            text.push('\n');
        }
        for finding in self.findings() {
            let color = if layout.has_color { color(finding.severity) } else { "" };
            add(&mut text, variant_name(&finding.severity), color, &escaped(&finding.text), layout);
            if !finding.remedy.is_empty() {
                add(&mut text, "", "", &format!("remedy: {}", escaped(&finding.remedy)), layout);
            }
        }
        text.push('\n');
        text.push_str(&self.summary());
        text.push('\n');
        let fixes = self.fixes().len() as u64;
        if fixes > 0 {
            text.push_str(&format!("--fix prints {} for the profile\n", counted(fixes, "line")));
        }
        text
    }

    fn summary(&self) -> String {
        [Severity::Error, Severity::Warning, Severity::Note]
            .map(|severity| counted(self.count(severity) as u64, variant_name(&severity)))
            .join(", ")
    }

    /// Formats the report as one JSON object.
    pub fn json(&self) -> String {
        let facts = self.facts.iter().map(|fact| JsonFact { about: &fact.heading, text: &fact.text });
        let whole = JsonReport {
            errors: self.count(Severity::Error),
            warnings: self.count(Severity::Warning),
            notes: self.count(Severity::Note),
            findings: self.findings().into_iter().map(ReportedFinding::as_json).collect(),
            facts: facts.collect(),
        };
        format!("{}\n", json!(whole))
    }

    /// Returns the known fixes for the profile.
    pub fn fixes(&self) -> Vec<&Fix> {
        self.findings.iter().filter_map(|finding| finding.fix.as_ref()).collect()
    }
}

pub(super) fn color(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "\u{1b}[1m\u{1b}[32m",
        Severity::Warning => "\u{1b}[1m\u{1b}[33m",
        Severity::Error => "\u{1b}[1m\u{1b}[31m",
    }
}

pub(super) const RESET: &str = "\u{1b}[0m";

/// Adds a heading and a text in its column, wrapped between words.
fn add(text: &mut String, heading: &str, color: &str, body: &str, layout: Layout) {
    let indent = " ".repeat(MAX_HEADING + 1);
    let padding = " ".repeat((MAX_HEADING + 1).saturating_sub(heading.chars().count()).max(1));
    let reset = if color.is_empty() { "" } else { RESET };
    text.push_str(&format!("{color}{heading}{reset}{padding}"));
    // A heading that reaches into the column shortens its first line.
    let used = heading.chars().count().saturating_sub(MAX_HEADING);
    let width = layout.width.map(|width| width.saturating_sub(indent.len()));
    let is_too_wide = width.is_some_and(|width| used + body.chars().count() > width);
    // If columns do not fit, the first one gets its own line.
    let (first, others) = body.split_once("  ").filter(|_| is_too_wide).unwrap_or((body, ""));
    let mut lines = wrapped(first, width, used);
    if !others.is_empty() {
        lines.extend(wrapped(&format!("  {}", others.trim_start()), width, 0));
    }
    text.push_str(&lines.join(&format!("\n{indent}")));
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn report() -> CheckReport {
        let mut report = CheckReport::default();
        report.line("vehicle", "Car\u{1b}");
        report.find(Severity::Note, CheckKind::StateNotShown, "right was never seen: record it");
        let fix = Fix::new("A", "timeout_ms = 500".to_owned());
        report.find_fixable(Severity::Warning, CheckKind::UnusedIntegrity, "A: a counter", fix);
        report
    }

    #[test]
    fn the_heaviest_finding_comes_first_and_lines_wrap_in_their_column() {
        let expected = "vehicle    Car\\u{1b}\n\nwarning    A: a counter\n           remedy: add the line that \
                        --fix prints to the profile\nnote       right was never seen: \
                        record it\n\n0 errors, 1 warning, 1 note\n--fix prints 1 line for the profile\n";
        assert_eq!(report().text(Layout::default()), expected);
        let mut columns = CheckReport::default();
        columns.line("value", "SIGNAL = 1 \"Left\"      turn left   3 times, first at 0.500 s");
        let expected = "value      SIGNAL = 1 \"Left\"\n             turn left   3 times, first at 0.500 s\n";
        assert!(columns.text(Layout { has_color: false, width: Some(60) }).starts_with(expected));
        let narrow = report().text(Layout { has_color: true, width: Some(40) });
        let expected = "\u{1b}[1m\u{1b}[32mnote\u{1b}[0m       right was never seen: record\n           it\n";
        assert!(narrow.contains(expected), "{narrow:?}");
    }

    #[test]
    fn programs_get_numbers_findings_and_fixes() {
        let value: Value = serde_json::from_str(&report().json()).unwrap();
        assert_eq!((&value["warnings"], &value["errors"]), (&json!(1), &json!(0)));
        assert_eq!(value["findings"][0]["kind"], "unused_integrity");
        assert_eq!(value["findings"][0]["fix"]["line"], "timeout_ms = 500");
        assert_eq!(value["findings"][1]["remedy"], Value::Null);
        assert_eq!(report().fixes().len(), 1);
    }
}
