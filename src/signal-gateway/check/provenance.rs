//! The part of a check on the provenance of a profile: which facts are verified, by what evidence, and which
//! are unverified.

use super::report::CheckReport;
use gateway_core::provenance::{Provenance, ProvenanceRecord, Verification};

/// Lists the records of a profile that verify something, then the facts that nothing has verified.
pub(super) fn provenance(provenance: &Provenance, report: &mut CheckReport) {
    let verifying = provenance.records.iter().filter(|record| record.verified > Verification::Nothing);
    for record in verifying {
        let facts = format!("{} by {}", record.facts.join(", "), record.verified);
        report.line("verified", record_text(&facts, record));
    }
    let unverified = provenance.facts_verified_by(Verification::Nothing);
    if !unverified.is_empty() {
        report.line("unverified", unverified.join(", "));
    }
}

/// Lists all records of a profile by what verifies them, then the facts without a record.
pub fn records(provenance: &Provenance) -> CheckReport {
    let mut report = CheckReport::default();
    for record in &provenance.records {
        report.line(&record.verified.to_string(), record_text(&record.facts.join(", "), record));
    }
    let without = provenance.facts.iter().filter(|fact| fact.records.is_empty());
    let without: Vec<_> = without.map(|fact| fact.name.as_str()).collect();
    if !without.is_empty() {
        report.line("no source", without.join(", "));
    }
    report
}

/// Returns the evidence of a record, its source and its date after `facts`.
fn record_text(facts: &str, record: &ProvenanceRecord) -> String {
    let (source, since) = (&record.source, record.since);
    match record.verified {
        Verification::Nothing => format!("{facts}: {source}; since {since}"),
        Verification::Bench | Verification::Recording | Verification::Car => {
            format!("{facts}: {}; {source}; since {since}", record.evidence)
        }
    }
}
