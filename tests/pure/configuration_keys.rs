//! The rows of the configuration's keys, and what is made of them: the documented file and the schemas for
//! editors. `UPDATE_DOCS=1 cargo test --test pure configuration_keys` writes both.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use signal_gateway::config::description;
use signal_gateway::config::gateway::reference::{document, sections};

mod agreement;
mod schemas;

pub(crate) fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Compares a file of the project with what it is made of, or writes it.
fn check(path: &str, expected: &str) {
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(project(path), expected).unwrap();
    }
    let is = std::fs::read_to_string(project(path)).unwrap_or_default();
    assert!(is == expected, "{path}: run `UPDATE_DOCS=1 cargo test --test pure configuration_keys`");
}

#[test]
fn the_documented_file_is_made_of_the_rows() {
    let text = std::fs::read_to_string(project("config/gateway.toml")).unwrap();
    let (head, rest) = text.split_once("\n\n").unwrap();
    let (_, profile) = rest.split_once("\n# -----").unwrap();
    check(
        "config/gateway.toml",
        &format!("{head}\n\n{}\n# -----{profile}", document().trim_end().to_owned() + "\n"),
    );
}

#[test]
fn every_key_has_a_meaning_a_name_of_its_own_and_a_value_to_show() {
    for section in sections() {
        let mut names = BTreeSet::new();
        for row in section.keys {
            assert!(names.insert(row.name()), "[{}] {}", section.path, row.name());
            assert!(!description(row).is_empty(), "[{}] {} has no meaning", section.path, row.name());
            assert!(
                row.default_toml().is_some() || !row.example().is_empty(),
                "[{}] {}",
                section.path,
                row.name()
            );
        }
    }
}
