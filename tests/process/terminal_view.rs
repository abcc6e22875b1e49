//! The live view on a real terminal, which tmux plays: it starts, follows keys and the terminal's size, and
//! gives the terminal back however the command ends.

use std::path::Path;
use std::process::Command;

use signal_gateway::report::terminal::TerminalView;
use signal_gateway::report::terminal::view_model::Model;

use crate::support::prerequisite::require;
use crate::support::process::Folder;
use crate::support::tmux::Tmux;
use crate::support::waiting::{wait_for, wait_until};

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");

fn is_running(process: &str) -> bool {
    let state = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    !(state.is_empty() || state.contains(") Z "))
}

fn kill(signal: &str, process: &str) {
    assert!(Command::new("kill").args([signal, process]).status().unwrap().success());
}

#[test]
fn view_shows_left_and_the_log_and_ends_on_q() {
    let tmux = require!(Tmux::run(&format!("RUST_LOG=info {GATEWAY} demo --no-ros --repeat --speed 4")));
    tmux.wait_for(|screen| screen.contains("the driver pulls the stalk left") && screen.contains("✓ left"));
    // The beginning of the log.
    tmux.press("Home");
    tmux.wait_for(|screen| screen.contains(" Demo vehicle: ROS 2 off"));
    tmux.press("q");
    let end = tmux.wait_for_end();
    assert!(end.contains("code 0") && end.contains("Try next"), "{end}");
}

#[test]
fn view_follows_the_size_of_the_terminal() {
    let tmux = require!(Tmux::run(&format!("{GATEWAY} demo --no-ros --repeat")));
    tmux.wait_for(|screen| screen.contains("╭─────────╮"));
    tmux.tell(&["resize-window", "-x", "50", "-y", "24"]);
    let small = tmux.wait_for(|screen| screen.contains("╭─┬─────┬─╮") && screen.contains("q quit"));
    assert!(small.lines().all(|line| line.chars().count() <= 50), "{small}");
}

#[test]
fn signal_gives_the_terminal_back() {
    for signal in ["-TERM", "-INT", "-QUIT"] {
        let tmux = require!(Tmux::run(&format!("{GATEWAY} demo --no-ros --repeat")));
        tmux.wait_for(|screen| screen.contains("q quit"));
        kill(signal, &tmux.child());
        assert!(tmux.wait_for_end().contains("code 0"));
    }
}

#[test]
fn terminal_that_is_closed_ends_the_gateway() {
    let tmux = require!(Tmux::run(&format!("{GATEWAY} demo --no-ros --repeat")));
    tmux.wait_for(|screen| screen.contains("q quit"));
    let child = tmux.child();
    drop(tmux);
    wait_until("the end of the gateway", || !is_running(&child));
}

#[test]
fn panic_gives_the_terminal_back_and_is_shown() {
    // This test runs itself in the terminal, and panics there once it is shown.
    const VARIABLE: &str = "SIGNAL_GATEWAY_TEST_PANIC_ON";
    if let Some(file) = std::env::var_os(VARIABLE) {
        let model = Model { title: "about to panic".to_owned(), ..Model::default() };
        let _view = TerminalView::start(model, None).unwrap();
        wait_until("the time to panic", || Path::new(&file).exists());
        panic!("as planned");
    }
    let folder = tempfile::tempdir().unwrap();
    let (file, program) = (folder.path().join("go"), std::env::current_exe().unwrap());
    let test = "process::terminal_view::panic_gives_the_terminal_back_and_is_shown";
    let command = format!(
        "RUST_BACKTRACE=0 {VARIABLE}={} {} --exact {test} --nocapture",
        file.display(),
        program.display()
    );
    let tmux = require!(Tmux::run(&command));
    tmux.wait_for(|screen| screen.contains("about to panic"));
    std::fs::write(&file, "").unwrap();
    let end = tmux.wait_for_end();
    assert!(end.contains("as planned") && end.contains("code 101"), "{end}");
}

#[test]
fn plain_lines_stay_on_the_screen() {
    for arguments in ["--plain", "| cat"] {
        let tmux = require!(Tmux::run(&format!("{GATEWAY} demo --no-ros --speed 30 {arguments}")));
        tmux.wait_for_end();
        let all = tmux.tell(&["capture-pane", "-p", "-S", "-"]);
        for line in ["9.000 ▸ the driver pulls the stalk left", "turn_indicators  left", "Try next"] {
            assert!(all.contains(line), "{all}");
        }
    }
}

