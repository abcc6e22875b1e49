//! Notes on parts of a scenario or a profile that have no effect.

use std::process::Command;

use crate::dds::daemon_on_ros::{UNIT_GROUPS, folder};
use crate::support::process::{Folder, Process};

/// The notes, each with its location.
const NOT_INTERPRETED: [&str; 3] = [
    "crossing.xosc:30:3: OpenSCENARIO/Entities: not interpreted: once, 3 elements",
    "crossing.xosc:38:9: OpenSCENARIO/Storyboard/Init/Actions/Private: not interpreted: once, 5 elements",
    "crossing.xosc:52:11: OpenSCENARIO/Storyboard/Story/Act/ManeuverGroup/Actors: not interpreted: once, 1 element",
];

const OFF: &str = "[ros]\nenabled = false\n";

fn checked(folder: &Folder) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    let output =
        command.arg("check").arg("--config").arg(folder.path().join("gateway.toml")).output().unwrap();
    assert!(output.status.success(), "notes are not warnings");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn parts_of_a_scenario_that_are_not_interpreted_are_named_by_check_and_at_the_start_of_run() {
    let folder = folder(&format!("{OFF}[traffic_lights]\nscenario = \"crossing.xosc\"\n"));
    let text = checked(&folder);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("traffic_lights_scenario: running");
    gateway.stop("TERM");
    let log = gateway.log();
    for part in NOT_INTERPRETED {
        assert_eq!(
            text.lines().filter(|line| line.starts_with("note ") && line.ends_with(part)).count(),
            1,
            "{text}"
        );
        assert_eq!(
            log.iter().filter(|line| line.contains("WARN") && line.ends_with(part)).count(),
            1,
            "{log:?}"
        );
    }
    assert_eq!(text.matches("note ").count(), NOT_INTERPRETED.len(), "{text}");
}

/// The log limits messages about one subject, and each note is a subject of its own.
#[test]
fn no_note_hides_another_however_many_there_are() {
    let keys = "[traffic_lights]\nscenario = \"crossing.xosc\"\nmap = \"crossroads.osm\"\n";
    let folder = folder(&format!("{OFF}{keys}"));
    folder.write("crossing.xosc", include_str!("../../pure/scenario_refusals/crossing.xosc"));
    let text = checked(&folder);
    let notes: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("note ")).map(str::trim).collect();
    assert!(notes.len() > 15, "{text}");
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("traffic_lights_scenario: running");
    gateway.stop("TERM");
    let log = gateway.log();
    for note in notes {
        assert_eq!(log.iter().filter(|line| line.ends_with(note)).count(), 1, "{note}: {log:?}");
    }
}

#[test]
fn a_profile_with_states_of_v2i_and_without_traffic_lights_is_noted() {
    let profile = concat!(env!("CARGO_MANIFEST_DIR"), "/config/vehicles/v2x_unit.toml");
    let config = format!("profile = \"{profile}\"\n{OFF}[can.v2x]\ninterface = \"no-such-can\"\n");
    let alone = folder(&config);
    let note = "v2i: received states are not used, and no map checks their ids; add [traffic_lights] to the configuration";
    assert!(checked(&alone).contains(&format!("note       {note}\n")));
    let mut gateway = Process::run(&alone);
    gateway.wait_for_log("no-such-can is missing");
    assert_eq!(gateway.log().iter().filter(|line| line.ends_with(note)).count(), 1);
    gateway.stop("TERM");
    let with_groups = folder(&format!("{config}[traffic_lights]\nscenario = \"groups.toml\"\n"));
    with_groups.write("groups.toml", UNIT_GROUPS);
    assert!(!checked(&with_groups).contains("note "));
}
