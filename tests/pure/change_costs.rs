//! What a kind of change costs: the files in which a real example of it occurs, as many as ARCHITECTURE.md
//! promises at most.
//!
//! An example occurs in a file that has it as a whole word, or as its name. Files that a test or a build
//! writes do not count, nor do cases, since `UPDATE_DOCS=1` renews them.

use std::fs;

use crate::support::sources::{files_below, project};

const FOLDERS: [&str; 7] = ["src", "build", "config", "dbc", "docs", "tests", "benches"];

/// Documents and cases that are generated.
#[rustfmt::skip]
const NOT_COUNTED: [&str; 8] = [
    "docs/diagnostics.md", "docs/evidence/mistakes.md", "docs/pictures/", "docs/schema/", "docs/spec/",
    "docs/turn-signal-scenarios.md", "docs/vehicles.md", "tests/cases/",
];

/// The rows of the table: kind of change, example, and the number of files.
fn promises(architecture: &str) -> Vec<(&str, &str, usize)> {
    let (_, section) = architecture.split_once("\n## What a change costs\n").unwrap();
    let rows = section.split("\n## ").next().unwrap().lines().filter_map(|line| {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let [_, kind, example, files, _] = cells[..] else { return None };
        Some((kind, example.strip_prefix('`')?.strip_suffix('`')?, files.parse().ok()?))
    });
    rows.collect()
}

fn is_whole_word(text: &str, word: &str) -> bool {
    let continues =
        |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
    let bytes = text.as_bytes();
    text.match_indices(word).any(|(at, _)| {
        !continues(at.checked_sub(1).and_then(|before| bytes.get(before)))
            && !continues(bytes.get(at + word.len()))
    })
}

#[test]
fn no_kind_of_change_costs_more_files_than_the_architecture_promises() {
    let is_counted = |path: &str| !NOT_COUNTED.iter().any(|prefix| path.starts_with(prefix));
    let paths = FOLDERS.into_iter().flat_map(files_below).map(|path| path.to_str().unwrap().to_owned());
    let files: Vec<_> = paths
        .filter(|path| is_counted(path))
        .map(|path| (String::from_utf8_lossy(&fs::read(project().join(&path)).unwrap()).into_owned(), path))
        .collect();
    let architecture = fs::read_to_string(project().join("ARCHITECTURE.md")).unwrap();
    let promises = promises(&architecture);
    assert_eq!(promises.len(), 5, "{promises:?}");
    for (kind, example, promised) in promises {
        let occurs =
            |(text, path): &&(String, String)| is_whole_word(text, example) || is_whole_word(path, example);
        let found: Vec<_> = files.iter().filter(occurs).map(|(_, path)| path.as_str()).collect();
        assert!(!found.is_empty(), "{kind}: {example} does not exist");
        assert!(
            found.len() <= promised,
            "{kind}: {example} occurs in {} files, ARCHITECTURE.md promises {promised}:\n{}",
            found.len(),
            found.join("\n")
        );
    }
}

#[test]
fn an_example_is_a_whole_word_or_a_name() {
    assert!(
        is_whole_word("config/vehicles/kia.toml", "kia")
            && is_whole_word("minimum_on_ms = 3", "minimum_on_ms")
    );
    assert!(!is_whole_word("hyundai_kia", "kia") && !is_whole_word("kia2", "kia"));
}
