//! Collects findings about a DBC file.

use derive_more::{Display, From};

use super::model::{DbcFinding, DbcSeverity};

/// Largest number of characters in the excerpt of a finding.
const EXCERPT: usize = 60;

/// Reason for a finding, as text.
#[derive(Debug, Display, From)]
#[from(&str, String)]
pub(super) struct Reason(String);

/// Findings about a file in the order of detection.
#[derive(Debug, Default)]
pub(super) struct DbcFindings(Vec<DbcFinding>);

#[derive(Debug, Clone)]
pub(super) struct StatementLocation {
    pub(super) line: usize,
    pub(super) excerpt: String,
}

impl StatementLocation {
    pub(super) fn new(line: usize, text: &str) -> Self {
        let one_line = text.split_whitespace().take(EXCERPT).collect::<Vec<_>>().join(" ");
        let mut excerpt: String = one_line.chars().filter(|c| !c.is_control()).take(EXCERPT).collect();
        if excerpt.chars().count() == EXCERPT {
            excerpt.push('…');
        }
        Self { line, excerpt }
    }
}

impl DbcFindings {
    pub(super) fn rejected(&mut self, location: &StatementLocation, reason: impl Into<Reason>) {
        self.add(location, DbcSeverity::Rejected, reason.into());
    }

    pub(super) fn note(&mut self, location: &StatementLocation, reason: impl Into<Reason>) {
        self.add(location, DbcSeverity::Note, reason.into());
    }

    fn add(&mut self, location: &StatementLocation, severity: DbcSeverity, Reason(reason): Reason) {
        let StatementLocation { line, excerpt } = location.clone();
        self.0.push(DbcFinding { line, severity, excerpt, reason });
    }

    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    pub(super) fn sorted(mut self) -> Vec<DbcFinding> {
        self.0.sort_by_key(|finding| finding.line);
        self.0
    }
}
