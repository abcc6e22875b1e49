//! The rows of the configuration's keys, and what is made of them: the documented file and the schemas for
//! editors. `UPDATE_DOCS=1 cargo test --test pure configuration_keys` writes both.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use signal_gateway::config::gateway::reference::sections;
use signal_gateway::config::{KeyRow, description};

mod agreement;
mod schemas;

/// The column at which the comments of the documented file begin.
const COMMENT_COLUMN: usize = 36;

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

/// Returns the sections of the documented file.
fn document() -> String {
    let mut text = String::new();
    for section in sections() {
        if !section.path.is_empty() {
            let name = section.path.replace('*', section.shown);
            let comment = if section.is_optional { "# " } else { "" };
            text += &commented(&format!("{comment}[{name}]"), section.doc);
        }
        for row in section.keys {
            text += &key_line(row);
        }
        text += "\n";
    }
    text
}

/// Returns the line of a key in the documented file: its default or an example, and its meaning.
fn key_line(row: &dyn KeyRow) -> String {
    let value = row.default_toml().unwrap_or_else(|| row.example().to_owned());
    let setting = format!("{} = {value}", row.name());
    // The keys that every vehicle needs.
    let comment = if matches!(row.name(), "profile" | "interface") { "" } else { "# " };
    let description = description(row);
    if description.contains('\n') {
        let above: String = description.lines().map(|line| format!("# {line}\n")).collect();
        return format!("{above}{comment}{setting}\n");
    }
    commented(&format!("{comment}{setting}"), &description)
}

fn commented(setting: &str, comment: &str) -> String {
    if comment.is_empty() {
        return format!("{setting}\n");
    }
    let gap = COMMENT_COLUMN.saturating_sub(setting.chars().count()).max(3);
    format!("{setting}{}# {comment}\n", " ".repeat(gap))
}
