//! opendbc as an oracle: frames that its packer makes for each state, read by its car state and by our replay
//! of the profile. [`docs/evidence/opendbc.md`](../../../../docs/evidence/opendbc.md) has the table.

mod checksums;
mod commands;
mod status;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use can_signal::can::frame::{CanId, Frame};
use serde_json::{Map, Value, json};

use crate::pure::vehicles::playback::{Playback, play_text};
use crate::pure::vehicles::protection::protect;
use crate::pure::vehicles::{profile, project};
use crate::support::prerequisite::{opendbc_python, require};
use crate::support::vehicle_facts::{Counterpart, State, VEHICLES, VehicleFacts};

/// Each state lasts so long, and is read at its end, when all holds and observation times are over.
const STATE_MS: u64 = 3000;
const READ_MS: u64 = 800;
const PERIOD_MS: u64 = 50;
/// Half of a flash, of which there are 91 a minute.
const FLASH_MS: u64 = 330;
const TAP_MS: u64 = 300;

/// Why a report of ours differs from opendbc's car state.
const DIFFERENCES: [(&str, &str); 6] = [
    (
        "other variant",
        "The profile requires that a message does not come, and opendbc reads the sides from that message, with the other \
         side first. No recording proves either: the report stops.",
    ),
    (
        "reserved value",
        "opendbc compares with the values for left and right and takes any other for off. A value that is not defined, or \
         means \"not available\", is not off: the report stops.",
    ),
    (
        "both levers",
        "opendbc sets both blinkers, or the side that came last. No lever can be in both positions: the report stops.",
    ),
    (
        "tap held",
        "opendbc holds a side for two and a half to three seconds after the lever was touched, about as long as the lamps \
         flash then. The profile reports the lever as it is.",
    ),
    (
        "hazard elsewhere",
        "The profile reads the hazard lights from a signal that opendbc's car state does not read.",
    ),
    (
        "bank of lamps",
        "opendbc takes the lamps by the model of the car, the profile by the flag in the message.",
    ),
];

/// A profile and one of its counterparts.
struct Vehicle {
    profile: &'static str,
    facts: &'static VehicleFacts,
    counterpart: &'static Counterpart,
    states: &'static [State],
}

fn vehicles() -> Vec<Vehicle> {
    let of = |(profile, facts): (&'static String, &'static VehicleFacts)| {
        facts.opendbc.iter().map(move |counterpart| {
            let states = counterpart.states();
            Vehicle { profile, facts, counterpart, states }
        })
    };
    VEHICLES.iter().flat_map(of).collect()
}

/// File of opendbc, and platform.
fn file_and_platform(car: &str) -> (&str, Option<&str>) {
    car.split_once(' ').map_or((car, None), |(file, platform)| (file, Some(platform)))
}

/// Signals of one message.
type Values = Map<String, Value>;

/// The frames of all states, one after the other, as requests to the packer.
fn drive(vehicle: &Vehicle) -> Vec<Value> {
    let first = vehicle.counterpart.message.as_str();
    let mut messages = vec![first];
    for word in vehicle.states.iter().flat_map(|state| state.signals.split_whitespace()) {
        if let Some((message, _)) = word.split_once('.').filter(|(name, _)| !messages.contains(name)) {
            messages.push(message);
        }
    }
    let mut frames = Vec::new();
    for (state, start) in vehicle.states.iter().zip((0..).step_by(usize::try_from(STATE_MS).unwrap())) {
        for ms in (0..STATE_MS).step_by(usize::try_from(PERIOD_MS).unwrap()) {
            let is_over = state.name.starts_with("tap") && ms >= TAP_MS;
            let signals = if is_over { &vehicle.states[0].signals } else { &state.signals };
            let values = values_of(first, signals, (ms / FLASH_MS).is_multiple_of(2));
            for message in &messages {
                frames.push(json!([start + ms, message, values.get(message).cloned().unwrap_or_default()]));
            }
        }
    }
    frames
}

