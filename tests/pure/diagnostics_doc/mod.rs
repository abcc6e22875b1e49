//! `docs/diagnostics.md` lists every status with its messages, what to do and its keys, and lists nothing
//! else. It is made of `signal_gateway::process_status::catalogue` and `tests/diagnostics.toml` by
//! `UPDATE_DOCS=1 cargo test --test pure diagnostics_doc`.
//!
//! Three tests hold the list against the code: gateways of every kind are driven until they have reported all
//! that is listed; all that they and the other gateways of the tests report is listed; and every text in the
//! sources that make statuses is in the document, reported by a test or not.

mod drives;
mod remedies;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use gateway_base::diagnostics::{Level, MessageRow, Status};
use proc_macro2::{TokenStream, TokenTree};

use crate::support::diagnostics::{Key, TASKS, Task, assert_listed, reasons};

/// Sources that make texts of statuses without making one.
const TEXT_SOURCES: [&str; 3] = [
    "src/gateway-core/command/arbitration.rs",
    "src/turn-signal/flow/status.rs",
    "src/turn-signal/inputs.rs",
];
/// Folders of the crates whose flows have statuses.
const MAKING_STATUSES: [&str; 4] =
    ["src/can-signal", "src/gateway-core", "src/traffic-lights", "src/turn-signal"];
/// Texts in these sources that no status of a gateway contains.
const NOT_IN_A_STATUS: [&str; 13] = [
    // Of `check`, `decode` and the log.
    "{} UNDEFINED",
    "UNDEFINED",
    "turn indicators {} ({}), hazard lights {} ({}), control mode {}",
    // Of a link that is up, which explains nothing.
    "{interface} is up",
    // Of a decider without its flow, as in `decide`: a gateway's time does not go back, it has a map, refuses
    // routes beside it, and has decided before it is queried.
    "nothing decided yet",
    "no inputs",
    "odometry is in the future",
    "odometry is {} ms in the future",
    "no map",
    "no lanelet of the route is on the map",
    "no path to measure on: {error}",
    "the clock went back",
    "the clock went back by {} ms",
];

