//! Provenance of a vehicle profile: the source and the verification of each fact.

use std::fmt;

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Vehicles that a profile describes, its facts, and their sources.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// Makes of the vehicles, e.g. `Volkswagen`; empty if the profile names none.
    pub makes: Vec<String>,
    /// Models, platforms and years; empty if the profile names none.
    pub models: String,
    /// Facts of the profile, in the order turn indicators, hazard lights, status, messages, buses, V2I,
    /// commands.
    pub facts: Vec<ProfileFact>,
    /// Records about the facts, in file order.
    pub records: Vec<ProvenanceRecord>,
}

/// A fact that a profile states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileFact {
    /// Path of a key of the profile: `turn.left`, `message.LIGHTS.counter`.
    pub name: String,
    /// Indices into [`Provenance::records`]; empty if the profile gives no source.
    pub records: Vec<usize>,
}

/// Source and verification of some facts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProvenanceRecord {
    /// Names of facts, or of groups of facts such as `turn`, as written in the profile.
    pub facts: Vec<String>,
    /// Source of the facts.
    pub source: FactSource,
    /// Strongest test that has verified the facts.
    pub verified: Verification,
    /// Result of the verification; empty if nothing has verified the facts.
    pub evidence: String,
    /// Date from which the record is valid.
    pub since: Date,
}

/// A source of facts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FactSource {
    /// Kind of the source, e.g. a DBC.
    pub kind: FactSourceKind,
    /// Path in the repository, or title of a document or standard.
    pub file: Option<String>,
    /// GitHub repository that contains the file, `owner/name`.
    pub repository: Option<String>,
    /// Commit of the repository in hexadecimal.
    pub commit: Option<String>,
    /// Release that contains the file, if the commit is not known.
    pub version: Option<String>,
    /// Further information for the reader, such as an assumption.
    pub note: Option<String>,
}

/// Kind of a source of facts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[display("{}", keyword(SOURCES, self))]
pub enum FactSourceKind {
    /// A public DBC, or the DBC of a maker.
    Dbc,
    /// Source code that reads or writes the same message.
    Code,
    /// Frames captured on such a vehicle.
    Capture,
    /// A standard, such as SAE J1939.
    Standard,
    /// A published document about the vehicle.
    Document,
    /// An unverified assumption, to be checked on a car.
    Assumption,
    /// Defined by the project, for vehicles that do not exist.
    Invention,
}

/// Kind of test that has verified a fact, the weakest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
#[display("{}", keyword(VERIFICATIONS, self))]
pub enum Verification {
    /// Nothing has verified it.
    Nothing,
    /// Tested on a bench.
    Bench,
    /// Confirmed by a recording of such a vehicle.
    Recording,
    /// Tested on such a vehicle.
    Car,
}

/// A day of the Gregorian calendar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
#[display("{year:04}-{month:02}-{day:02}")]
pub struct Date {
    /// Year, 2000 to 9999.
    pub year: u16,
    /// Month, 1 to 12.
    pub month: u8,
    /// Day of the month, from 1.
    pub day: u8,
}

/// How much of a profile has been verified, for the snapshot of the process.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ProvenanceSummary {
    /// Number of facts that were tried on a car.
    pub car: usize,
    /// Number of facts that a recording has shown, and no car.
    pub recording: usize,
    /// Number of facts that were tried on a bench only.
    pub bench: usize,
    /// Names of the facts that nothing has verified.
    pub unverified: Vec<String>,
}

/// Kinds of sources, by keyword of the profile.
pub const SOURCES: &[(&str, FactSourceKind)] = &[
    ("dbc", FactSourceKind::Dbc),
    ("code", FactSourceKind::Code),
    ("capture", FactSourceKind::Capture),
    ("standard", FactSourceKind::Standard),
    ("document", FactSourceKind::Document),
    ("assumption", FactSourceKind::Assumption),
    ("invention", FactSourceKind::Invention),
];

/// Verifications, by keyword of the profile.
pub const VERIFICATIONS: &[(&str, Verification)] = &[
    ("nothing", Verification::Nothing),
    ("bench", Verification::Bench),
    ("recording", Verification::Recording),
    ("car", Verification::Car),
];

