//! `discover` live, with the simulated vehicles of shipped profiles as cars that nobody knows.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::prerequisite::require;
use crate::support::vcan::Vcan;

/// Profiles of each form: an enumerated state, a pair, lamps, a momentary stalk, hazard lights of each kind.
const PROFILES: [&str; 6] = ["mazda_2017", "vw_mqb", "hyundai_kia", "demo_vehicle", "pacmod", "toyota_nodsu"];

/// What the driver does at a request.
fn action(line: &str, before: &mut &'static str) -> Option<&'static str> {
    let has = |word: &str| line.split_whitespace().any(|field| field == word);
    let (action, now) = if has("HANDS") {
        return None;
    } else if has("OFF") {
        (if *before == "hazard" { "hazard off" } else { "stalk off" }, "off")
    } else if has("LEFT") && has("indicate") {
        ("stalk left", "left")
    } else if has("RIGHT") && has("indicate") {
        ("stalk right", "right")
    } else if has("HAZARD") && has("press") {
        ("hazard on", "hazard")
    } else {
        return None;
    };
    *before = now;
    Some(action)
}

/// Runs a session; returns what it printed, with its exit code.
fn session(profile: &str, interface: &str, folder: &Path) -> (Option<i32>, String) {
    let gateway = || Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    let mut car = gateway()
        .args(["vehicle", "--profile", profile, "--interface", interface])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut driver = car.stdin.take().unwrap();
    let mut discover = gateway()
        .current_dir(folder)
        .args(["discover", "--live", interface, "--output", "car"])
        .args(["--quiet-s", "4", "--hold-s", "4", "--rest-s", "3"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut text, mut before) = (String::new(), "off");
    for line in BufReader::new(discover.stdout.take().unwrap()).lines() {
        let line = line.unwrap();
        if let Some(action) = action(&line, &mut before) {
            writeln!(driver, "{action}").unwrap();
        }
        text += &(line + "\n");
    }
    let code = discover.wait().unwrap().code();
    car.kill().unwrap();
    car.wait().unwrap();
    (code, text)
}

#[test]
fn simulated_vehicles_are_discovered_live_and_their_actions_are_reported() {
    let names = ["vcan-d0", "vcan-d1", "vcan-d2", "vcan-d3", "vcan-d4", "vcan-d5"];
    let mut interfaces = Vec::new();
    for name in names {
        interfaces.push(require!(Vcan::new(name)));
    }
    let sessions: Vec<_> = PROFILES
        .into_iter()
        .zip(names)
        .map(|(profile, interface)| {
            std::thread::spawn(move || {
                let folder = tempfile::tempdir().unwrap();
                let (code, text) = session(profile, interface, folder.path());
                (profile, folder, code, text)
            })
        })
        .collect();
    for session in sessions {
        let (profile, folder, code, text) = session.join().unwrap();
        println!("--- {profile}\n{text}");
        assert!(matches!(code, Some(0 | 4)), "{profile}: {code:?}\n{text}");
        assert!(text.contains("requests to the left") && !text.contains("NOT SURE"), "{profile}:\n{text}");
        let replay = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
            .current_dir(folder.path().join("car"))
            .args(["replay", "session.log", "--config", "gateway.toml"])
            .output()
            .unwrap();
        let reported = String::from_utf8_lossy(&replay.stdout);
        for state in ["ENABLE_LEFT", "ENABLE_RIGHT"] {
            assert!(reported.matches(state).count() >= 2, "{profile}: {state}\n{text}\n{reported}");
        }
    }
}