/// What is packed into each message; a lamp that flashes is 0 while it is dark.
fn values_of<'a>(first: &'a str, signals: &'a str, is_lit: bool) -> BTreeMap<&'a str, Values> {
    let mut values: BTreeMap<&str, Values> = BTreeMap::new();
    for word in signals.split_whitespace() {
        let (message, signal) = word.split_once('.').unwrap_or((first, word));
        let Some((name, value)) = signal.split_once(['=', '~']) else { continue };
        let value = if signal.contains('~') && !is_lit { 0 } else { value.parse::<u64>().unwrap() };
        values.entry(message).or_default().insert(name.to_owned(), value.into());
    }
    values
}

/// What opendbc says of each request.
fn ask(python: &Path, requests: &[Value]) -> Vec<Value> {
    let file = tempfile::NamedTempFile::new().unwrap();
    let lines = requests.iter().fold(String::new(), |text, request| text + &request.to_string() + "\n");
    std::fs::write(file.path(), lines).unwrap();
    let script = project().join("tests/peer/opendbc_lights.py");
    let mut command = Command::new(python);
    let output = command.arg(script).arg(file.path()).stderr(Stdio::piped()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answers = String::from_utf8(output.stdout).unwrap();
    answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The packed frames as a candump log, with the counters and checksums that opendbc does not know.
fn log(vehicle: &Vehicle, answer: &Value) -> String {
    let mut sent: BTreeMap<CanId, u8> = BTreeMap::new();
    let mut text = String::new();
    for frame in answer["frames"].as_array().unwrap() {
        let number = u32::try_from(frame[1].as_u64().unwrap()).unwrap();
        // opendbc writes the identifiers of some 29-bit messages without the bit that says so.
        let is_extended = number > 0x7FF;
        let id = if is_extended { CanId::extended(number & 0x1FFF_FFFF) } else { CanId::standard(number) };
        let digits = frame[2].as_str().unwrap();
        let bytes = (0..digits.len() / 2).map(|at| u8::from_str_radix(&digits[at * 2..][..2], 16).unwrap());
        let bytes: Vec<_> = bytes.collect();
        let id = id.unwrap();
        let packed = if bytes.len() > 8 { Frame::fd(id, &bytes) } else { Frame::classic(id, &bytes) };
        let packed = packed.unwrap();
        let count = sent.entry(packed.id()).or_insert(0);
        let is_whole = vehicle.counterpart.packs_protection;
        let frame_sent = if is_whole { packed } else { protect(vehicle.facts, &packed, *count) };
        *count = count.wrapping_add(1);
        let ms = frame[0].as_u64().unwrap();
        writeln!(text, "({}.{:03}000) can0 {frame_sent}", 1_700_000_000 + ms / 1000, ms % 1000).unwrap();
    }
    text
}

/// The part of a state in which it is read, ms.
fn window(state: &str, index: usize) -> std::ops::Range<u64> {
    let start = u64::try_from(index).unwrap() * STATE_MS;
    let end = start + STATE_MS;
    if state.starts_with("tap") { start + 1000..start + 1400 } else { end - READ_MS..end }
}

/// The blinkers of opendbc's car state.
fn theirs(answer: &Value, window: std::ops::Range<u64>) -> &'static str {
    let blinkers = answer["blinkers"].as_array().unwrap();
    let range = usize::try_from(window.start / 10).unwrap()..usize::try_from(window.end / 10).unwrap();
    let read: BTreeSet<_> =
        blinkers[range].iter().map(|both| [&both[0], &both[1]].map(|b| b == true)).collect();
    match Vec::from_iter(read)[..] {
        [[false, false]] => "off",
        [[true, false]] => "left",
        [[false, true]] => "right",
        [[true, true]] => "both",
        _ => "changes",
    }
}

/// Our reports.
fn ours(playback: &Playback, window: &std::ops::Range<u64>) -> &'static str {
    let steady = |changes: &[(u64, &'static str)]| {
        if changes.iter().any(|(ms, _)| window.contains(ms)) {
            return "changes";
        }
        let before = changes.iter().rev().find(|(ms, _)| *ms < window.start);
        before.map_or("stops", |(_, state)| state)
    };
    match (steady(&playback.turn), steady(&playback.hazard)) {
        ("DISABLE", "DISABLE" | "stops") => "off",
        ("ENABLE_LEFT", "DISABLE" | "stops") => "left",
        ("ENABLE_RIGHT", "DISABLE" | "stops") => "right",
        ("DISABLE", "ENABLE") => "hazard",
        ("stops", "ENABLE") => "hazard alone",
        ("stops", "DISABLE" | "stops") => "none",
        _ => "changes",
    }
}

/// A state as both read it; `None` where opendbc has no car state to read it with.
struct Row {
    profile: &'static str,
    state: &'static str,
    theirs: Option<&'static str>,
    ours: &'static str,
    difference: Option<&'static str>,
}

impl Row {
    /// Whether the readings are the same; without a car state, whether ours is what was packed.
    fn agrees(&self) -> bool {
        let packed = self.state.split(" after").next().unwrap();
        match self.theirs {
            Some(theirs) => self.ours == theirs || (theirs, self.ours) == ("both", "hazard"),
            None => self.ours == packed || !["off", "left", "right", "hazard"].contains(&packed),
        }
    }
}

fn rows(vehicle: &Vehicle, answers: &[(&str, Value)]) -> Vec<Row> {
    let logs: BTreeSet<_> = answers.iter().map(|(_, answer)| log(vehicle, answer)).collect();
    assert_eq!(logs.len(), 1, "{}: its cars pack the same states differently", vehicle.profile);
    let playback = play_text(profile(vehicle.profile), logs.first().unwrap(), "can0");
    let mut rows = Vec::new();
    for (index, State { name: state, difference, .. }) in vehicle.states.iter().enumerate() {
        let window = window(state, index);
        let read = answers.iter().filter(|(car, _)| file_and_platform(car).1.is_some());
        let theirs: BTreeSet<_> = read.map(|(_, answer)| theirs(answer, window.clone())).collect();
        assert!(theirs.len() <= 1, "{} {state}: its cars read it differently: {theirs:?}", vehicle.profile);
        rows.push(Row {
            profile: vehicle.profile,
            state,
            theirs: theirs.first().copied(),
            ours: ours(&playback, &window),
            difference: difference.as_deref(),
        });
    }
    rows
}

const HEAD: &str = "\
<!-- Made by `UPDATE_DOCS=1 tests/run opendbc` from tests/vehicles. -->

# The profiles against opendbc

For anyone who wants a second opinion on a shipped profile. The tables tell you where opendbc reads the same states, and why it
differs elsewhere.

opendbc is the Python package with which openpilot reads cars; `tests/run` pins its version. For every shipped profile with
a counterpart there, a test packs the frames of each state with its `CANPacker`, gives them to its `CarState` and to our
replay of the profile, and compares `leftBlinker` and `rightBlinker` with our reports.

- Each state lasts for 3 s and is read in its last 0.8 s, after the holds of opendbc (0.4 to 0.5 s from a lit lamp, 2.5
  to 3 s from the touch of a lever) and our observation of lamps; \"tap\" is a lever held for 0.3 s and read
  after 1 s. Lamps flash with 0.33 s lit and 0.33 s dark. Messages come every 50 ms, on all buses of opendbc.
- The car state comes from the platform's `CarInterface`, without fingerprints and without other messages, called
  every 10 ms. Where opendbc has a DBC file and no car (a file without a platform below), its part is the packer.
- \"both\" of opendbc is our \"hazard\"; \"none\" is a withheld report. opendbc packs counters and checksums, or the test
  where it has no rule, and we check them.

## States

| profile | file of opendbc, and its platform | counter and checksum | read alike | read differently: opendbc / ours |
|---|---|---|---|---|
";

fn document(rows: &[Vec<Row>]) -> String {
    let mut text = HEAD.to_owned();
    for (vehicle, rows) in vehicles().iter().zip(rows) {
        let cars = vehicle.counterpart.cars.iter().map(|car| match file_and_platform(car) {
            (file, Some(platform)) => format!("`{file}` {platform}"),
            (file, None) => format!("`{file}`"),
        });
        let cars = cars.collect::<Vec<_>>().join("<br>");
        let protection = match (is_protected(vehicle), vehicle.counterpart.packs_protection) {
            (false, _) => "–",
            (true, true) => "opendbc",
            (true, false) => "the test",
        };
        let is_alike = |row: &&Row| row.agrees() && (row.theirs.is_some() || row.ours != "none");
        let (alike, others): (Vec<_>, Vec<_>) = rows.iter().partition(is_alike);
        let alike: Vec<_> = alike.iter().map(|row| row.state).collect();
        let others = others.iter().map(|row| {
            let difference = row.difference.map_or(String::new(), |name| format!(" ({name})"));
            format!("{}: {} / {}{difference}", row.state, row.theirs.unwrap_or("–"), row.ours)
        });
        let (alike, others) = (alike.join("; "), others.collect::<Vec<_>>().join("<br>"));
        writeln!(text, "| {} | {cars} | {protection} | {alike} | {others} |", vehicle.profile).unwrap();
    }
    text += "\n## Differences\n\n";
    for (name, reason) in DIFFERENCES {
        writeln!(text, "- **{name}**: {reason}").unwrap();
    }
    text + &status::section()
}

/// Whether the profile checks counters or checksums.
fn is_protected(vehicle: &Vehicle) -> bool {
    profile(vehicle.profile).gateway.lights.table.messages.iter().any(|message| message.integrity.is_some())
}

#[test]
fn reports_are_what_the_car_states_of_opendbc_read() {
    let python = require!(opendbc_python());
    let (vehicles, mut requests) = (vehicles(), Vec::new());
    for vehicle in &vehicles {
        let (length_ms, frames) = (vehicle.states.len() as u64 * STATE_MS, drive(vehicle));
        for (dbc, platform) in vehicle.counterpart.cars.iter().map(|car| file_and_platform(car)) {
            let request =
                json!({ "dbc": dbc, "platform": platform, "length_ms": length_ms, "frames": frames });
            requests.push(request);
        }
    }
    let answers = ask(&python, &requests);
    assert_eq!(answers.len(), requests.len());
    let (mut answers, mut all) = (answers.into_iter(), Vec::new());
    for vehicle in &vehicles {
        let cars = vehicle.counterpart.cars.iter().map(String::as_str);
        all.push(rows(vehicle, &cars.zip(answers.by_ref()).collect::<Vec<_>>()));
    }
    let wrong = all.iter().flatten().filter(|row| row.agrees() == row.difference.is_some());
    let wrong: Vec<_> = wrong
        .map(|row| {
            let known = row.difference.unwrap_or("no difference is known");
            format!("{} {}: opendbc {:?}, ours {}: {known}", row.profile, row.state, row.theirs, row.ours)
        })
        .collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));

    let (text, path) = (document(&all), project().join("docs/evidence/opendbc.md"));
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == text,
        "docs/evidence/opendbc.md is not what was read: run `UPDATE_DOCS=1 tests/run opendbc`"
    );
}

#[test]
fn every_difference_has_its_reason() {
    for vehicle in vehicles() {
        for state in vehicle.states {
            let is_known = |name: &String| DIFFERENCES.iter().any(|(known, _)| known == name);
            assert!(state.difference.iter().all(is_known), "{} {state:?}", vehicle.profile);
        }
    }
}
