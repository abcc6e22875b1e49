//! The table of formats of recordings in the documents, made of rows of data: every format that is read has
//! one.

use serde::Deserialize;

use crate::support::docs_table;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: Vec<Row>,
    refused: Vec<RefusedRow>,
}

/// A layout of recordings that is known and not read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RefusedRow {
    title: String,
    why: String,
    way_out: String,
}

/// What the documents state of a format; see `recording_formats.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    of: Vec<String>,
    title: String,
    read: String,
    special: String,
    judge: String,
}

const EDGES: [&str; 2] = [
    "<!-- Made by `UPDATE_DOCS=1 cargo test --test pure recording_formats` from tests/pure/recording_formats.toml. -->\n",
    "<!-- The end of the table of formats. -->\n",
];

fn document() -> Document {
    toml::from_str(include_str!("recording_formats.toml")).unwrap()
}

#[test]
fn every_format_has_one_row_and_a_judge() {
    let rows = document().format;
    let mut named: Vec<_> = rows.iter().flat_map(|row| row.of.iter().map(String::as_str)).collect();
    let mut names = can_log::names();
    named.sort_unstable();
    names.sort_unstable();
    assert_eq!(named, names);
    assert!(rows.iter().all(|row| !row.read.is_empty() && !row.judge.is_empty()));
}

#[test]
fn documentation_has_the_formats_and_who_judged_them() {
    let line = |Row { title, read, special, judge, .. }: Row| {
        let special = if special.is_empty() { special } else { format!("; {special}") };
        format!("| {title} | {read}{special} | {judge} |\n")
    };
    let Document { format, refused } = document();
    let lines: String = format.into_iter().map(line).collect();
    let line = |RefusedRow { title, why, way_out }: RefusedRow| format!("| {title} | {why} | {way_out} |\n");
    let refused: String = refused.into_iter().map(line).collect();
    let table = format!(
        "| format | what is read | compared with (frames) |\n|---|---|---|\n{lines}\n\
         These are recognised, and refused with the way out:\n\n| layout | why it is not read | way out |\n|---|---|---|\n{refused}"
    );
    docs_table::check("docs/vehicle-lights.md", EDGES, &table, "recording_formats");
}
