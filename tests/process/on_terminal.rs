//! What a person sees on a terminal: colours, wrapped lines and progress; and that nobody else gets them.

use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::support::program::program;
use crate::support::sources::project;
use crate::support::terminal::{COLUMNS, OnTerminal, plain};

fn gateway(args: &[&str]) -> Command {
    let mut command = program(project(), args);
    command.env_remove("COLUMNS");
    command
}

const CHECK: [&str; 4] = ["check", "config/demo.log.gz", "--profile", "demo_vehicle"];

#[test]
fn findings_have_colours_and_lines_that_fit() {
    let (code, shown) = OnTerminal::start(&mut gateway(&CHECK)).end();
    assert_eq!(code, Some(4));
    assert!(shown.contains("\u{1b}[1m\u{1b}[33mwarning\u{1b}[0m    "), "{shown}");
    let text = plain(&shown);
    // Progress is written over.
    for line in text.split(['\n', '\r']) {
        assert!(line.chars().count() <= usize::from(COLUMNS), "{line}");
    }
    // The columns of values that do not fit side by side.
    let value = "value      BCM_TurnIndicators.TurnIndicatorState = 1 \"Left\"\n             turn left ";
    assert!(text.replace('\r', "").contains(value), "{text}");
    let (_, refused) = OnTerminal::start(&mut gateway(&["check", "--profile", "hyundai_ki"])).end();
    assert!(refused.contains("\u{1b}[1m\u{1b}[91merror\u{1b}[0m"), "{refused:?}");
}

#[test]
fn colours_can_be_refused_on_a_terminal() {
    let mut without = gateway(&CHECK);
    let (_, shown) = OnTerminal::start(without.env("NO_COLOR", "1")).end();
    assert!(!shown.contains("\u{1b}[3"), "{shown:?}");
    let never = [&CHECK[..], &["--color", "never"]].concat();
    let (_, shown) = OnTerminal::start(&mut gateway(&never)).end();
    assert!(!shown.contains("\u{1b}[3"), "{shown:?}");
}

#[test]
fn what_takes_longer_than_a_second_shows_progress_and_clears_it_unless_it_is_to_be_quiet() {
    for quiet in [false, true] {
        let mut command = gateway(&["identify", "-"]);
        if quiet {
            command.arg("--quiet");
        }
        let (read, mut write) = std::io::pipe().unwrap();
        let terminal = OnTerminal::start_with(&mut command, Some(Stdio::from(read)));
        writeln!(write, "(1.000000) can0 2A5#0000000000000000").unwrap();
        if !quiet {
            // It stands as long as there may be more to read.
            terminal.wait_for(" standard input, ");
        }
        drop(write);
        let (code, shown) = terminal.end();
        // No profile fits one frame.
        assert_eq!(code, Some(4));
        assert_eq!(shown.contains("standard input, "), !quiet, "{shown:?}");
        let (_, end) = shown.rsplit_once("standard input, ").unwrap_or(("", &shown));
        assert!(quiet || end.contains("\u{1b}[2K"), "{shown:?}");
        assert!(plain(&shown).contains("1 frame in 0.000 s on can0"), "{shown:?}");
    }
}
