//! The mistakes of newcomers in `docs/mistakes.md`: each is made as it says there, prints what it says there, and is gone when
//! the message is followed. `UPDATE_DOCS=1 cargo test --test process mistakes` writes the file.

use std::path::Path;
use std::process::{Command, Output};

/// A text of a file with another one in its place.
type Edit = (&'static str, &'static str, &'static str);

/// A mistake, and its repair by the message alone.
struct Mistake {
    title: &'static str,
    /// What is wrong in the files of a sound configuration.
    edits: &'static [Edit],
    command: &'static str,
    /// The command that works with the same files; empty when the files are repaired instead.
    repaired: &'static str,
}

const fn in_file(title: &'static str, edits: &'static [Edit], command: &'static str) -> Mistake {
    Mistake { title, edits, command, repaired: "" }
}

const fn in_command(title: &'static str, command: &'static str, repaired: &'static str) -> Mistake {
    Mistake { title, edits: &[], command, repaired }
}

const CHECK: &str = "check --config gateway.toml";
const CAR: &str = "check --profile car.toml";
const TURN: &str = "decide turn.toml";

const MISTAKES: [Mistake; 38] = [
    in_file("A key mistyped", &[("car.toml", "left = [1]", "lefft = [1]")], CAR),
    in_file("Quotes forgotten", &[("car.toml", "\"demo.dbc\"", "demo.dbc")], CAR),
    in_file("A quote not closed", &[("car.toml", "\"demo.dbc\"", "\"demo.dbc")], CAR),
    in_file("A table twice", &[("car.toml", "[hazard]", "[turn]")], CAR),
    in_file("A number in the place of a table", &[("car.toml", "[bus.body]\n", "bus = 1\n[body]\n")], CAR),
    in_file("A number in the place of a list", &[("car.toml", "left = [1]", "left = 1")], CAR),
    in_file("A raw value with two meanings", &[("car.toml", "left = [1]", "left = [2]")], CAR),
    in_file(
        "A signal that the DBC does not have",
        &[("car.toml", "TurnIndicatorState\"", "TurnIndicatorStat\"")],
        CAR,
    ),
    in_file("A message that the DBC does not have", &[("car.toml", "\"BCM_Hazard.", "\"BCM_Hazrad.")], CAR),
    in_file("A DBC that is not there", &[("car.toml", "demo.dbc", "dbc/demo.dbc")], CAR),
    in_file(
        "A line of a DBC without its colon",
        &[("demo.dbc", " SG_ TurnIndicatorState :", " SG_ TurnIndicatorState ")],
        CAR,
    ),
    in_file("The wrong name of a bus", &[("gateway.toml", "[can.body]", "[can.bdy]")], CHECK),
    in_file("The wrong name of an interface", &[("gateway.toml", "\"can0\"", "\"can 0\"")], CHECK),
    in_file("The wrong unit", &[("gateway.toml", "period_ms = 250", "period_s = 0.25")], CHECK),
    in_file("A unit behind the number", &[("gateway.toml", "= 250", "= \"250 ms\"")], CHECK),
    in_file("A number in quotes", &[("gateway.toml", "= 250", "= \"250\"")], CHECK),
    in_file(
        "A truth value in quotes",
        &[("gateway.toml", "[diagnostics]", "[ros]\nenabled = \"true\"\n[diagnostics]")],
        CHECK,
    ),
    in_file(
        "A truth value with a capital letter",
        &[("gateway.toml", "[diagnostics]", "[ros]\nenabled = True\n[diagnostics]")],
        CHECK,
    ),
    in_file("A colon in the place of the equals sign", &[("gateway.toml", "profile =", "profile:")], CHECK),
    in_file(
        "An interface in the place of a table",
        &[("gateway.toml", "[can.body]\ninterface =", "[can]\nbody =")],
        CHECK,
    ),
    in_file("A number for an interface", &[("gateway.toml", "\"can0\"", "0")], CHECK),
    in_file("A message without a period", &[("demo.dbc", "BA_ \"GenMsgCycleTime\" BO_ 677 50;", "")], CAR),
    in_file("A profile that is not there", &[("gateway.toml", "car.toml", "cars.toml")], CHECK),
    in_file("An unknown country", &[("turn.toml", "\"DE\"", "\"DEU\"")], TURN),
    in_file("An unknown map", &[("turn.toml", "\"crossing\"", "\"crosing\"")], TURN),
    in_command("The name of a configuration mistyped", "check --config gatway.toml", CHECK),
    in_command("A configuration in the place of a recording", "check gateway.toml", CHECK),
    in_command("A profile in the place of a recording", "check car.toml", CAR),
    in_command("The name of a profile mistyped", "check --profile hyundai_ki", "check --profile hyundai_kia"),
    in_command("A DBC in the place of a profile", "check --profile demo.dbc", CAR),
    in_command("A profile in the place of a configuration", "check --config car.toml", CAR),
    in_command(
        "A recording in the place of a map",
        "lights bench --map drive.log.gz",
        "identify drive.log.gz",
    ),
    in_command("The name of a recording mistyped", "identify drvie.log.gz", "identify drive.log.gz"),
    in_command("A folder in the place of a recording", "identify .", "identify ./drive.log.gz"),
    in_command("An unknown command", "chek drive.log.gz", CAR),
    in_command("An option mistyped", "check --profle car.toml", CAR),
    in_command(
        "Interface and bus exchanged",
        "replay drive.log.gz --profile car.toml --map body=can0",
        "replay drive.log.gz --profile car.toml --map can0=body",
    ),
    in_command(
        "A bus that the profile does not have",
        "replay drive.log.gz --profile car.toml --map can0=bdy",
        "replay drive.log.gz --profile car.toml --map can0=body",
    ),
];

const GATEWAY: &str =
    "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n[diagnostics]\nperiod_ms = 250\n";

/// A folder with a sound configuration, with these edits in it.
fn folder(edits: &[Edit]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
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
    ];
    for (name, mut text) in texts {
        for (_, old, new) in edits.iter().filter(|(file, ..)| *file == name) {
            assert!(text.contains(old), "{name} has no {old:?}");
            text = text.replacen(old, new, 1);
        }
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    std::fs::copy(project.join("config/demo.log.gz"), folder.path().join("drive.log.gz")).unwrap();
    folder
}

fn run(folder: &Path, command: &str) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    program.current_dir(folder).env_remove("RUST_LOG").env("COLUMNS", "100").args(command.split(' '));
    program.output().unwrap()
}

