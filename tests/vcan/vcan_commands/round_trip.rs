//! A drive with all flows on a real interface and over DDS, recorded by the gateway, and replayed: the same
//! messages, to the byte.

use std::process::Command;

use super::closed_loop::{CROSSING, drive_by_script, folder, simulation, vehicle};
use crate::support::bag::{assert_same, messages};
use crate::support::mcap::only_entry;
use crate::support::peer::{Cyclone, Writing, domain};
use crate::support::prerequisite::require;
use crate::support::process::Process;
use crate::support::vcan::Vcan;

const FURTHER: &str = "[vehicle_geometry]\nwheel_base_m = 2.79\nwheel_tread_m = 1.63\nwheel_radius_m = 0.33\n\
    steering_ratio = 16.0\n[traffic_lights]\nmap = \"crossroads.osm\"\nscenario = \"crossing.xosc\"\n\
    [traffic_lights.topics]\nmarkers = \"/traffic_light/marker\"\n\
    [traffic_lights.inputs]\nv2i = \"/v2i\"\ncommand = \"/light_command\"\n";

/// Topics of each flow, that something must be on.
const FLOWS: [&str; 17] = [
    "/diagnostics",
    "/pacmod/from_can_bus",
    "/pacmod/to_can_bus",
    "/vehicle/status/turn_indicators_status",
    "/vehicle/status/velocity_status",
    "/vehicle/status/steering_status",
    "/vehicle/status/gear_status",
    "/planning/turn_indicators_cmd",
    "/planning/hazard_lights_cmd",
    "/simulation/traffic_lights",
    "/perception/traffic_light_recognition/internal/traffic_signals",
    "/traffic_light/marker",
    "/v2i",
    "/light_command",
    "/localization/kinematic_state",
    "/vehicle/status/control_mode",
    "/signal_gateway/calls",
];

#[test]
fn a_recorded_drive_is_replayed_to_the_byte_on_every_topic() {
    let cyclone = require!(Cyclone::on_loopback());
    let vcan = require!(Vcan::new("vcan-round"));
    let (simulation, domain) = (simulation(CROSSING), domain());
    let folder = folder(&vcan, domain, &simulation);
    folder.append("gateway.toml", FURTHER);
    folder.write("crossroads.osm", include_str!("../../maps/crossroads.osm"));
    folder.write("crossing.xosc", include_str!("../../dds/daemon_on_ros/crossing.xosc"));
    let mut vehicle = vehicle(&folder);
    let mut gateway = Process::run_with(&folder, |command| _ = command.args(["--record", "bags"]));
    gateway.wait_for_log("turn_indicators: publishing");
    let (reliability, durability) = ("reliable", "volatile");
    let written = [("groups", "rt/v2i"), ("text", "rt/light_command")].map(|(kind, topic)| Writing {
        kind,
        topic,
        reliability,
        durability,
    });
    let lights = cyclone.writer(domain, &written);
    lights.send("0 1 34806 3 1 2 0.75");
    lights.send("1 TrafficSignalStateAction(\"34802 v2i\", \"white\")");
    drive_by_script(&cyclone, domain, &simulation, &folder);
    lights.send("0 2 34806");
    gateway.signal("HUP");
    gateway.wait_for_log("configuration reloaded");
    vcan.bring_down();
    gateway.wait_for_log("is down");
    vcan.bring_up();
    gateway.wait_for_log("turn_indicators: publishing");
    gateway.stop("TERM");
    vehicle.stop("TERM");

    let bag = only_entry(&folder.path().join("bags"));
    let replayed = folder.path().join("replayed.mcap");
    let output = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .current_dir(folder.path())
        .args(["replay", "--config", "gateway.toml", "--json", "--mcap", "replayed.mcap"])
        .arg(&bag)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("departs"), "{said}");
    let file = bag.join(format!("{}_0.mcap", bag.file_name().unwrap().to_str().unwrap()));
    let counts = assert_same(&messages(&file), &messages(&replayed));
    println!("the same {counts:?}");
    for topic in FLOWS {
        assert!(counts.get(topic).is_some_and(|count| *count > 0), "{topic}: {counts:?}");
    }
}
