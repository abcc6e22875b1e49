//! How tests wait: as `tests/support/waiting.rs` does it. What judges the speed of the machine is refused
//! everywhere else: a bare sleep, a deadline below ten seconds, and a time of the machine that is compared
//! with anything.
//!
//! Rust is read as tokens, and of `src` what is `#[cfg(test)]`; a test in virtual time (`start_paused`) may
//! do as it likes. Python is read in lines; a sleep in a loop is the rhythm of a sender or of looks, any
//! other one hopes.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

use super::layering::{is_cfg_test, test_files};
use crate::support::sources::{files_of_kind, project};

/// The only file that may do all of it.
const HOME: &str = "tests/support/waiting.rs";

/// What is refused, and what to use instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Construct {
    Sleep,
    ShortDeadline,
    Clock,
}

use Construct::{Clock, ShortDeadline, Sleep};

impl Construct {
    fn instead(self) -> &'static str {
        match self {
            Sleep => {
                "a bare sleep: wait for the event with `wait_for` or `wait_until`, send in a rhythm with `Pace`, or `let_pass` the \
                 time of something that must not happen"
            }
            ShortDeadline => "a deadline that a busy machine misses: use `waiting::DEADLINE`",
            Clock => "a time of the machine is judged: compare it with a `Bystander`, or use virtual time",
        }
    }
}

/// A file, what is allowed there, and why. An exception without a use is a failure.
#[rustfmt::skip]
const EXCEPTIONS: &[(&str, Construct, &str)] = &[
    ("src/signal-gateway/io/precise_timer.rs", Clock, "a sleep ends no earlier than its time, on any machine"),
    ("tests/process/log_output.rs", Clock,
        "counts the lines that a lifetime allows, which are more on a slow machine"),
    ("tests/dds/daemon_on_ros/recording.rs", Clock, "stamps a command with the present"),
    ("tests/dds/forged.rs", Clock, "lets faults last, and hands what it measures to a bystander"),
    ("tests/dds/isolation/busy.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/dds/isolation/latency.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/dds/isolation/mod.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/dds/outage.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/dds/session/lights.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/dds/session/process.rs", Clock, "hands a time to the test, with what a bystander saw meanwhile"),
    ("tests/dds/slow/outage.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/support/json_process.rs", ShortDeadline,
        "the caller's time, in which something may or must not come"),
    ("tests/vcan/vcan_bus.rs", Clock,
        "counts the wake-ups that a time allows, which are more on a slow machine"),
    ("tests/vcan/vcan_commands/cases.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/vcan/vcan_controller.rs", Clock, "drives the gateway by its own deadlines, as the daemon does"),
    ("tests/vcan/vcan_controller.rs", ShortDeadline,
        "drives the gateway by its own deadlines, as the daemon does"),
    ("tests/vcan/vcan_faults/attacks.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/vcan/vcan_faults/clock.rs", Clock, "goes on for as long as is asked for"),
    ("tests/vcan/vcan_faults/mod.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/vcan/vcan_gateway/reload.rs", Clock, "measures for the documents, and asserts nothing"),
    ("tests/vcan/vcan_gateway/watchers.rs", Clock, "compares times of one run with each other"),
    ("tests/peer/autoware_drive.py", Sleep,
        "waits for what may still follow the last cycle, and must not be wrong"),
    ("tests/zenoh/fleet.rs", Clock, "measures for the documents, and asserts nothing"),
];

#[derive(Debug)]
struct Finding {
    line: usize,
    construct: Construct,
}

#[test]
fn tests_wait_for_events_and_judge_no_machine() {
    let mut found: Vec<(String, Finding)> = Vec::new();
    let mut look = |files: Vec<std::path::PathBuf>, findings: fn(&str) -> Vec<Finding>| {
        for file in files.iter().filter(|file| *file != Path::new(HOME)) {
            let text = fs::read_to_string(project().join(file)).unwrap();
            found.extend(findings(&text).into_iter().map(|finding| (file.display().to_string(), finding)));
        }
    };
    let (test_files, sources) = (test_files(), files_of_kind("src", "rs"));
    assert!(test_files.len() > 10 && sources.len() > test_files.len(), "the sources were not found");
    look(sources.into_iter().filter(|file| !test_files.contains(file)).collect(), in_tests_of_source);
    look(test_files, in_tests);
    look(files_of_kind("tests", "rs"), in_tests);
    look(files_of_kind("tests", "py"), in_python);

    let allows = |(place, construct, _): &(&str, Construct, &str), (file, finding): &(String, Finding)| {
        file == place && *construct == finding.construct
    };
    let mut refused = String::new();
    for hit in found.iter().filter(|hit| !EXCEPTIONS.iter().any(|exception| allows(exception, hit))) {
        let (file, Finding { line, construct }) = hit;
        let _ = writeln!(refused, "{file}:{line}: {}", construct.instead());
    }
    for exception in EXCEPTIONS.iter().filter(|exception| !found.iter().any(|hit| allows(exception, hit))) {
        let _ = writeln!(refused, "no use any more for the exception {exception:?}");
    }
    assert!(refused.is_empty(), "\n{refused}");
}

