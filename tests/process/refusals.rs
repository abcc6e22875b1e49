//! What a user is told of a command that cannot be carried out, and the exit code. Most are cases in
//! `tests/cases/command`.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::process::cli::{DEMO, file, refused};
use crate::support::cases::{self, Case};
use crate::support::files::MemoryFiles;
use crate::support::{status_vehicle, two_lanes};

/// What a command prints on standard output and standard error, and its exit code, in a folder with the files
/// of the case and the project's `config`. No file is changed.
fn answer(case: &Case) -> String {
    let folder = tempfile::tempdir().unwrap();
    symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join("config"), folder.path().join("config")).unwrap();
    case.files.write_into(folder.path());
    let arguments: Vec<_> = case.command.split(' ').collect();
    let output = command(&arguments).current_dir(folder.path()).env("COLUMNS", "100").output().unwrap();
    for (name, contents) in case.files.iter() {
        assert!(
            fs::read(folder.path().join(name)).unwrap() == contents,
            "{}: {}",
            case.command,
            name.display()
        );
    }
    let [out, err] = [output.stdout, output.stderr].map(|text| {
        let text = String::from_utf8(text).unwrap();
        text.lines().map(|line| line.trim_end().to_owned() + "\n").collect::<String>()
    });
    let code = output.status.code().unwrap();
    match (out.is_empty(), err.is_empty()) {
        (true, _) => format!("{err}exit code {code}"),
        (false, true) => format!("{out}exit code {code}, nothing on standard error"),
        (false, false) => format!("{out}on standard error:\n{err}exit code {code}"),
    }
}

#[test]
fn commands_print_what_the_cases_say() {
    cases::check("command", &MemoryFiles::default(), answer);
}

#[test]
fn drives_print_what_the_cases_say() {
    let road = MemoryFiles::new([("map.osm", two_lanes::osm([0, 100, 116, 216]))]);
    cases::check("decide", &road, answer);
}

#[test]
fn status_of_a_vehicle_is_printed_as_the_cases_say() {
    let bench = MemoryFiles::new([
        ("bench.toml", status_vehicle::PROFILE),
        ("bench.dbc", status_vehicle::DBC),
        ("drive.log", &status_vehicle::drive()),
    ]);
    cases::check("vehicle_status", &bench, answer);
}

#[test]
fn advice_for_many_problems_is_given_once() {
    let keys: String = (0..30).map(|key| format!("x{key} = 1\n")).collect();
    let (_folder, path) = file("many.toml", &keys);
    let args = ["check", "--config", path.to_str().unwrap()];
    let text = refused(3, &args);
    assert_eq!(text.matches("unknown key").count(), 9, "{text}");
    assert_eq!(text.matches("valid keys: ").count(), 1, "{text}");
    assert!(text.ends_with("error: and 21 more\n |\n = help: --verbose shows all of them\n"), "{text}");
    let all = refused(3, &[&args[..], &["--verbose"]].concat());
    assert_eq!(all.matches("unknown key").count(), 30, "{all}");
}

#[test]
fn a_recording_without_a_frame_or_of_another_kind_ends_with_1() {
    #[rustfmt::skip]
    let cases = [
        (&b""[..], "drive.log: the file is empty"),
        (b"\x89PNG\r\n\x1A\n",
            "drive.log: this is a picture (PNG), not a recording of CAN frames\n |\n = help: these are read: candump"),
        (b"PK\x03\x04", "this is a zip archive, not a recording"),
        (b"time,speed\n1,2\n",
            "it looks like text that begins with \"time,speed\"\n |\n = help: these are read, plain"),
        (b"[bus.a]\n[turn]\n",
            "this is a vehicle profile, not a recording of CAN frames\n |\n = help: give it with --profile"),
        (b"(1.0) can0 12\nx\n", "drive.log: not one frame was read"),
    ];
    for (content, expected) in cases {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.log");
        fs::write(&path, content).unwrap();
        for command in
            [&["decode"][..], &["replay"], &["replay", "--json"], &["replay", "--speed", "100"], &["check"]]
        {
            let args = [command, &[path.to_str().unwrap(), "--config", DEMO]].concat();
            let text = refused(1, &args);
            assert!(text.contains(expected), "{args:?}: {text}");
        }
    }
}

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(args);
    command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").env_remove("RUST_LOG");
    command
}

/// The output of a command with a file as its standard input.
fn with_input(args: &[&str], input: &str) -> Output {
    command(args).stdin(File::open(input).unwrap()).output().unwrap()
}

