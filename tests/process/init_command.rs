//! `init` with answers through a pipe and on a terminal: what it writes is accepted by `check`.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

use crate::support::program::{Ran, program, run};
use crate::support::terminal::OnTerminal;

/// Answers through a pipe, one a line.
fn answered(folder: &Path, args: &[&str], answers: &[&str]) -> Ran {
    let mut command = program(folder, &[&["init"], args].concat());
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let lines: String = answers.iter().map(|answer| format!("{answer}\n")).collect();
    // It may end before it has read all.
    drop(input.write_all(lines.as_bytes()));
    drop(input);
    child.wait_with_output().unwrap().into()
}

fn folder_with_recording() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    fs::copy(demo, folder.path().join("drive.log.gz")).unwrap();
    folder
}

/// The configuration names this profile and interface, and `check` accepts it.
fn assert_sound(folder: &Path, profile: &str, interface: &str) {
    let written = fs::read_to_string(folder.join("gateway.toml")).unwrap();
    assert!(written.contains(&format!("\nprofile = \"{profile}\"\n")), "{written}");
    assert!(written.contains(&format!("\ninterface = \"{interface}\" ")), "{written}");
    run(folder, &["check", "--config", "gateway.toml"]).succeeded();
}

#[test]
fn a_vehicle_is_identified_by_a_recording_and_wrong_answers_are_asked_again() {
    let folder = folder_with_recording();
    let answers = ["can 7", "can7", "hyundai_ki", "identify", "drvie.log.gz", "drive.log.gz", "1"];
    let answered = answered(folder.path(), &[], &answers);
    for part in [
        "\"can 7\" is not an interface name",
        "did you mean the built-in profile hyundai_kia?",
        "did you mean drive.log.gz?",
        "fits      demo_vehicle (Demo vehicle)",
        "  1         demo_vehicle, Demo vehicle\n",
        "Vehicle [demo_vehicle]: ",
        "next: signal-gateway check --config gateway.toml",
    ] {
        answered.assert(0, part);
    }
    assert_sound(folder.path(), "demo_vehicle", "can7");
}

#[test]
fn a_question_is_asked_three_times_at_most_and_nothing_is_written_then() {
    let folder = folder_with_recording();
    let output = answered(folder.path(), &["-i", "can7"], &["x", "y", "z", "hyundai_kia"]);
    output.assert(3, "");
    assert_eq!(output.text().matches("Vehicle [identify]: ").count(), 3);
    let ended = answered(folder.path(), &["-i", "can7"], &["list"]);
    ended.assert(2, "\nhyundai_kia ");
    ended.assert(2, "there is no answer on standard input: give --profile");
    assert!(!folder.path().join("gateway.toml").exists());
}

#[test]
fn a_file_is_overwritten_only_after_yes() {
    let folder = folder_with_recording();
    let path = folder.path().join("gateway.toml");
    let args = ["-i", "can7", "-p", "hyundai_kia"];
    for answers in [&["no"][..], &[""], &["perhaps", "maybe", "later"], &[]] {
        fs::write(&path, "mine").unwrap();
        answered(folder.path(), &args, answers).assert(2, "");
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine", "{answers:?}");
    }
    answered(folder.path(), &args, &["yes"]).succeeded();
    assert_sound(folder.path(), "hyundai_kia", "can7");
}

#[test]
fn a_profile_file_is_named_relative_to_the_configuration() {
    let folder = tempfile::tempdir().unwrap();
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let profile = fs::read_to_string(project.join("config/vehicles/demo_vehicle.toml")).unwrap();
    fs::write(folder.path().join("car.toml"), profile.replace("../../dbc/", "")).unwrap();
    fs::copy(project.join("dbc/demo_vehicle.dbc"), folder.path().join("demo_vehicle.dbc")).unwrap();
    answered(folder.path(), &["-i", "can7", "-p", "./car.toml"], &[]).succeeded();
    assert_sound(folder.path(), "car.toml", "can7");
}

#[test]
fn unattended_identification_takes_the_profile_that_fits() {
    let folder = folder_with_recording();
    answered(folder.path(), &["-i", "can7", "-p", "identify"], &["drive.log.gz"]).succeeded();
    assert_sound(folder.path(), "demo_vehicle", "can7");
}

#[test]
fn a_car_with_the_profile_of_another_car_is_refused_before_anything_is_written() {
    let folder = folder_with_recording();
    let args = ["-i", "can7", "--car", "Kia Optima 2019", "--profile"];
    let refused = answered(folder.path(), &[&args[..], &["vw_mqb"]].concat(), &[]);
    refused.assert(2, "--profile vw_mqb is not a profile of the Kia Optima 2019: give hyundai_kia");
    assert!(!folder.path().join("gateway.toml").exists());
    let nowhere = ["-i", "can7", "-p", "hyundai_kia", "-o", "nowhere/gateway.toml"];
    answered(folder.path(), &nowhere, &[]).assert(1, "there is no such folder");
}

#[test]
fn on_a_terminal_enter_takes_what_is_proposed() {
    let folder = folder_with_recording();
    let mut init = program(folder.path(), &["init", "-i", "can7", "-p", "identify"]);
    let mut terminal = OnTerminal::start(&mut init);
    terminal.type_in("drive.log.gz\n\n");
    let (code, shown) = terminal.end();
    assert_eq!(code, Some(0), "{shown}");
    assert_sound(folder.path(), "demo_vehicle", "can7");
}

#[test]
fn a_car_brings_its_profile_and_its_listed_dimensions_as_comments() {
    let folder = folder_with_recording();
    let path = folder.path().join("gateway.toml");
    answered(folder.path(), &["-i", "can7", "--car", "toyota rav4 2018"], &[]).succeeded();
    assert_sound(folder.path(), "toyota_nodsu", "can7");
    let written = fs::read_to_string(&path).unwrap();
    for part in
        ["opendbc's list for toyota rav4 2018", "\n# wheel_base_m = 2.65 ", "\n# steering_ratio = 16.88 "]
    {
        assert!(written.contains(part), "{part}: {written}");
    }
    let question = "[no]: ";
    answered(folder.path(), &["-i", "can7", "--car", "toyota rav4 2018", "--force"], &["perhaps", "yes"])
        .assert(0, question);
    let written = fs::read_to_string(&path).unwrap();
    assert!(written.contains("\n[vehicle_geometry]\ncar = \"Toyota RAV4 2017–2018\" "), "{written}");
    assert_sound(folder.path(), "toyota_nodsu", "can7");
    answered(folder.path(), &["-i", "can7", "-p", "toyota_nodsu", "--force"], &[]).succeeded();
    let written = fs::read_to_string(&path).unwrap();
    assert!(written.contains("the models of toyota_nodsu") && written.contains("13 to 18.6"), "{written}");
    let refused = answered(folder.path(), &["-i", "can7", "--car", "Audi A4 2018", "--force"], &[]);
    refused.assert(2, "no profile reads the Audi A4 2018");
}
