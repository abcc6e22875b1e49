//! No program reads a text that was made for people: what a text says is also there as data. `src` splits,
//! searches or compares no text with a literal of several words or a separator such as `": "`, except for
//! texts from outside.
//!
//! Rust is read as tokens. Every such literal has a blank in it; a single word is a name, which programs may
//! compare.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, TokenTree};

use super::layering::{is_cfg_test, test_files};
use super::waiting_rules::walk;
use crate::support::sources::{files_of_kind, project};

/// Methods that compare a text with their argument.
const COMPARING: [&str; 15] = [
    "contains",
    "ends_with",
    "find",
    "matches",
    "rfind",
    "rsplit",
    "rsplit_once",
    "rsplitn",
    "split",
    "split_once",
    "split_terminator",
    "splitn",
    "starts_with",
    "strip_prefix",
    "strip_suffix",
];

/// Files or folders that may, and why. An exception without a use is a failure.
const EXCEPTIONS: [(&str, &str); 8] = [
    ("src/signal-gateway/check/report.rs", "breaks lines between columns"),
    ("src/signal-gateway/cli/manual.rs", "sets the help of the commands as manual pages"),
    ("src/signal-gateway/config/file_kind.rs", "recognises DBC files"),
    ("src/signal-gateway/config/reading/toml_text.rs", "messages of the crate toml have no kinds"),
    ("src/signal-gateway/config/scenario/open_scenario/parameters.rs", "substitutions of ROS launch files"),
    ("src/can-log/formats", "recordings of others"),
    ("src/signal-gateway/io/ros/session/child.rs", "/proc has its numbers in texts"),
    ("src/signal-gateway/report/metrics.rs", "turns OpenMetrics into the format before it"),
];

#[test]
fn no_text_for_people_is_read_by_a_program() {
    let test_files = test_files();
    let sources = files_of_kind("src", "rs").into_iter().filter(|file| !test_files.contains(file));
    let mut found = Vec::new();
    for file in sources {
        let text = fs::read_to_string(project().join(&file)).unwrap();
        found.extend(lines_of(&text).into_iter().map(|line| (file.clone(), line)));
    }
    let allows = |place: &str, file: &Path| file.starts_with(place);
    let mut refused = String::new();
    for (file, line) in &found {
        if !EXCEPTIONS.iter().any(|(place, _)| allows(place, file)) {
            let _ = writeln!(refused, "{}:{line}: reads a text for people: hand over data", file.display());
        }
    }
    for exception in EXCEPTIONS.iter().filter(|(place, _)| !found.iter().any(|(file, _)| allows(place, file)))
    {
        let _ = writeln!(refused, "unused exception {exception:?}");
    }
    assert!(refused.is_empty(), "\n{refused}");
}

/// Returns the lines on which a source compares a text with a literal that has a blank; tests are left out.
fn lines_of(text: &str) -> Vec<usize> {
    let mut lines = Vec::new();
    walk(text.parse().unwrap(), &mut |tokens, at| {
        let is_test = is_cfg_test(&tokens[at..]);
        if !is_test && compares(tokens, at) {
            lines.push(tokens[at].span().start().line);
        }
        is_test
    });
    lines
}

/// True if a text is compared at this place: by a method, an operator, or as a pattern.
fn compares(tokens: &[TokenTree], at: usize) -> bool {
    let is_mark = |at: Option<usize>, marks: &[char]| {
        let token = at.and_then(|at| tokens.get(at));
        matches!(token, Some(TokenTree::Punct(mark)) if marks.contains(&mark.as_char()))
    };
    match (&tokens[at], tokens.get(at + 1)) {
        (TokenTree::Ident(name), Some(TokenTree::Group(arguments))) => {
            arguments.delimiter() == Delimiter::Parenthesis
                && COMPARING.contains(&name.to_string().as_str())
                && arguments.stream().into_iter().next().is_some_and(|argument| has_blank(&argument))
        }
        (literal, _) if has_blank(literal) => {
            let is_compared = is_mark(at.checked_sub(1), &['=']) && is_mark(at.checked_sub(2), &['=', '!']);
            let is_pattern = is_mark(Some(at + 1), &['=', '!']) && is_mark(Some(at + 2), &['>', '=']);
            is_compared || is_pattern || is_mark(Some(at + 1), &['|'])
        }
        _ => false,
    }
}

/// True for a string with a blank.
fn has_blank(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Literal(_)) && {
        let text = token.to_string();
        text.starts_with('"') && text.contains(' ')
    }
}

#[test]
fn readers_of_texts_are_found() {
    for code in [
        "fn f() { text.split(\", \") }",
        "fn f() { let (task, _) = name.split_once(\": \")?; }",
        "fn f() { if text.starts_with(\"did you mean\") {} }",
        "fn f() { text == \"no command\" }",
        "fn f() { \"no command\" != text }",
        "fn f() { match text { \"a zip archive\" => 1, _ => 2 } }",
    ] {
        assert!(!lines_of(code).is_empty(), "{code}");
    }
    for code in [
        "fn f() { text.split(' ').chain(name.split_once('=')) }",
        "fn f() { name == \"left\" || text.contains(\"::\") }",
        "fn f() { let text = \"no command\"; list.join(\", \") }",
        "#[cfg(test)] mod tests { fn f() { text == \"no command\" } }",
        "/// text == \"no command\"\nfn f() {}",
    ] {
        assert!(lines_of(code).is_empty(), "{code}");
    }
}
