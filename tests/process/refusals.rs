//! What a user is told of a command that cannot be carried out, and the exit code.

use std::fs::File;
use std::process::{Command, Output};

use crate::process::cli::{DEMO, file, refused};

#[test]
fn wrong_usage_is_2_a_refused_configuration_3_and_an_unreadable_recording_1() {
    refused(2, &["fly"]);
    refused(2, &["replay", "--speed", "fast"]);
    refused(2, &["check", "--config", DEMO, "--ros-args", "-r", "a:=b"]);
    let text = refused(2, &["run", "--ros-args", "-p", "volume:=1"]);
    assert!(text.contains("-p volume:=1: no such parameter; this node has config, profile"), "{text}");
    let looped = ["run", "--config", DEMO, "--ros-args", "--remap", "a:=b", "-e", "/car"];
    assert!(refused(2, &looped).contains("docs/security.md"));
    refused(2, &["replay", "config/demo.log.gz", "--config", DEMO, "--map", "can1=nosuch"]);
    let profile = refused(3, &["check", "--profile", "hyundai_ki"]);
    let expected = "error: hyundai_ki: there is no such file\n |\n = help: did you mean the built-in profile hyundai_kia?\n";
    assert_eq!(profile, expected);
    let missing = refused(3, &["run", "--config", "/nonexistent/gateway.toml"]);
    assert!(missing.contains("/nonexistent/gateway.toml: there is no such file"), "{missing}");
    let (folder, path) = file("bad.toml", "profile = \"x.toml\"\n[ros]\nnod = \"a\"\n");
    let text = refused(3, &["check", "--config", path.to_str().unwrap()]);
    assert!(
        text.contains("error: ros.nod: unknown key \"nod\"\n") && text.contains("bad.toml:3:1\n"),
        "{text}"
    );
    assert!(text.contains("3 | nod = \"a\"\n  | ^^^\n  |\n  = help: did you mean node?\n"), "{text}");
    drop(folder);
    let text = refused(1, &["replay", "/nonexistent/drive.log", "--config", DEMO]);
    assert!(text.contains("/nonexistent/drive.log"), "{text}");
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
    for (content, expected) in [
        (&b""[..], "drive.log: the file is empty"),
        (
            b"\x89PNG\r\n\x1A\n",
            "drive.log: this is a picture (PNG), not a recording of CAN frames\n |\n = help: these are read: candump",
        ),
        (b"PK\x03\x04", "this is a zip archive, not a recording"),
        (
            b"time,speed\n1,2\n",
            "it looks like text that begins with \"time,speed\"\n |\n = help: these are read, plain",
        ),
        (
            b"[bus.a]\n[turn]\n",
            "this is a vehicle profile, not a recording of CAN frames\n |\n = help: give it with --profile",
        ),
        (b"(1.0) can0 12\nx\n", "drive.log: not one frame was read"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.log");
        std::fs::write(&path, content).unwrap();
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
fn quiet_leaves_errors_and_findings_and_verbose_adds() {
    let text = |args: &[&str]| {
        let output = command(args).output().unwrap();
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (_folder, log) = file("odd.log", "(1.0) can0 2A5#0000000000000000\nnonsense\n");
    let args = ["decode", log.to_str().unwrap(), "--config", DEMO];
    let (_, said) = text(&args);
    assert_eq!(said, "warning: 1 line cannot be read; the first is line 2: the time is missing\n");
    assert_eq!(text(&[&args[..], &["--quiet"]].concat()).1, "");
    let (findings, _) = text(&["check", "--config", DEMO, "--quiet"]);
    assert!(findings.starts_with("warning  ") && !findings.contains("vehicle  "), "{findings}");
}

#[test]
fn a_missing_recording_is_reported_before_anything_else() {
    let (folder, log) = file("drive.log", "(1.0) can0 123#\n");
    let typed = folder.path().join("drvie.log");
    for command in ["check", "identify", "decode", "replay"] {
        let profile: &[&str] = if command == "identify" { &[] } else { &["--profile", "demo_vehicle"] };
        let text = refused(1, &[&[command, typed.to_str().unwrap()], profile].concat());
        let expected = "drvie.log: there is no such file\n |\n = help: did you mean ";
        assert!(text.contains(expected) && text.contains(log.to_str().unwrap()), "{command}: {text}");
        assert_eq!(text.lines().count(), 3, "{text}");
    }
}

#[test]
fn a_folder_and_a_cut_file_are_refused_with_what_to_do() {
    let (folder, _) = file("drive.log", "(1.0) can0 123#\n");
    let text = refused(3, &["check", folder.path().to_str().unwrap(), "--profile", "demo_vehicle"]);
    assert!(text.contains("this is a folder without a lanelet2_map.osm\n"), "{text}");
    let text = refused(1, &["identify", folder.path().to_str().unwrap()]);
    assert!(text.contains("this is a folder, not a recording") && text.contains("drive.log"), "{text}");
    let whole = std::fs::read("config/demo.log.gz").unwrap();
    let cut = folder.path().join("cut.log.gz");
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    let text = refused(1, &["identify", cut.to_str().unwrap()]);
    assert!(
        text.contains("it ends in the middle of its compressed data\n |\n = help: copy it again"),
        "{text}"
    );
}