#[test]
fn every_kind_of_file_can_come_from_standard_input() {
    for (args, input) in [
        (&["check", "--config", "-"][..], "config/gateway.toml"),
        (&["profiles", "list"], "config/gateway.toml"),
        (&["lights", "-"], "config/scenarios/bench.toml"),
        (&["lights", "-", "--without-map"], "config/scenarios/bench.xosc"),
        (&["identify", "-"], "config/demo.log.gz"),
        (&["decode", "-", "--profile", "demo_vehicle", "--changes"], "config/demo.log.gz"),
    ] {
        let output = with_input(args, input);
        let refusal = String::from_utf8_lossy(&output.stderr);
        // Paths in a configuration are relative to its folder, which is that of the process here.
        let is_relative = args == ["check", "--config", "-"] && refusal.contains("standard input:");
        assert!(is_relative || !output.stdout.is_empty(), "{args:?}: {refusal}");
    }
    let refused = with_input(&["check", "--config", "-"], "config/vehicles/demo_vehicle.toml");
    let text = String::from_utf8(refused.stderr).unwrap();
    assert!(
        text.starts_with(
            "error: this is a vehicle profile, not a gateway configuration\n --> standard input:1:1\n"
        ),
        "{text}"
    );
    let twice = with_input(&["decode", "-", "--profile", "-"], "config/vehicles/pacmod.toml");
    assert!(!twice.status.success());
}

#[test]
fn quiet_results_have_no_lines_for_people_and_still_have_json() {
    for args in [
        &["replay", "--config", DEMO][..],
        &["replay", "--config", DEMO, "--speed", "1000"],
        &["decide", "config/drives/crossing_left.toml"],
        &["lights", "config/scenarios/bench.toml"],
    ] {
        let printed = |more: &[&str]| {
            let output = command(&[args, more].concat()).output().unwrap();
            assert!(output.status.success(), "{args:?}");
            output.stdout
        };
        assert_eq!(String::from_utf8(printed(&["--quiet"])).unwrap(), "", "{args:?}");
        assert!(printed(&["--quiet", "--json"]).starts_with(b"{"), "{args:?}");
    }
}

#[test]
fn colours_are_for_those_who_want_them() {
    let colored = |args: &[&str], environment: &[(&str, &str)]| {
        let output = command(args).envs(environment.iter().copied()).output().unwrap();
        [output.stdout, output.stderr].map(|text| text.contains(&0x1B))
    };
    let refused = ["check", "--profile", "nosuch"];
    let checked = ["check", "--config", DEMO];
    for args in [&refused[..], &checked, &["fly"]] {
        assert_eq!(colored(args, &[]), [false; 2], "{args:?}: a pipe");
        let always = [args, &["--color", "always"]].concat();
        assert_ne!(colored(&always, &[("NO_COLOR", "1")]), [false; 2], "{args:?}: the option wins");
        assert_ne!(colored(args, &[("CLICOLOR_FORCE", "1")]), [false; 2], "{args:?}");
        let never = [args, &["--color=never"]].concat();
        assert_eq!(colored(&never, &[("CLICOLOR_FORCE", "1")]), [false; 2], "{args:?}");
        assert_eq!(colored(args, &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), [false; 2], "{args:?}");
    }
}

#[test]
fn a_cut_file_gives_what_it_holds_and_one_without_a_frame_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read("config/demo.log.gz").unwrap();
    let cut = folder.path().join("cut.log.gz");
    let name = cut.to_str().unwrap();
    fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    for command in [&["identify", name][..], &["replay", name, "--profile", "demo_vehicle"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_signal-gateway")).args(command).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        let warning = format!("the recording breaks off at byte {} (", whole.len() / 2);
        assert!(output.status.success() && text.contains(&warning), "{command:?}: {text}");
    }
    fs::write(&cut, &whole[..40]).unwrap();
    let text = refused(1, &["identify", name]);
    assert!(text.contains("it breaks off before its first frame\n |\n = help: copy it again"), "{text}");
}

#[test]
fn a_profile_in_a_file_needs_its_dbc_beside_it() {
    let show = |output: Stdio| {
        let shown = command(&["profiles", "show", "hyundai_kia"]).stdout(output).output().unwrap();
        String::from_utf8(shown.stderr).unwrap()
    };
    let text = show(tempfile::tempfile().unwrap().into());
    assert!(text.contains("signal-gateway profiles show hyundai_kia --dbc"), "{text}");
    assert_eq!(show(Stdio::piped()), "");
}