/// A file without any of these has no findings, and need not be parsed.
const TELLING: [&str; 5] = ["sleep", "timeout", "elapsed", "duration_since", "Instant::now"];

/// Findings in a file of tests.
fn in_tests(text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !TELLING.iter().any(|word| text.contains(word)) {
        return findings;
    }
    find(text.parse().unwrap(), &mut findings);
    findings
}

/// Findings in what is `#[cfg(test)]` in a file.
fn in_tests_of_source(text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    if text.contains("cfg(test)") && TELLING.iter().any(|word| text.contains(word)) {
        walk(text.parse().unwrap(), &mut |tokens, at| {
            let is_test = is_cfg_test(&tokens[at..]);
            if is_test {
                let item = &tokens[at..at + item_length(&tokens[at..])];
                find(item.iter().cloned().collect(), &mut findings);
            }
            is_test
        });
    }
    findings
}

/// Visits each token of a file with those around it. Where `visit` returns true, the item that begins there
/// is passed over.
pub(super) fn walk(tokens: TokenStream, visit: &mut impl FnMut(&[TokenTree], usize) -> bool) {
    let tokens: Vec<_> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        if visit(&tokens, at) {
            at += item_length(&tokens[at..]);
            continue;
        }
        if let TokenTree::Group(group) = &tokens[at] {
            walk(group.stream(), visit);
        }
        at += 1;
    }
}

/// Number of tokens of an item from its attribute on: to its braces or its semicolon.
fn item_length(tokens: &[TokenTree]) -> usize {
    let is_end = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        TokenTree::Punct(punct) => punct.as_char() == ';',
        TokenTree::Ident(_) | TokenTree::Literal(_) => false,
    };
    tokens.iter().position(is_end).map_or(tokens.len(), |end| end + 1)
}

fn find(tokens: TokenStream, findings: &mut Vec<Finding>) {
    walk(tokens, &mut |tokens, at| {
        let is_skipped = is_in_virtual_time(&tokens[at..]);
        if let Some(construct) = refused_at(tokens, at).filter(|_| !is_skipped) {
            findings.push(Finding { line: tokens[at].span().start().line, construct });
        }
        is_skipped
    });
}

/// True at `#[tokio::test(start_paused = true)]`.
fn is_in_virtual_time(tokens: &[TokenTree]) -> bool {
    matches!(tokens, [TokenTree::Punct(hash), TokenTree::Group(attribute), ..]
        if hash.as_char() == '#' && attribute.stream().to_string().contains("start_paused"))
}

/// What is refused about a name with its arguments at this place.
fn refused_at(tokens: &[TokenTree], at: usize) -> Option<Construct> {
    let (TokenTree::Ident(name), TokenTree::Group(arguments)) = (tokens.get(at)?, tokens.get(at + 1)?) else {
        return None;
    };
    if arguments.delimiter() != Delimiter::Parenthesis {
        return None;
    }
    match name.to_string().as_str() {
        "sleep" | "sleep_ms" | "park_timeout" => Some(Sleep),
        "wait_timeout" | "wait_timeout_while" | "recv_timeout" | "set_read_timeout" | "set_write_timeout"
        | "connect_timeout"
            if !is_long(arguments) =>
        {
            Some(ShortDeadline)
        }
        // Of a future; others have one argument or none.
        "timeout" if has_several(arguments) && !is_long(arguments) => Some(ShortDeadline),
        "elapsed" => Some(Clock),
        "duration_since" | "saturating_duration_since" | "checked_duration_since"
            if arguments.stream().to_string() != "UNIX_EPOCH" =>
        {
            Some(Clock)
        }
        "now" if is_instant(tokens, at) && is_judged(tokens, at) => Some(Clock),
        _ => None,
    }
}