#[test]
fn driver_of_a_rehearsal_comes_before_the_command() {
    let run = || Tmux::run(&format!("{GATEWAY} demo commands --speed 3"));
    let mut first = Some(require!(run()));
    // A state may be over before it is looked for.
    let tmux = wait_for("a run in which both states are seen", || {
        let tmux = first.take().unwrap_or_else(|| run().unwrap());
        let sees = |all: [&str; 3]| {
            let has_all = |screen: &str| all.iter().all(|text| screen.contains(text));
            has_all(&tmux.wait_for(|screen| has_all(screen) || screen.contains("Try next")))
        };
        let states = [
            ["the decider commands left", "left  (commanded left)", "turn left, hazard off"],
            ["the driver holds the stalk right", "turn     ✓ right", "left to the driver: right"],
        ];
        states.into_iter().all(sees).then_some(tmux)
    });
    tmux.press("q");
    tmux.wait_for_end();
}

#[test]
fn messages_of_a_missing_interface_are_a_table_with_its_keys() {
    let folder = Folder::with_demo_vehicle("not-there", "");
    let decode = format!("{GATEWAY} decode --live -c {}", folder.path().join("gateway.toml").display());
    let tmux = require!(Tmux::run(&decode));
    let shown = tmux.wait_for(|screen| screen.contains("link missing") && screen.contains("s by id"));
    assert!(shown.contains("nothing received yet") && shown.contains("not-there"), "{shown}");
    tmux.press("s");
    tmux.wait_for(|screen| screen.contains("s by rate"));
    tmux.press("/");
    tmux.press("q");
    tmux.wait_for(|screen| screen.contains(" /q"));
    tmux.press("Escape");
    tmux.wait_for(|screen| screen.contains("/ filter"));
    tmux.press("q");
    assert!(tmux.wait_for_end().contains("code 0"));
    let plain = require!(Tmux::run(&format!("{decode} --plain")));
    plain.wait_for(|screen| screen.contains("not-there"));
    plain.press("C-c");
    let end = plain.wait_for_end();
    assert!(!end.contains("s by id") && end.contains("code 0"), "{end}");
}

mod slow {
    use super::*;

    /// A terminal that takes nothing: the gateway goes on all the same, and ends on its signal.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn terminal_that_is_stuck_does_not_hold_the_gateway_up() {
        let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/config/demo.log.gz");
        let keys = format!(
            "source = \"recording\"\n[recording]\nfile = \"{recording}\"\nrepeat = true\nspeed = 20\n\
             [ros]\nenabled = false\n[status]\nsocket = \"status.sock\"\n"
        );
        let folder = Folder::with_demo_vehicle("can0", &keys);
        let config = folder.path().join("gateway.toml");
        let tmux = require!(Tmux::run(&format!("{GATEWAY} run -c {}", config.display())));
        tmux.wait_for(|screen| screen.contains("q quit") && screen.contains("turning "));
        let (child, server) =
            (tmux.child(), tmux.tell(&["display-message", "-p", "#{pid}"]).trim().to_owned());
        let stamp_ns = || {
            let mut command = Command::new(GATEWAY);
            let socket = folder.path().join("status.sock");
            let output = command.args(["status", "--json", "--socket"]).arg(socket).output().unwrap();
            serde_json::from_slice::<serde_json::Value>(&output.stdout).ok()?["stamp_ns"].as_i64()
        };
        kill("-STOP", &server);
        let _resumed = Resumed(&server);
        let stopped = wait_for("a status", stamp_ns);
        // Two rounds of the recording change far more on the screen than waits on the way to it.
        wait_until("two rounds", || stamp_ns().is_some_and(|stamp| stamp - stopped > 4_500_000_000));
        kill("-TERM", &child);
        wait_until("the end of the gateway", || !is_running(&child));
    }

    /// A stopped process that goes on at the end, since nothing ends it before.
    struct Resumed<'a>(&'a str);

    impl Drop for Resumed<'_> {
        fn drop(&mut self) {
            kill("-CONT", self.0);
        }
    }
}
