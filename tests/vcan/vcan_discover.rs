//! `discover` live, with the simulated vehicles of shipped profiles as cars that nobody knows.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use socketcan::{CanFdSocket, Socket as _};

use crate::support::prerequisite::{Missing, require};
use crate::support::processor::waited;
use crate::support::vcan::Vcan;
use crate::support::waiting::{Bystander, Lateness};

/// Profiles for the quick run: an enumerated state, lamps, a message that is sent on change.
const PROFILES: [&str; 3] = ["mazda_2017", "hyundai_kia", "demo_vehicle"];
/// Number of vehicles that are discovered at the same time.
const MAX_AT_ONCE: usize = 8;
/// Time that the driver has for a request, and for which it is held.
const HOLD: Duration = Duration::from_secs(4);
/// A vehicle that was not discovered is discovered so often.
const ATTEMPTS: usize = 3;

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

/// Waits for the first frame of the vehicle, whose silence would end the session.
fn await_frame(bus: &CanFdSocket, car: &mut Child) {
    while bus.read_frame_timeout(Duration::from_millis(100)).is_err() {
        assert!(car.try_wait().unwrap().is_none(), "the vehicle has ended");
    }
}

/// Runs a session; returns what it printed, with its exit code, and how long the vehicle waited for a
/// processor.
fn session(profile: &str, interface: &str, folder: &Path) -> (Option<i32>, String, Duration) {
    let gateway = || Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    let bus = CanFdSocket::open(interface).unwrap();
    let mut car = gateway()
        .args(["vehicle", "--profile", profile, "--interface", interface])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut driver = car.stdin.take().unwrap();
    await_frame(&bus, &mut car);
    let mut discover = gateway()
        .current_dir(folder)
        .args(["discover", "--live", interface, "--output", "car"])
        .args(["--quiet-s", "4", "--hold-s", &HOLD.as_secs().to_string(), "--rest-s", "3"])
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
    let waited = waited(car.id());
    car.kill().unwrap();
    car.wait().unwrap();
    (code, text, waited)
}

/// What came of the discovery of a vehicle.
struct Outcome {
    profile: String,
    /// The vehicle, and what the session printed and reported; `None` if both sides were found, and the
    /// recorded session has the actions when the written configuration replays it.
    failure: Option<String>,
    /// How late a thread was that only slept meanwhile, and how long the vehicle waited for a processor.
    beside: Lateness,
    waited: Duration,
}

fn discover(profile: &str, interface: &str) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let beside = Bystander::start();
    let (code, text, waited) = session(profile, interface, folder.path());
    let beside = beside.finish();
    println!("--- {profile}\n{text}");
    let replay = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .current_dir(folder.path().join("car"))
        .args(["replay", "session.log", "--config", "gateway.toml"])
        .output()
        .unwrap();
    let reported = String::from_utf8_lossy(&replay.stdout);
    let is_reported = |state: &str| reported.matches(state).count() >= 2;
    let is_sure = text.contains("requests to the left") && !text.contains("NOT SURE");
    let is_discovered = matches!(code, Some(0 | 4))
        && is_sure
        && is_reported("turn_indicators  left")
        && is_reported("turn_indicators  right");
    let failure = (!is_discovered).then(|| format!("--- {profile}: {code:?}\n{text}\n{reported}"));
    Outcome { profile: profile.to_owned(), failure, beside, waited }
}

/// Discovers the vehicles, each on an interface of its own, all at the same time. One that was not discovered
/// is discovered once more, and not judged in the end if the machine kept everybody waiting for as long as a
/// request is held.
fn discover_live(profiles: &[String]) -> Result<(), Missing> {
    const NAMES: [&str; MAX_AT_ONCE] =
        ["vcan-d0", "vcan-d1", "vcan-d2", "vcan-d3", "vcan-d4", "vcan-d5", "vcan-d6", "vcan-d7"];
    let interfaces: Vec<_> =
        profiles.iter().zip(NAMES).map(|(_, name)| Vcan::new(name)).collect::<Result<_, _>>()?;
    let mut left = profiles.to_vec();
    for attempt in 1..=ATTEMPTS {
        let sessions: Vec<_> = left
            .iter()
            .zip(&interfaces)
            .map(|(profile, interface)| {
                let (profile, interface) = (profile.clone(), interface.name);
                std::thread::spawn(move || discover(&profile, interface))
            })
            .collect();
        let outcomes: Vec<_> = sessions.into_iter().map(|session| session.join().unwrap()).collect();
        left.clear();
        for Outcome { profile, failure, beside, waited } in outcomes {
            let Some(failure) = failure else { continue };
            if attempt == ATTEMPTS {
                beside.assert_gap(format!("an action of the driver\n{failure}"), HOLD, HOLD / 4 + waited);
            }
            left.push(profile);
        }
    }
    if !left.is_empty() {
        println!("not judged, since the machine is too busy: {left:?}");
    }
    Ok(())
}

/// The shipped profiles that describe turn indicators.
fn shipped_profiles() -> Vec<String> {
    let list =
        Command::new(env!("CARGO_BIN_EXE_signal-gateway")).args(["profiles", "list"]).output().unwrap();
    let list = String::from_utf8(list.stdout).unwrap();
    let rows = list.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let with_turn = rows.filter(|row| row.get(1).is_some_and(|bound| bound.chars().nth(4) == Some('T')));
    let profiles: Vec<_> = with_turn.map(|row| row[0].to_owned()).collect();
    assert!(profiles.len() >= 47, "{profiles:?}");
    profiles
}

/// Nobody is asked for actions that cannot be seen.
#[test]
fn a_silent_bus_ends_the_session_before_the_first_request() {
    let vcan = require!(Vcan::new("vcan-d8"));
    let folder = tempfile::tempdir().unwrap();
    let mut discover = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    discover.current_dir(folder.path()).args(["discover", "--live", vcan.name, "--quiet-s", "1"]);
    let output = discover.stdin(Stdio::null()).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!(output.status.code(), Some(2), "{out}{error}");
    assert!(out.contains("HANDS OFF") && !out.contains("indicate LEFT"), "{out}");
    assert!(error.contains("not one frame was received"), "{error}");
}

#[test]
fn simulated_vehicles_are_discovered_live_and_their_actions_are_reported() {
    require!(discover_live(&PROFILES.map(str::to_owned)));
}

mod slow {
    use super::{MAX_AT_ONCE, discover_live, require, shipped_profiles};

    /// All of them are discovered in virtual time as well, without a bus: `pure::discovery`.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn some_shipped_vehicles_are_discovered_live_and_their_actions_are_reported() {
        let profiles = shipped_profiles();
        let some: Vec<_> = profiles.iter().step_by(profiles.len().div_ceil(MAX_AT_ONCE)).cloned().collect();
        require!(discover_live(&some));
    }

    mod exhaustive {
        use super::{MAX_AT_ONCE, discover_live, require, shipped_profiles};

        /// Number of tests that share the shipped profiles, so that each ends within minutes.
        const PARTS: usize = 6;

        fn discover_part(part: usize) {
            let profiles: Vec<_> = shipped_profiles().into_iter().skip(part).step_by(PARTS).collect();
            assert!(profiles.len() <= MAX_AT_ONCE, "{profiles:?}");
            require!(discover_live(&profiles));
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_1() {
            discover_part(0);
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_2() {
            discover_part(1);
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_3() {
            discover_part(2);
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_4() {
            discover_part(3);
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_5() {
            discover_part(4);
        }

        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn every_shipped_vehicle_is_discovered_live_6() {
            discover_part(5);
        }
    }
}
