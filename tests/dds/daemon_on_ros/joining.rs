//! Late joiners, and the end.

use serde_json::Value;

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::light_text::{self, nanos};
use crate::dds::daemon_on_ros::peer::{CAMERA, GROUND_TRUTH, V2I};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

/// Messages that are kept at least for late joiners.
const DEPTH: usize = 10;

/// V2I falls silent on request, so that nothing new can be taken for what was handed over.
#[test]
fn a_late_joiner_gets_the_current_state_of_a_silent_topic_and_then_what_follows() {
    let keys = "map = \"crossroads.osm\"\n[traffic_lights.inputs]\ncommand = \"/command\"\n";
    let bench = require!(Bench::new(keys));
    let early = bench.reader(&[V2I]);
    let mut gateway = bench.run();
    let commands = bench.writer(&[("text", "command")]);
    commands.send(0, "V2ITrafficSignalStateAction(34806, red)");
    early.wait_for_state(Mark::START, "v2i", "34806: red on circle; 120666: red on circle");
    let mut count = 0;
    early.wait(Mark::START, "v2i", "more than is kept", |_| {
        count += 1;
        (count > DEPTH).then_some(())
    });
    // The next message would be due in 100 s.
    commands.send(0, "V2ITrafficSignalStateAction(34802, green, 0.01)");
    commands.send(0, "TrafficSignalStateAction(34806, amber)");

    let late = bench.reader(&[V2I, CAMERA, GROUND_TRUTH]);
    late.wait_for_state(Mark::START, "camera", "34806: amber on circle; 120666: amber on circle");
    late.wait_for_state(Mark::START, "truth", "34802: amber on circle; 34836: amber on circle");
    let contents = |samples: Vec<Value>| samples.into_iter().map(|mut line| line["data"].take()).collect();
    let published: Vec<Value> = contents(early.samples(Mark::START, "v2i"));
    let newest = published.last().unwrap();
    late.wait(Mark::START, "v2i", "the newest", |data| (data == newest).then_some(()));
    let handed_over: Vec<Value> = contents(late.samples(Mark::START, "v2i"));
    // DDS tidies up now and then: more than the depth is handed over, and never less.
    println!("handed over: {} of {}", handed_over.len(), published.len());
    assert!(handed_over.len() >= DEPTH && published.ends_with(&handed_over), "{handed_over:?}");

    commands.send(0, "V2ITrafficSignalStateAction(34802, green, 20)");
    let next = late.wait(Mark::START, "v2i", "what follows", |data| {
        (nanos(data) > nanos(newest)).then(|| light_text::of(data))
    });
    assert_eq!(next, "34806: green on circle, red on circle; 120666: red on circle");
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
}