/// Returns the keyword of a value.
fn keyword<T: PartialEq>(keywords: &[(&'static str, T)], value: &T) -> &'static str {
    keywords.iter().find(|(_, known)| known == value).map_or("", |(keyword, _)| keyword)
}

impl Date {
    /// Parses `YYYY-MM-DD`; `None` for a text that is not a day of the calendar.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split('-');
        let year = parts.next()?.parse().ok()?;
        let [month, day] = [parts.next()?.parse().ok()?, parts.next()?.parse().ok()?];
        let is_leap = u16::is_multiple_of(year, 4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
        let days = match month {
            2 => 28 + u8::from(is_leap),
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        let is_day = (2000..=9999).contains(&year) && (1..=12).contains(&month) && (1..=days).contains(&day);
        is_day.then_some(Self { year, month, day }).filter(|date| date.to_string() == text)
    }
}

impl fmt::Display for FactSource {
    /// Writes the kind, then all known details.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        let parts = [
            (" ", &self.file),
            (" of ", &self.repository),
            (" at ", &self.commit),
            (" ", &self.version),
            (": ", &self.note),
        ];
        for (before, part) in parts {
            if let Some(part) = part {
                write!(f, "{before}{part}")?;
            }
        }
        Ok(())
    }
}

impl Provenance {
    /// Returns whether `name`, the name of a fact or a group of facts, covers `fact`.
    pub fn covers(name: &str, fact: &str) -> bool {
        fact.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }

    /// Returns true if the vehicle does not exist: every source of the profile is an invention.
    pub fn is_invented(&self) -> bool {
        let mut sources = self.records.iter().map(|record| &record.source);
        !self.records.is_empty() && sources.all(|source| source.kind == FactSourceKind::Invention)
    }

    /// Returns the strongest verification of a fact.
    pub fn verification(&self, fact: &ProfileFact) -> Verification {
        let records = fact.records.iter().filter_map(|index| self.records.get(*index));
        records.map(|record| record.verified).max().unwrap_or(Verification::Nothing)
    }

    /// Returns the names of the facts whose strongest verification is `verification`.
    pub fn facts_verified_by(&self, verification: Verification) -> Vec<&str> {
        let facts = self.facts.iter().filter(|fact| self.verification(fact) == verification);
        facts.map(|fact| fact.name.as_str()).collect()
    }

    /// Counts the verified facts and lists the names of the others.
    pub fn summary(&self) -> ProvenanceSummary {
        let count = |verification| self.facts_verified_by(verification).len();
        let unverified = self.facts_verified_by(Verification::Nothing);
        ProvenanceSummary {
            car: count(Verification::Car),
            recording: count(Verification::Recording),
            bench: count(Verification::Bench),
            unverified: unverified.into_iter().map(str::to_owned).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_days_of_the_calendar_are_dates() {
        for text in ["2026-11-21", "2024-02-29", "2000-02-29"] {
            assert_eq!(Date::parse(text).unwrap().to_string(), text);
        }
        for text in
            ["2026-02-29", "2100-02-29", "2026-13-01", "2026-11-31", "1999-01-01", "2026-1-001", "", "-"]
        {
            assert_eq!(Date::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_fact_has_its_strongest_verification() {
        let record = |verified| ProvenanceRecord {
            facts: vec!["turn".to_owned()],
            source: FactSource {
                kind: FactSourceKind::Dbc,
                file: Some("a.dbc".to_owned()),
                repository: Some("b/c".to_owned()),
                commit: Some("0123abc".to_owned()),
                version: None,
                note: Some("d".to_owned()),
            },
            verified,
            evidence: String::new(),
            since: Date::parse("2026-11-21").unwrap(),
        };
        let fact =
            |name: &str, records: &[usize]| ProfileFact { name: name.to_owned(), records: records.to_vec() };
        let provenance = Provenance {
            facts: vec![fact("turn.off", &[0, 1]), fact("turn.left", &[0]), fact("hazard.on", &[])],
            records: vec![record(Verification::Nothing), record(Verification::Recording)],
            ..Provenance::default()
        };
        assert_eq!(
            provenance.summary(),
            ProvenanceSummary {
                recording: 1,
                unverified: vec!["turn.left".to_owned(), "hazard.on".to_owned()],
                ..ProvenanceSummary::default()
            }
        );
        assert_eq!(provenance.records[0].source.to_string(), "dbc a.dbc of b/c at 0123abc: d");
    }

    #[test]
    fn a_group_covers_whole_names_only() {
        assert!(Provenance::covers("turn", "turn.left") && Provenance::covers("turn.left", "turn.left"));
        assert!(!Provenance::covers("turn.l", "turn.left") && !Provenance::covers("turn.left", "turn"));
    }
}
