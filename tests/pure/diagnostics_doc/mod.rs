//! `docs/diagnostics.md` lists every status with its messages and keys, and lists nothing else. It is made of
//! `tests/diagnostics.toml` by `UPDATE_DOCS=1 cargo test --test pure diagnostics_doc`.
//!
//! Three tests hold the list against the code: gateways of every kind are driven until they have reported all that
//! is listed; all that they and the other gateways of the tests report is listed; and every text in the sources
//! that make statuses is in the document, reported by a test or not.

mod drives;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use signal_gateway::core::diagnostics::{Level, Status};

use crate::support::diagnostics::{Key, Message, TASKS, Task};

/// Sources that make texts of statuses without naming `core::diagnostics`.
const TEXT_SOURCES: [&str; 4] = [
    "src/core/command/arbitration.rs",
    "src/core/turn_signal/inputs.rs",
    "src/core/validation/display.rs",
    "src/core/vehicle_lights/warning.rs",
];
/// Texts in these sources that no status of a gateway contains.
const NOT_IN_A_STATUS: [&str; 13] = [
    // Of `check`, `decode` and the log.
    "{} UNDEFINED",
    "UNDEFINED",
    "turn indicators {} ({}), hazard lights {} ({}), control mode {}",
    // Of a link that is up, which explains nothing.
    "{interface} is up",
    // Of a decider without its flow, as in `decide`: a gateway's time does not go back, it has a map, refuses routes
    // beside it, and has decided before it is queried.
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

/// The reported messages and keys, each by task and number in the list.
#[derive(Default)]
pub(crate) struct Reported {
    messages: BTreeSet<(&'static str, usize)>,
    keys: BTreeSet<(&'static str, usize)>,
}

impl Reported {
    /// Takes statuses, which must be listed.
    pub(crate) fn take(&mut self, statuses: Vec<Status>) {
        for status in statuses {
            let task = Task::of(&status.task);
            let (messages, keys) = task.parts(&status).unwrap_or_else(|wrong| panic!("{wrong}: {status:?}"));
            self.messages.extend(messages.into_iter().map(|at| (task.names[0].as_str(), at)));
            self.keys.extend(keys.into_iter().map(|at| (task.names[0].as_str(), at)));
        }
    }
}

#[test]
fn every_listed_entry_is_reported_by_some_gateway() {
    let mut reported = Reported::default();
    drives::drive_all(&mut reported);
    let mut missing = Vec::new();
    for task in &*TASKS {
        let name = task.names[0].as_str();
        for (at, Message { level, pattern, .. }) in task.messages.iter().enumerate() {
            if !reported.messages.contains(&(name, at)) {
                missing.push(format!("{name}: {level} {pattern}"));
            }
        }
        for (at, key) in task.keys.iter().enumerate() {
            if !reported.keys.contains(&(name, at)) {
                missing.push(format!("{name}: the key {}", key.name));
            }
        }
    }
    assert!(missing.is_empty(), "listed, but reported by no drive:\n{}", missing.join("\n"));
}

#[test]
fn every_text_of_a_status_is_in_the_document() {
    let document = document();
    let mut sources: Vec<_> = TEXT_SOURCES.iter().map(PathBuf::from).collect();
    files_naming_diagnostics(Path::new("src/core"), &mut sources);
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

/// Files below a folder that name `core::diagnostics`, but for the module itself and for snapshots, which only copy statuses.
fn files_naming_diagnostics(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(project().join(folder)).unwrap() {
        let path = folder.join(entry.unwrap().file_name());
        if path.ends_with("snapshot.rs") {
            continue;
        }
        if project().join(&path).is_dir() {
            files_naming_diagnostics(&path, found);
        } else if fs::read_to_string(project().join(&path)).unwrap().contains("core::diagnostics::") {
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
                found.extend(
                    text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).map(str::to_owned),
                );
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
    for Task { names, about, messages, keys } in &*TASKS {
        let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
        writeln!(text, "\n## {}\n\n{about}\n", names.join(", ")).unwrap();
        text += "| level | message | what to do |\n|---|---|---|\n";
        for Message { level, pattern, action } in messages {
            writeln!(text, "| {level} | `{pattern}` | {action} |").unwrap();
        }
        text += "\n| key | unit | meaning | present |\n|---|---|---|---|\n";
        for Key { name, unit, meaning, present } in keys {
            writeln!(text, "| `{name}` | {unit} | {meaning} | {present} |").unwrap();
        }
    }
    text
}

const INTRODUCTION: &str = "\
# Diagnostics

<!-- Made by `UPDATE_DOCS=1 cargo test --test pure diagnostics_doc` from tests/diagnostics.toml. -->

For operators and integrators who read `/diagnostics`. Look up a status to find what each of its messages and keys means, and what to
do.

`/diagnostics` is a `diagnostic_msgs/msg/DiagnosticArray`. The gateway sends all statuses `rate_hz` times a second, and a status at once
when its level or message changes. The name of a status is `<node>: <status>`, `hardware_id` is the profile's name.
`STALE` is never sent. Messages change only when the situation does; counts and ages are in the keys, which are in
the order of these tables and keep their names.

In a message `{name}` stands for a text that depends on the vehicle, and text in `[…]` may be absent.
";

#[test]
fn a_message_is_recognised_by_its_pattern_and_level_alone() {
    let check = |level, message: &str, keys: &[&'static str]| {
        let values = keys.iter().map(|key| (*key, String::new())).collect();
        let status = Status::new("command_transmission", level, message.into(), values);
        Task::of("command_transmission").parts(&status).map(|(messages, _)| messages)
    };
    let keys: Vec<_> = Task::of("command_transmission").keys.iter().map(|key| key.name.as_str()).collect();
    assert_eq!(check(Level::Ok, "control mode MANUAL", &keys), Ok(vec![0]));
    for (level, message) in [
        (Level::Warn, "control mode MANUAL"),
        (Level::Ok, "control mode "),
        (Level::Ok, "frames are delayed"),
        (Level::Ok, "all is well"),
    ] {
        assert!(check(level, message, &keys).is_err(), "{level} {message}");
    }
    let mut others = keys.clone();
    others.swap(0, 1);
    for keys in [&keys[1..], &others, &[&keys[..], &["more"]].concat()] {
        assert!(check(Level::Ok, "control mode MANUAL", keys).is_err(), "{keys:?}");
    }
}
