//! Readers of files get bytes, and grow collections by what a file says, through the file's budget
//! (`can_log::file_budget`) or a limit of their own that is listed here. Rust is read as tokens; what is
//! `#[cfg(test)]` is passed over.

use std::fmt::Write as _;
use std::fs;

use proc_macro2::{Delimiter, TokenTree};

use super::layering::{is_cfg_test, test_files};
use super::waiting_rules::walk;
use crate::support::sources::{files_of_kind, project};

/// Where files of users are read.
const READERS: &[&str] = &[
    "src/signal-gateway/config/",
    "src/can-signal/dbc/",
    "src/lanelet2-map/osm",
    "src/can-log/",
    "src/signal-gateway/io/history_file.rs",
    "src/signal-gateway/io/sample_log.rs",
];

/// A file, what it calls, and why its size is bounded. An exception without a use is a failure.
#[rustfmt::skip]
const EXCEPTIONS: &[(&str, &str, &str)] = &[
    ("src/signal-gateway/config/files.rs", "read_to_end", "reads through a limit for files that are read as a whole"),
    ("src/can-log/standard_input.rs", "read_to_end", "its callers say how much at most"),
    ("src/can-log/file_budget.rs", "resize", "is the budget itself"),
    ("src/can-log/log.rs", "resize", "has an entry for each of at most 64 interfaces"),
    ("src/can-log/formats/pcap.rs", "resize", "a packet has at most 16 MiB"),
    ("src/can-log/formats/sqlite_file.rs", "reserve_exact", "the budget was asked for a row's length"),
    ("src/can-log/exact.rs", "read_to_end", "reads a piece that the budget was asked for"),
    ("src/can-log/bag_folder.rs", "read_to_end", "reads the first 4 KiB"),
    ("src/can-log/compression.rs", "read_to_end", "reads six bytes"),
    ("src/can-log/formats/bag.rs", "read_to_end", "reads sixteen bytes"),
    ("src/can-log/formats/capnp.rs", "read_to_end", "reads four bytes"),
    ("src/can-log/formats/mcap.rs", "read_to_end", "reads at most 64 bytes"),
];

/// Calls that take as much memory as their source or their argument says.
const CALLS: [&str; 7] =
    ["read_to_end", "read_to_string", "with_capacity", "resize", "resize_with", "reserve", "reserve_exact"];

/// Calls in a file, with their lines.
fn calls(text: &str) -> Vec<(usize, &'static str)> {
    let mut found = Vec::new();
    walk(text.parse().unwrap(), &mut |tokens, at| {
        let is_test = is_cfg_test(&tokens[at..]);
        if let (false, Some((TokenTree::Ident(name), TokenTree::Group(arguments)))) =
            (is_test, tokens.get(at).zip(tokens.get(at + 1)))
            && arguments.delimiter() == Delimiter::Parenthesis
            && let Some(call) = CALLS.into_iter().find(|call| name == call)
            && !is_constant(&arguments.stream().to_string())
            && !is_of_the_budget(tokens, at)
        {
            found.push((name.span().start().line, call));
        }
        is_test
    });
    found
}

/// True for numbers and constants, which no file changes.
fn is_constant(arguments: &str) -> bool {
    let first = arguments.split(',').next().unwrap_or_default().trim();
    !first.is_empty() && !first.contains(|char: char| char.is_lowercase())
}

/// True for a `resize` of `Kept`, which is the question to the budget.
fn is_of_the_budget(tokens: &[TokenTree], at: usize) -> bool {
    let receiver =
        at.checked_sub(2).and_then(|at| tokens.get(at)).map(ToString::to_string).unwrap_or_default();
    receiver.ends_with("kept") || receiver == "unpacked"
}

#[test]
fn readers_of_files_grow_by_their_budget_alone() {
    let tests = test_files();
    let mut refused = String::new();
    let mut used = vec![false; EXCEPTIONS.len()];
    let mut read = 0;
    for file in files_of_kind("src", "rs").into_iter().filter(|file| !tests.contains(file)) {
        let name = file.display().to_string();
        if !READERS.iter().any(|reader| name.starts_with(reader)) {
            continue;
        }
        read += 1;
        for (line, call) in calls(&fs::read_to_string(project().join(&file)).unwrap()) {
            match EXCEPTIONS.iter().position(|(place, allowed, _)| *place == name && *allowed == call) {
                Some(at) => used[at] = true,
                None => _ = writeln!(refused, "{name}:{line}: `{call}`: ask `can_log::file_budget` first"),
            }
        }
    }
    for (_, exception) in used.iter().zip(EXCEPTIONS).filter(|(used, _)| !**used) {
        let _ = writeln!(refused, "no use any more for the exception {exception:?}");
    }
    assert!(read > 80, "the readers were not found");
    assert!(refused.is_empty(), "\n{refused}");
}

#[test]
fn the_check_sees_growth_by_a_value_and_passes_over_constants_and_tests() {
    for (text, expected) in [
        ("fn f() { bytes.resize(length, 0); }", 1),
        ("fn f() { Vec::with_capacity(usize::from(count)) }", 1),
        ("fn f() { source.take(length).read_to_end(&mut bytes) }", 1),
        ("fn f() { Vec::with_capacity(HEAD); bytes.resize(4, 0); }", 0),
        ("fn f() { self.kept.resize(length)?; }", 0),
        ("#[cfg(test)] mod tests { fn f() { bytes.resize(length, 0); } }", 0),
    ] {
        assert_eq!(calls(text).len(), expected, "{text}");
    }
}
