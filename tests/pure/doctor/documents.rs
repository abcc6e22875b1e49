//! The documents: docs/doctor.md has the tables of the rows, and what findings refer to exists.

use std::fs;

use signal_gateway::check::doctor::{CHECKS, FindingRow};

use crate::support::docs_table;
use crate::support::sources::project;

const CHECK_EDGES: [&str; 2] = [
    "<!-- Made by `UPDATE_DOCS=1 cargo test --test pure doctor` from check::doctor. -->\n",
    "<!-- The end of the checks. -->\n",
];
const FINDING_EDGES: [&str; 2] =
    ["<!-- Made in the same way from the rows of findings. -->\n", "<!-- The end of the findings. -->\n"];

#[test]
fn document_has_the_tables_of_checks_and_findings() {
    let checks = CHECKS.iter().map(|check| format!("| `{}` | {} |\n", check.name, check.asks));
    let table = format!("| check | what it asks |\n|---|---|\n{}", checks.collect::<String>());
    docs_table::check("docs/doctor.md", CHECK_EDGES, &table, "doctor");
    let finding = |row: &&FindingRow| {
        let text = row.text.replace('|', "\\|").replace('<', "&lt;");
        format!("| {} | `{}` | {text} |\n", row.level, row.name)
    };
    let findings = CHECKS.iter().flat_map(|check| check.findings).map(finding);
    let head = "| level | finding | what is found |\n|---|---|---|\n";
    let table = format!("{head}{}", findings.collect::<String>());
    docs_table::check("docs/doctor.md", FINDING_EDGES, &table, "doctor");
}

#[test]
fn findings_refer_to_documents_and_sections_that_exist() {
    for row in CHECKS.iter().flat_map(|check| check.findings) {
        let (file, section) = row.see.split_once('#').unwrap_or((row.see, ""));
        let document =
            fs::read_to_string(project().join(file)).unwrap_or_else(|_| panic!("{}: {file}", row.name));
        let is_there =
            document.lines().filter(|line| line.starts_with('#')).any(|line| anchor(line) == section);
        assert!(section.is_empty() || is_there, "{}: {} has no section {section}", row.name, file);
    }
}

/// The anchor that GitHub gives to a heading.
fn anchor(heading: &str) -> String {
    let words = heading.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
    words.chars().filter(|character| character.is_alphanumeric() || *character == '-').collect()
}
