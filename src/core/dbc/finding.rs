//! Collects what is wrong with a file.

use super::model::{Finding, Severity};

/// Characters of a statement that a finding shows.
const EXCERPT: usize = 60;

/// The findings so far.
#[derive(Debug, Default)]
pub(super) struct Findings(Vec<Finding>);

/// A statement to point at.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) line: usize,
    pub(super) excerpt: String,
}

impl Place {
    pub(super) fn new(line: usize, text: &str) -> Self {
        let words = text.split_whitespace().take(EXCERPT).collect::<Vec<_>>().join(" ");
        let mut excerpt: String = words.chars().filter(|c| !c.is_control()).take(EXCERPT).collect();
        if excerpt.chars().count() == EXCERPT {
            excerpt.push('…');
        }
        Self { line, excerpt }
    }
}

impl Findings {
    pub(super) fn rejected(&mut self, place: &Place, reason: impl Into<String>) {
        self.add(place, Severity::Rejected, reason.into());
    }

    pub(super) fn note(&mut self, place: &Place, reason: impl Into<String>) {
        self.add(place, Severity::Note, reason.into());
    }

    fn add(&mut self, place: &Place, severity: Severity, reason: String) {
        let Place { line, excerpt } = place.clone();
        self.0.push(Finding { line, severity, excerpt, reason });
    }

    /// All of them by line.
    pub(super) fn sorted(mut self) -> Vec<Finding> {
        self.0.sort_by_key(|finding| finding.line);
        self.0
    }
}
