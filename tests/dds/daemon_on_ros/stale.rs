//! States of V2I that are not renewed, and those of a V2X unit on a CAN bus, which monitors them itself.

use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;

use crate::dds::daemon_on_ros::light_text::nanos;
use crate::dds::daemon_on_ros::peer::{CAMERA, DIAGNOSTICS, V2I};
use crate::dds::daemon_on_ros::{Bench, UNIT_GROUPS, folder, light_text};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;
use crate::support::waiting::wait_until;

const RED: &str = "34806: red on circle";
/// A camera sees the heads, which another group has too.
const BOTH_RED: &str = "34806: red on circle; 120666: red on circle";

#[test]
fn v2i_states_that_are_not_renewed_are_removed_and_others_stay() {
    let keys = "map = \"crossroads.osm\"\nv2i_timeout_ms = 1000\n[traffic_lights.inputs]\n\
                conventional = \"/truth\"\nv2i = \"/v2i\"\n";
    let bench = require!(Bench::new(keys));
    let mut gateway = bench.run();
    let reader = bench.reader(&[CAMERA, V2I, DIAGNOSTICS]);
    let others = bench.writer(&[("groups", "truth"), ("groups", "v2i")]);
    let is_fresh = |count: &str, level: u8| count == "0" && level == 0;
    let is_stale = |count: &str, level: u8| count == "1" && level == 1;
    others.send(0, "1 34806 1 1 2 1");
    for round in ["1", "2"] {
        let mark = reader.mark();
        // It is over before it is published if the machine stands still for that second.
        wait_until("red", || {
            others.send(1, &format!("{round} 34806 1 1 2 1"));
            reader.comes(mark, "v2i", |data| light_text::of(data) == RED)
        });
        reader.status(mark, "traffic_lights_v2i", "stale", is_fresh);
        let mark = reader.mark();
        reader.wait_for_state(mark, "v2i", "");
        let status = reader.status(mark, "traffic_lights_v2i", "stale", is_stale);
        assert_eq!(status["message"], "lights are no longer received");
        let mark = reader.mark();
        reader.wait_for_state(mark, "camera", BOTH_RED);
    }
    let states: Vec<_> =
        reader.samples(Mark::START, "v2i").iter().map(|line| light_text::of(&line["data"])).collect();
    let mut changes = states.clone();
    changes.dedup();
    assert_eq!(changes, ["", RED, "", RED, ""]);
    // 1 s of red at 10 Hz, each time. Of a machine that leaves messages out only the longest time counts.
    let times: Vec<_> = reader.samples(Mark::START, "v2i").iter().map(|line| nanos(&line["data"])).collect();
    let is_whole = times.windows(2).all(|pair| pair[1] - pair[0] < 150_000_000);
    let reds = |from: usize| states[from..].iter().take_while(|state| *state == RED).count();
    let begins = (1..states.len()).filter(|at| states[*at] == RED && states[at - 1] != RED);
    for first in begins {
        let count = reds(first);
        let lasted = times[first + count - 1] - times[first];
        assert!(lasted <= 1_100_000_000, "{lasted} ns");
        assert!((8..=11).contains(&count) || !is_whole, "{count}");
    }
    gateway.stop("TERM");
}

/// `V2X_NEXT` with red ahead; counter in byte 6, J1850's CRC in byte 7.
fn red_ahead(counter: u8) -> String {
    let mut data = [0x01, 0, 0, 0, 0, 0, counter % 16, 0];
    let crc = data[..7].iter().fold(0xFF_u8, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D })
    });
    data[7] = !crc;
    data.iter().map(|byte| format!("{byte:02X}")).collect()
}

#[test]
fn a_state_that_a_v2x_unit_keeps_sending_stays_and_is_removed_when_it_falls_silent() {
    let profile = concat!(env!("CARGO_MANIFEST_DIR"), "/config/vehicles/v2x_unit.toml");
    let folder = folder(&format!(
        "profile = \"{profile}\"\n[ros]\nenabled = false\n[can.v2x]\ninterface = \"can0\"\n\
         [traffic_lights]\nscenario = \"groups.toml\"\nv2i_timeout_ms = 1000\n"
    ));
    folder.write("groups.toml", UNIT_GROUPS);
    let mut log = String::new();
    for tenth in 0_u8..50 {
        let second = 1000.0 + f64::from(tenth) / 10.0;
        // The radio works all the time, the light is sent for 3 s.
        writeln!(log, "({second:.6}) can0 5A2#0100").unwrap();
        if tenth < 30 {
            writeln!(log, "({:.6}) can0 5A0#{}", second + 0.001, red_ahead(tenth)).unwrap();
        }
    }
    folder.write("drive.log", &log);
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(folder.path()).args(["replay", "drive.log", "--config", "gateway.toml", "--json"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut story: Vec<(String, f64)> = Vec::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        if line["topic"].as_str().unwrap().contains("external") {
            let state = light_text::of(&line["data"]);
            if story.last().is_none_or(|(last, _)| *last != state) {
                story.push((state, line["t"].as_f64().unwrap()));
            }
        }
    }
    let states: Vec<_> = story.iter().map(|(state, _)| state.as_str()).collect();
    assert_eq!(states.iter().rev().take(2).copied().collect::<Vec<_>>(), ["", RED], "{story:?}");
    assert!(states.len() <= 3 && states.iter().filter(|state| **state == RED).count() == 1, "{story:?}");
    // 5 x 100 ms of silence, and the next message.
    let gone = story.last().unwrap().1;
    assert!((3.4..3.6).contains(&gone), "{gone}");
}
