//! `doctor` on recorded facts: `tests/cases/doctor` changes those of a sound set-up, and has the findings
//! that follow.

mod documents;
mod sound;

use std::collections::BTreeSet;

use signal_gateway::check::doctor::facts::Facts;
use signal_gateway::check::doctor::{CHECKS, Outcome, examine};

use crate::support::cases;
use crate::support::files::MemoryFiles;

fn sound() -> MemoryFiles {
    MemoryFiles::new([("facts.toml", sound::FACTS)])
}

fn outcomes(files: &MemoryFiles) -> Vec<(&'static str, Outcome)> {
    let facts: Facts = toml::from_str(files.text("facts.toml")).unwrap();
    let checks = examine(&facts).checks.into_iter();
    checks.flat_map(|check| check.outcomes.into_iter().map(move |outcome| (check.name, outcome))).collect()
}

#[test]
fn sound_set_up_has_no_finding_and_everything_is_checked() {
    for (name, outcome) in outcomes(&sound()) {
        assert!(matches!(outcome, Outcome::Sound { .. }), "{name}: {outcome:?}");
    }
}

#[test]
fn facts_lead_to_these_findings() {
    cases::check("doctor", &sound(), |case| {
        let lines = outcomes(&case.files).into_iter().filter_map(|(name, outcome)| match outcome {
            Outcome::Sound { .. } => None,
            Outcome::NotChecked { reason } => Some(format!("{name} is not checked: {reason}\n")),
            Outcome::Found(found) => {
                Some(format!("{} {}: {}\nremedy: {}\n", found.level, found.finding, found.text, found.remedy))
            }
        });
        lines.collect()
    });
}

/// Each row is found by a case, belongs to the check that finds it, and has a value for each name in its
/// texts.
#[test]
fn every_finding_has_a_case() {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(cases::folder("doctor")).unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        let lines: Vec<_> = text.lines().collect();
        for case in cases::cases(&lines, &sound()).unwrap() {
            for (check, outcome) in outcomes(&case.files) {
                let Outcome::Found(finding) = outcome else { continue };
                let row = CHECKS.iter().find(|row| row.name == check).unwrap();
                assert!(row.findings.iter().any(|row| row.name == finding.finding), "{check}: {finding:?}");
                let texts = [&finding.text, &finding.why, &finding.remedy];
                assert!(texts.iter().all(|text| !text.contains(['{', '}'])), "{finding:?}");
                found.insert(finding.finding);
            }
        }
    }
    let rows = CHECKS.iter().flat_map(|check| check.findings);
    let missing: Vec<_> = rows.map(|row| row.name).filter(|name| !found.contains(name)).collect();
    assert_eq!(missing, [""; 0], "without a case");
}
