//! Collects the findings on a file.

use super::model::{Finding, Severity};

/// Largest number of characters in the excerpt of a finding.
const EXCERPT: usize = 60;

/// Findings on a file in the order of detection.
#[derive(Debug, Default)]
pub(super) struct Findings(Vec<Finding>);

/// Location of a statement: its first line and an excerpt.
#[derive(Debug, Clone)]
pub(super) struct Location {
    pub(super) line: usize,
    pub(super) excerpt: String,
}

impl Location {
    pub(super) fn new(line: usize, text: &str) -> Self {
        let one_line = text.split_whitespace().take(EXCERPT).collect::<Vec<_>>().join(" ");
        let mut excerpt: String = one_line.chars().filter(|c| !c.is_control()).take(EXCERPT).collect();
        if excerpt.chars().count() == EXCERPT {
            excerpt.push('…');
        }
        Self { line, excerpt }
    }
}

impl Findings {
    pub(super) fn rejected(&mut self, location: &Location, reason: impl Into<String>) {
        self.add(location, Severity::Rejected, reason.into());
    }

    pub(super) fn note(&mut self, location: &Location, reason: impl Into<String>) {
        self.add(location, Severity::Note, reason.into());
    }

    fn add(&mut self, location: &Location, severity: Severity, reason: String) {
        let Location { line, excerpt } = location.clone();
        self.0.push(Finding { line, severity, excerpt, reason });
    }

    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    /// All findings in the order of lines.
    pub(super) fn sorted(mut self) -> Vec<Finding> {
        self.0.sort_by_key(|finding| finding.line);
        self.0
    }
}