/// True if arguments have the deadline of all tests, none at all, or one of ten seconds and more.
fn is_long(arguments: &Group) -> bool {
    let text = arguments.stream().to_string().replace(' ', "");
    let mut words = text.split(|char: char| !(char.is_alphanumeric() || char == '_'));
    let seconds = |text: &str| text.split_once("from_secs(")?.1.split(')').next()?.parse::<u64>().ok();
    words.any(|word| word == "DEADLINE")
        || text == "None"
        || seconds(&text).is_some_and(|seconds| seconds >= 10)
}

fn has_several(arguments: &Group) -> bool {
    let comma = |token: TokenTree| matches!(token, TokenTree::Punct(punct) if punct.as_char() == ',');
    arguments.stream().into_iter().any(comma)
}

/// True if the `now` at this place is that of `Instant`.
fn is_instant(tokens: &[TokenTree], at: usize) -> bool {
    at >= 3 && tokens[at - 3].to_string() == "Instant"
}

/// True if an operator stands before or behind `Instant::now()`, whose `now` is at this place.
fn is_judged(tokens: &[TokenTree], at: usize) -> bool {
    let punctuation = |tokens: &mut dyn Iterator<Item = &TokenTree>| -> String {
        let puncts = tokens.map_while(|token| match token {
            TokenTree::Punct(punct) => Some(punct.as_char()),
            TokenTree::Group(_) | TokenTree::Ident(_) | TokenTree::Literal(_) => None,
        });
        puncts.collect()
    };
    let mut start = at - 3;
    while start >= 3 && punctuation(&mut tokens[start - 2..start].iter()) == "::" {
        start -= 3; // `std::time::`
    }
    let before: String = punctuation(&mut tokens[..start].iter().rev()).chars().rev().collect();
    let behind = punctuation(&mut tokens[at + 2..].iter());
    ["<", ">", "<=", ">=", "+", "-"].contains(&before.trim_end_matches('&'))
        || ["<", ">", "+", "-"].iter().any(|operator| behind.starts_with(operator))
}

/// Findings in a file of Python.
fn in_python(text: &str) -> Vec<Finding> {
    let lines: Vec<&str> = text.lines().collect();
    let mut findings = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let code = line.split(" #").next().unwrap_or_default();
        let is_comment = code.trim_start().starts_with('#');
        if code.contains("time.sleep(") && !is_comment && !is_in_loop(&lines[..=at]) {
            findings.push(Finding { line: at + 1, construct: Sleep });
        }
        let deadlines = code.split("timeout=").skip(1).map(|rest| number(rest, &lines));
        if !is_comment && deadlines.into_iter().any(|seconds| seconds.is_none_or(|seconds| seconds < 10.0)) {
            findings.push(Finding { line: at + 1, construct: ShortDeadline });
        }
    }
    findings
}

/// True if the last of these lines is in the body of a `while` or `for`.
fn is_in_loop(lines: &[&str]) -> bool {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let mut inner = lines.last().map_or(0, |line| indent(line));
    // A line that only closes brackets belongs to the one that opens them.
    let is_closing = |line: &&&str| line.trim().is_empty() || line.trim_start().starts_with([')', ']', '}']);
    for line in lines.iter().rev().filter(|line| !is_closing(line)) {
        if indent(line) < inner {
            inner = indent(line);
            let words = line.trim_start();
            if words.starts_with("while ") || words.starts_with("for ") {
                return true;
            }
        }
    }
    false
}

/// The number at the beginning of a text, or that of the constant whose name is there.
fn number(text: &str, lines: &[&str]) -> Option<f64> {
    let end = text.find(|char: char| !(char.is_alphanumeric() || "_.".contains(char))).unwrap_or(text.len());
    let value = |text: &str| text.trim().replace('_', "").parse().ok();
    let constant =
        || lines.iter().find_map(|line| value(line.strip_prefix(&text[..end])?.strip_prefix(" = ")?));
    value(&text[..end]).or_else(constant)
}

mod the_rules_themselves {
    use std::panic::catch_unwind;
    use std::time::Duration;

    use super::*;
    use crate::support::waiting::Lateness;

    fn constructs(findings: &[Finding]) -> Vec<Construct> {
        findings.iter().map(|finding| finding.construct).collect()
    }

