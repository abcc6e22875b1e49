//! The mistakes of newcomers in `docs/evidence/mistakes.md`: each is made as it says there, prints what it
//! says there, and is gone when the message is followed. `UPDATE_DOCS=1 cargo test --test process mistakes`
//! renews what is printed.

use std::path::{Path, PathBuf};

use crate::support::cases;
use crate::support::files::MemoryFiles;
use crate::support::program::{self, Ran};

const GATEWAY: &str =
    "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n[diagnostics]\nperiod_ms = 250\n";

fn document() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/evidence/mistakes.md")
}

/// A profile with velocity and steering, and without commands.
const SEDAN: &str = r#"name = "Sedan"
[bus.body]
dbc = "sedan.dbc"
[message.MOTION]
timeout_ms = 200
[turn]
signal = "MOTION.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "not_fitted"
[velocity]
heading_rate_unknown = "zero"
[[velocity.source]]
name = "speedometer"
kind = "speed"
speed = { signal = "MOTION.SPEED", unit = "km/h", positive = "forward", valid = ["-2000..=20000"] }
[[velocity.heading_rate]]
kind = "yaw_rate"
yaw_rate = { signal = "MOTION.YAW", unit = "deg/s", positive = "left", valid = ["-9000..=9000"] }
[steering]
wheel = { signal = "MOTION.WHEEL", unit = "deg", positive = "left", valid = ["-7000..=7000"] }
"#;
const SEDAN_DBC: &str = r#"VERSION ""
BO_ 193 MOTION: 8 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] "" X
 SG_ SPEED : 16|16@1- (0.01,0) [0|0] "kph" X
 SG_ YAW : 32|16@1- (0.01,0) [0|0] "deg/sec" X
 SG_ WHEEL : 48|16@1- (0.1,0) [0|0] "degrees" X
"#;
const SEDAN_GATEWAY: &str = r#"profile = "sedan.toml"
[can.body]
interface = "can0"
[turn_signal]
map = "crossing"
"#;

/// A scenario of traffic lights in which one controller follows another.
const BENCH: &str = r#"stop_at_s = 20
[groups]
100 = [11]
200 = [21]
[[controller]]
name = "road"
phase = [
  { name = "go", duration_s = 4, states = { "100" = "green" } },
  { name = "stop", duration_s = 6, states = { "100" = "red" } },
]
[[controller]]
name = "crosswalk"
reference = "road"
delay_s = 4
phase = [{ name = "wait", duration_s = 10, states = { "200" = "red" } }]
[[event]]
at_s = 5
do = [{ clear = "11" }]
"#;

/// A sound configuration, a drive and a recording.
fn sound() -> MemoryFiles {
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| std::fs::read_to_string(project.join(path)).unwrap();
    let profile = read("config/vehicles/demo_vehicle.toml").replace("../../dbc/demo_vehicle.dbc", "demo.dbc");
    let drive = read("config/drives/crossing_left.toml");
    let (map, rest) = drive.split_once("\n[").unwrap();
    let map = map.lines().filter(|line| !line.starts_with("map")).collect::<Vec<_>>().join("\n");
    let drive = format!("map = \"crossing\"\ncountry = \"DE\"\n{map}\n[{rest}");
    let texts = [
        ("gateway.toml", GATEWAY.to_owned()),
        ("car.toml", profile),
        ("demo.dbc", read("dbc/demo_vehicle.dbc")),
        ("turn.toml", drive),
        ("sedan.toml", SEDAN.to_owned()),
        ("sedan.dbc", SEDAN_DBC.to_owned()),
        ("sedan_gateway.toml", SEDAN_GATEWAY.to_owned()),
        ("bench.toml", BENCH.to_owned()),
    ];
    MemoryFiles::new(texts).with("drive.log.gz", std::fs::read(project.join("config/demo.log.gz")).unwrap())
}

fn run(files: &MemoryFiles, command: &str) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    files.write_into(folder.path());
    program::run(&folder, &words(command))
}

/// The words of a command line, of which quoted ones may have blanks.
fn words(command: &str) -> Vec<&str> {
    let parts = command.split('"').enumerate();
    parts
        .flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().collect(),
            _ => vec![part],
        })
        .collect()
}

/// The document as cases, line by line: its headings, the blocks with changes of files, and those with
/// commands.
fn translated(document: &str) -> String {
    let mut block = "";
    let lines = document.lines().map(|line| {
        if let Some(language) = line.strip_prefix("```") {
            block = language;
            return "#\n".to_owned();
        }
        let file = line.strip_prefix("In `").and_then(|line| line.strip_suffix("`:"));
        match (block, line.strip_prefix("$ signal-gateway "), line.strip_prefix("## "), file) {
            ("diff", ..) => format!("{line}\n"),
            ("text", Some(command), ..) => format!("$ {command}\n"),
            ("text", ..) => format!("> {line}\n"),
            (_, _, Some(title), _) => format!("=== {title}\n"),
            (.., Some(file)) => format!("in {file}\n"),
            _ => "#\n".to_owned(),
        }
    });
    lines.collect()
}

#[test]
fn mistakes_are_answered_as_the_document_says() {
    cases::check_document(&document(), translated, &sound(), |case| {
        let Ran { code, error, .. } = run(&case.files, case.command);
        assert!((1..=3).contains(&code), "{}: {code}", case.command);
        error.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
    });
}

/// The commands of the document in the sound files, or those that it gives instead.
#[test]
fn mistakes_are_gone_when_the_message_is_followed() {
    let text = std::fs::read_to_string(document()).unwrap();
    let mistakes: Vec<_> = text.split("\n## ").skip(1).collect();
    assert_eq!(mistakes.len(), 65);
    for mistake in mistakes {
        let (_, right) = mistake.split_once("This works: `").unwrap_or(("", mistake));
        let (_, command) = right.split_once("signal-gateway ").unwrap();
        run(&sound(), command.split(['`', '\n']).next().unwrap()).succeeded();
    }
}
