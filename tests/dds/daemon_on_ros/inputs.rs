//! Inputs of others over ROS 2 while it runs.

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::peer::{CAMERA, DIAGNOSTICS, GROUND_TRUTH, V2I};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

const INPUTS: &str = "map = \"crossroads.osm\"\n[traffic_lights.inputs]\nconventional = \"/truth\"\n\
    conventional_detected = \"/camera\"\nv2i = \"/v2i\"\nv2i_detected = \"/v2i_received\"\ncommand = \"/command\"\n";
const TRUTH: usize = 0;
const DETECTED: usize = 1;
const SENT: usize = 2;
const RECEIVED: usize = 3;
const COMMAND: usize = 4;
const TOPICS: [(&str, &str); 5] = [
    ("groups", "truth"),
    ("groups", "camera"),
    ("groups", "v2i"),
    ("groups", "v2i_received"),
    ("text", "command"),
];

#[test]
fn states_and_commands_go_to_their_stores_and_bad_ones_are_counted() {
    let bench = require!(Bench::new(INPUTS));
    let mut gateway = bench.run();
    let reader = bench.reader(&[GROUND_TRUTH, CAMERA, V2I, DIAGNOSTICS]);
    let others = bench.writer(&TOPICS);
    let expect = |name: &str, state: &str| reader.wait_for_state(Mark::START, name, state);

    // A group is its heads; a head can be named itself.
    others.send(TRUTH, "1 34806 1 1 2 1, 34844 4 10 3 1");
    expect("truth", "34802: red on circle; 34836: red on circle; 34844: white flashing cross");
    expect("camera", "34806: red on circle; 120666: red on circle");
    others.send(DETECTED, "1 34802 0 1 0 0.5");
    expect("camera", "34806: red on circle, unknown unknown circle 0.50; 120666: red on circle");
    reader.status(Mark::START, "traffic_lights_conventional", "detected", |count, _| count == "1");
    others.send(SENT, "1 34806 3 1 2 0.75");
    // A movement is one group, whatever heads it shares.
    expect("v2i", "34806: green on circle 0.75");
    others.send(RECEIVED, "1 34836 2 2 2 1");
    let received = "34806: green on circle 0.75, amber on left; 120666: amber on left";
    expect("v2i", received);
    reader.status(Mark::START, "traffic_lights_v2i", "detected", |count, _| count == "1");

    // In one message: a colour that there is not, an unknown light, a confidence beyond 1; and something
    // good before, between and after.
    let mark = reader.mark();
    others.send(
        TRUTH,
        "2 34802 1 4 2 1, 34802 9 1 2 1, 999 1 1 2 1, 34836 2 1 2 1, 34844 1 1 2 1.5, 34844 3 1 2 1",
    );
    expect("truth", "34802: red on up; 34836: amber on circle; 34844: green on circle");
    let status = reader
        .status(mark, "traffic_lights_conventional", "rejected", |count, level| count == "3" && level == 1);
    assert_eq!(status["message"], "an input for 999 was rejected");
    reader.status(mark, "traffic_lights_v2i", "rejected", |count, level| count == "0" && level == 0);

    // Commands: nonsense, a phase of an unknown controller, an unknown light, then good ones.
    let mark = reader.mark();
    for command in [
        "fly()",
        "TrafficSignalControllerAction(crossing, go)",
        "TrafficSignalStateAction(999, red)",
        "TrafficSignalStateAction(\"34802 conventional\", \"pink\")",
    ] {
        others.send(COMMAND, command);
    }
    others.send(COMMAND, "TrafficSignalStateAction(\"34836 v2i_detected\", \"white, yellow flashing down\")");
    expect(
        "v2i",
        "34806: green on circle 0.75, amber flashing down, white on circle; \
         120666: amber flashing down, white on circle",
    );
    reader.status(mark, "traffic_lights_scenario", "refused_commands", |count, _| count == "4");
    let mark = reader.mark();
    others.send(COMMAND, "ClearTrafficSignal(\"34836 v2i_detected\")");
    reader.wait_for_state(mark, "v2i", "34806: green on circle 0.75");
    others.send(RECEIVED, "2 34806 2 2 2 1");
    expect("v2i", "34806: amber on left");

    // A group without elements: its state is removed.
    let forgotten = |task| {
        reader.status(reader.mark(), task, "detected", |count, _| count == "0");
        reader.mark()
    };
    others.send(DETECTED, "2 34806");
    let mark = forgotten("traffic_lights_conventional");
    reader.wait_for_state(mark, "camera", "34806: amber on circle, red on up; 120666: amber on circle");
    others.send(RECEIVED, "3 34806");
    let mark = forgotten("traffic_lights_v2i");
    reader.wait_for_state(mark, "v2i", "34806: green on circle 0.75");
    let mark = reader.mark();
    others.send(SENT, "2 34806");
    reader.wait_for_state(mark, "v2i", "");
    gateway.stop("TERM");
    let complaints: Vec<_> =
        gateway.log().into_iter().filter(|line| line.contains("a command was refused")).collect();
    assert_eq!(complaints.len(), 3, "{complaints:?}");
    assert!(complaints[0].contains("fly") && complaints[2].contains("pink"), "{complaints:?}");
}

#[test]
fn bytes_that_are_not_a_message_do_no_harm() {
    let bench = require!(Bench::new(INPUTS));
    let mut gateway = bench.run();
    let reader = bench.reader(&[CAMERA]);
    let others = bench.writer(&TOPICS);
    others.send(TRUTH, "1 34806 1 1 2 1");
    let red = "34806: red on circle; 120666: red on circle";
    reader.wait_for_state(Mark::START, "camera", red);
    let garbage = bench.writer(&[("no_groups", "truth"), ("no_text", "command")]);
    for length in ["0", "1", "7", "100", "70000"] {
        garbage.send(0, length);
        garbage.send(1, length);
    }
    others.send(COMMAND, "TrafficSignalStateAction(34802, green)");
    reader.wait_for_state(
        Mark::START,
        "camera",
        "34806: green on circle, red on circle; 120666: red on circle",
    );
    let states: std::collections::BTreeSet<_> = reader
        .samples(Mark::START, "camera")
        .iter()
        .map(|line| crate::dds::daemon_on_ros::light_text::of(&line["data"]))
        .collect();
    assert_eq!(states.len(), 3, "nothing, red, and green as well: {states:?}");
    assert!(gateway.is_running());
    gateway.stop("TERM");
}