/// What tells a row from another of its task.
type RowId = (Option<Level>, &'static str);

fn id(row: &MessageRow) -> RowId {
    (row.level, row.template)
}

/// The reported messages and keys by the first name of their task, and the reasons in messages.
#[derive(Default)]
pub(crate) struct Reported {
    messages: BTreeSet<(&'static str, RowId)>,
    reasons: BTreeSet<RowId>,
    keys: BTreeSet<(&'static str, usize)>,
}

impl Reported {
    /// Takes statuses, which must be listed.
    pub(crate) fn take(&mut self, statuses: Vec<Status>) {
        for status in statuses {
            assert_listed(&status);
            let task = Task::of(&status);
            let name = task.section.names[0];
            let keys = task.listed(&status).unwrap();
            self.messages.extend(status.rows.iter().map(|row| (name, id(row))));
            self.reasons.extend(status.rows.iter().map(|row| id(row)));
            self.keys.extend(keys.into_iter().map(|at| (name, at)));
        }
    }
}

#[test]
fn every_listed_entry_is_reported_by_some_gateway() {
    let mut reported = Reported::default();
    drives::drive_all(&mut reported);
    let mut missing = Vec::new();
    for task in &*TASKS {
        let name = task.section.names[0];
        for row in task.section.rows() {
            if !reported.messages.contains(&(name, id(row))) {
                missing.push(format!("{name}: {row:?}"));
            }
        }
        for (at, key) in task.keys.iter().enumerate() {
            if !reported.keys.contains(&(name, at)) {
                missing.push(format!("{name}: the key {}", key.name));
            }
        }
    }
    let unknown = reasons().filter(|row| !reported.reasons.contains(&id(row)));
    missing.extend(unknown.map(|row| format!("the reason {row:?}")));
    assert!(missing.is_empty(), "listed, but reported by no drive:\n{}", missing.join("\n"));
}

#[test]
fn every_text_of_a_status_is_in_the_document() {
    let document = document();
    let mut sources: Vec<_> = TEXT_SOURCES.iter().map(PathBuf::from).collect();
    for folder in MAKING_STATUSES {
        files_making_statuses(Path::new(folder), &mut sources);
    }
    assert!(sources.len() > 10, "{sources:?}");
    let mut absent = Vec::new();
    for path in sources {
        let tokens: TokenStream = fs::read_to_string(project().join(&path)).unwrap().parse().unwrap();
        for text in texts(tokens) {
            let is_listed = pieces(&text).iter().all(|piece| document.contains(piece));
            if !is_listed && !NOT_IN_A_STATUS.contains(&text.as_str()) {
                absent.push(format!("{}: {text:?}", path.display()));
            }
        }
    }
    assert!(absent.is_empty(), "not in docs/diagnostics.md:\n{}", absent.join("\n"));
}

#[test]
fn the_document_is_up_to_date() {
    let path = project().join("docs/diagnostics.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, document()).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    let again = "run `UPDATE_DOCS=1 cargo test --test pure diagnostics_doc`";
    assert!(written == document(), "docs/diagnostics.md is not what the list gives: {again}");
}

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder that make statuses.
fn files_making_statuses(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(project().join(folder)).unwrap() {
        let path = folder.join(entry.unwrap().file_name());
        if project().join(&path).is_dir() {
            files_making_statuses(&path, found);
        } else if fs::read_to_string(project().join(&path)).unwrap().contains("Status::new(&") {
            found.push(path);
        }
    }
}

/// The string literals of a source, but for attributes and tests.
fn texts(tokens: TokenStream) -> Vec<String> {
    let mut found = Vec::new();
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Punct(mark) if mark.as_char() == '#' => {
                tokens.next_if(|token| matches!(token, TokenTree::Punct(mark) if mark.as_char() == '!'));
                let is_test = tokens.next().is_some_and(|attribute| attribute.to_string().contains("test"));
                if is_test {
                    // The item goes up to its braces or its semicolon.
                    tokens.find(|token| matches!(token.to_string().chars().next(), Some('{' | ';')));
                }
            }
            TokenTree::Group(group) => found.extend(texts(group.stream())),
            TokenTree::Literal(literal) => {
                let text = literal.to_string();
                let text = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
                found.extend(text.map(|text| text.replace("\\\"", "\"")));
            }
            TokenTree::Punct(_) | TokenTree::Ident(_) => {}
        }
    }
    found
}

/// What stands between the placeholders of a format.
fn pieces(text: &str) -> Vec<&str> {
    text.split('{')
        .flat_map(|part| part.split_once('}').map_or(part, |(_, rest)| rest).split("; "))
        .map(|piece| piece.trim_matches([' ', ':']))
        .filter(|piece| piece.chars().any(char::is_alphabetic))
        .collect()
}

fn document() -> String {
    let mut text = INTRODUCTION.to_owned();
    for (at, Task { section, about, keys }) in TASKS.iter().enumerate() {
        let names: Vec<_> = section.names.iter().map(|name| format!("`{name}`")).collect();
        writeln!(text, "\n## {}\n\n{about}\n", names.join(", ")).unwrap();
        // The second section is about reports as well, and shares most of the first.
        let first = TASKS.first().filter(|_| at == 1);
        let is_shared =
            |row: &&MessageRow| first.is_some_and(|task| task.section.rows().any(|known| known == *row));
        let (shared, own): (Vec<_>, Vec<_>) = section.rows().partition(is_shared);
        text += "| level | message | what to do |\n|---|---|---|\n";
        text += &rows(&own);
        text += &as_above(shared.iter().map(|row| row.template), "| | ");
        let is_shared =
            |key: &&Key| first.is_some_and(|task| task.keys.iter().any(|known| is_same(known, key)));
        let (shared, own): (Vec<_>, Vec<_>) = keys.iter().partition(is_shared);
        text += "\n| key | meaning |\n|---|---|\n";
        for key in own {
            writeln!(text, "| `{}` | {} |", key.name, meaning(key)).unwrap();
        }
        text += &as_above(shared.iter().map(|key| key.name.as_str()), "| ");
    }
    text += REASONS_TITLE;
    let is_link = |reason: &MessageRow| {
        let mut rows = TASKS.iter().flat_map(|task| task.section.rows());
        rows.any(|row| (row.template, row.remedy) == (reason.template, reason.remedy))
    };
    let others = reasons().filter(|row| !is_link(row)).map(|row| (row.template, row.remedy));
    for (templates, remedy) in grouped(others) {
        writeln!(text, "| {templates} | {remedy} |").unwrap();
    }
    text
}

/// A row that refers to the first section for several texts; empty without any.
fn as_above<'a>(texts: impl Iterator<Item = &'a str>, begin: &str) -> String {
    let texts: Vec<_> = texts.map(|text| format!("`{text}`")).collect();
    if texts.is_empty() {
        String::new()
    } else {
        format!("{begin}{} | [as above](#{FIRST}) |\n", texts.join("<br>"))
    }
}

/// Rows of messages; neighbours with the same level and remedy share one.
fn rows(rows: &[&MessageRow]) -> String {
    let cells = rows.iter().map(|row| (row.template, (row.level.unwrap_or_default(), what_to_do(row))));
    let rows = grouped(cells)
        .into_iter()
        .map(|(templates, (level, remedy))| format!("| {level} | {templates} | {remedy} |\n"));
    rows.collect()
}

/// Joins the templates of neighbours with the same cells behind them.
fn grouped<T: PartialEq>(rows: impl Iterator<Item = (&'static str, T)>) -> Vec<(String, T)> {
    let mut groups: Vec<(String, T)> = Vec::new();
    for (template, cells) in rows {
        match groups.last_mut() {
            Some((templates, known)) if *known == cells => *templates += &format!("<br>`{template}`"),
            Some(_) | None => groups.push((format!("`{template}`"), cells)),
        }
    }
    groups
}

/// Whether two statuses have a key in common.
fn is_same(one: &Key, other: &Key) -> bool {
    (&one.name, &one.meaning, &one.present) == (&other.name, &other.meaning, &other.present)
}

/// The meaning of a key, its unit where the name does not end in it, and its condition.
fn meaning(Key { name, unit, meaning, present }: &Key) -> String {
    let unit = if unit == "-" || name.ends_with(&unit.to_lowercase()) { "" } else { unit };
    let present = if present == "always" { "" } else { present };
    let details: Vec<_> = [unit, present].into_iter().filter(|detail| !detail.is_empty()).collect();
    if details.is_empty() {
        return meaning.clone();
    }
    format!("{} ({}).", meaning.trim_end_matches('.'), details.join("; "))
}

/// What to do about a message: first about its reason, if it has one.
fn what_to_do(row: &MessageRow) -> String {
    let of_reason = row.template.contains("{reason}").then_some("[Reason](#reasons).");
    let texts: Vec<_> =
        of_reason.into_iter().chain(Some(row.remedy)).filter(|text| !text.is_empty()).collect();
    texts.join(" ")
}

/// The section whose messages and keys others share.
const FIRST: &str = "turn_indicators-hazard_lights";

const REASONS_TITLE: &str = "
## Reasons

A `{reason}` in a message is one of these, or a link that is not up, as in [`{interface}`](#interface).

| reason | what to do |
|---|---|
";

const INTRODUCTION: &str = "\
# Diagnostics

<!-- Made by `UPDATE_DOCS=1 cargo test --test pure diagnostics_doc` from signal_gateway::process_status::catalogue and tests/diagnostics.toml. -->

For operators and integrators who read `/diagnostics`. Look up a status to find what each of its messages and keys means, and what to
do.

`/diagnostics` is a `diagnostic_msgs/msg/DiagnosticArray`. The gateway sends all statuses `rate_hz` times a second, and a status at once
when its level or message changes. The name of a status is `<node>: <status>`, its `hardware_id` the one of `[diagnostics]`.
`STALE` is never sent. Messages change only when the situation does; counts and ages are in the keys, which are in
the order of these tables and keep their names. Counts are since start.

In a message `{name}` stands for a text that depends on the vehicle. Without a remedy in the table there is nothing to do. A key with a
condition in brackets is absent otherwise; its unit ends its name, or stands there too.

While the level is not OK, two more keys come last: `remedy` is what to do, in the words of these tables, and `document` is the section
that describes the status, a file of the project with an anchor (a package has it in `/usr/share/doc/signal-gateway`).
[Status](status.md), the live page and [metrics](metrics.md) have the same two.

After the start, and after the first link of a bus, a report waits for its first frames: WARN, *starting*. They are overdue after the
longest timeout of the bus's messages, at least 2 s, and only then is the report an ERROR.

## Silencing a status

The gateway sends every status of what the profile describes, and none can be switched off or lowered: a withheld report stays visible. What
is not wanted is left out, or accepted, where it is read:

| where | how |
|---|---|
| profile | a report that is not described has no status |
| `hazard_not_visible = \"acknowledged\"` in `[reports]` | hazard lights that no signal shows are OK |
| Autoware's diagnostic graph | counts only linked statuses: leave the unit out of [the example](../ros/config/autoware_diagnostic_graph.yaml), remove it with `edits`, or put a unit of type `warn-to-ok` above it |
| `diagnostic_aggregator` | `startswith`, `contains` or `name` of [the analyzer](../ros/config/diagnostic_aggregator.yaml) choose statuses; `IgnoreAnalyzer` drops them |
";