    #[test]
    fn what_judges_the_machine_is_refused() {
        for (code, construct) in [
            ("fn f() { std::thread::sleep(Duration::from_millis(5)); }", Sleep),
            ("fn f() { assert!({ thread::park_timeout(SECOND); true }) }", Sleep),
            ("fn f() { m!(tokio::time::sleep(at)) }", Sleep),
            ("fn f() { socket.set_read_timeout(Some(Duration::from_secs(9))) }", ShortDeadline),
            ("fn f() { lines.recv_timeout(OWN_DEADLINE) }", ShortDeadline),
            (
                "fn f() { changed.wait_timeout_while(guard, Duration::from_millis(500), |is| !is) }",
                ShortDeadline,
            ),
            ("async fn f() { timeout(SILENCE, inputs.recv()).await }", ShortDeadline),
            ("fn f() { assert!(begun.elapsed() < LIMIT) }", Clock),
            ("fn f() { let took = begun.elapsed(); }", Clock),
            ("fn f() { while Instant::now() < end {} }", Clock),
            ("fn f() { let end = std::time::Instant::now() + LIMIT; }", Clock),
            ("fn f() { assert!(end >= std::time::Instant::now()) }", Clock),
            ("fn f() { let late = Instant::now().duration_since(due); }", Clock),
        ] {
            assert_eq!(constructs(&in_tests(code)), [construct], "{code}");
            let code = format!("#[cfg(test)]\nmod tests {{ {code} }}");
            assert_eq!(constructs(&in_tests_of_source(&code)), [construct], "{code}");
        }
        for (code, construct) in [
            ("time.sleep(1)", Sleep),
            ("for x in y:\n    z()\ntime.sleep(1)", Sleep),
            ("process.wait(timeout=5)", ShortDeadline),
            ("PATIENCE_S = 9.5\nprocess.wait(timeout=PATIENCE_S)", ShortDeadline),
            ("process.wait(timeout=unknown)", ShortDeadline),
        ] {
            assert_eq!(constructs(&in_python(code)), [construct], "{code}");
        }
    }

    #[test]
    fn what_holds_on_every_machine_is_not() {
        for code in [
            "fn f() { wait_until(what, || is_there()); let_pass(TIME, why); pace.wait(); }",
            "fn f() { socket.set_read_timeout(Some(DEADLINE)).unwrap(); socket.set_read_timeout(None) }",
            "fn f() { socket.set_read_timeout(Some(Duration::from_secs(10))) }",
            "async fn f() { tokio::time::timeout(waiting::DEADLINE, task).await }",
            "fn f() { assert_eq!(timeout(MEDIAN), message.timing.timeout()) }",
            "fn f() { let (start, x) = (Instant::now(), 1); lines.push((Instant::now(), line)); look(start + ms(5)) }",
            "fn f() { let x = match y { A => Instant::now(), B => std::time::Instant::now() }; }",
            "fn f() { SystemTime::now().duration_since(UNIX_EPOCH) }",
            "#[tokio::test(start_paused = true)]\nasync fn f() { sleep(MS).await; assert_eq!(start.elapsed(), MS) }",
            "// thread::sleep(x)\nconst A: &str = \"sleep 1000; begun.elapsed() < x\";",
        ] {
            assert_eq!(constructs(&in_tests(code)), [], "{code}");
        }
        let sleep = "thread::sleep(MS)";
        for code in [format!("fn f() {{ {sleep} }}"), format!("#[cfg(test)] use a; fn f() {{ {sleep} }}")] {
            assert_eq!(constructs(&in_tests_of_source(&code)), [], "{code}");
        }
        for code in [
            "while not ended:\n    send()\n\n    if late:\n        time.sleep(1)",
            "while not (\n    is_there()\n):\n    time.sleep(1)",
            "# time.sleep(1)\nprint() # timeout=1",
            "WAIT_MS = 150_000\nexpect.set_options(timeout=WAIT_MS)\nprocess.wait(timeout=10)",
        ] {
            assert_eq!(constructs(&in_python(code)), [], "{code}");
        }
    }

    #[test]
    fn findings_have_their_lines() {
        let rust = "fn f() {\n    a();\n    thread::sleep(MS);\n}\n";
        for findings in [in_tests(rust), in_python("import time\n\ntime.sleep(1)\n")] {
            assert_eq!(findings.iter().map(|finding| finding.line).collect::<Vec<_>>(), [3]);
        }
    }

    #[test]
    fn times_are_judged_by_what_the_machine_takes_from_everybody() {
        let [limit, took] = [1, 2].map(Duration::from_secs);
        let late = |ms| Lateness { worst: Duration::from_millis(ms), total: Duration::from_millis(ms) };
        for (lateness, is_span_in_time, is_gap_in_time) in
            [(late(0), false, false), (late(80), true, false), (late(100), true, true)]
        {
            let span = catch_unwind(|| lateness.assert_span("work", took, limit));
            let gap = catch_unwind(|| lateness.assert_gap("a series", took, limit));
            assert_eq!((span.is_ok(), gap.is_ok()), (is_span_in_time, is_gap_in_time), "{lateness:?}");
        }
    }
}