fn section(mistake: &Mistake) -> String {
    let folder = folder(mistake.edits);
    let output = run(folder.path(), mistake.command);
    let code = output.status.code().unwrap();
    assert!((1..=3).contains(&code), "{}: {code}", mistake.title);
    let text = String::from_utf8(output.stderr).unwrap();
    let text: Vec<_> = text.lines().map(str::trim_end).collect();
    let edits: String = mistake
        .edits
        .iter()
        .map(|(file, old, new)| format!("In `{file}`, `{}` instead of `{}`.\n\n", line(new), line(old)))
        .collect();
    format!(
        "## {}\n\n{edits}```text\n$ signal-gateway {}\n{}\n```\n\n",
        mistake.title,
        mistake.command,
        text.join("\n")
    )
}

/// The first line of a text.
fn line(text: &str) -> &str {
    text.trim().lines().next().unwrap_or_default()
}

const HEAD: &str = "\
# Mistakes, and what the program says

Each of these was made in a folder with a configuration that works, `gateway.toml`, `car.toml`, `demo.dbc`, a drive
`turn.toml`, and a recording `drive.log.gz`. Each message names the place and what to type instead; a test makes every
mistake again, compares what is printed, and follows the message.

<!-- Made by `UPDATE_DOCS=1 cargo test --test process mistakes` -->

";

#[test]
fn mistakes_are_answered_as_the_document_says() {
    let written = HEAD.to_owned() + &MISTAKES.iter().map(section).collect::<String>();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/mistakes.md");
    let written = written.trim_end().to_owned() + "\n";
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &written).unwrap();
    }
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(written == text, "renew docs/mistakes.md: UPDATE_DOCS=1 cargo test --test process mistakes");
}

#[test]
fn mistakes_are_gone_when_the_message_is_followed() {
    for mistake in &MISTAKES {
        let (folder, command) = if mistake.repaired.is_empty() {
            (folder(&[]), mistake.command)
        } else {
            (folder(mistake.edits), mistake.repaired)
        };
        let output = run(folder.path(), command);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {command}: {text}", mistake.title);
    }
}
