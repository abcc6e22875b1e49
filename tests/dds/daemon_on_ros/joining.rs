//! Late joiners, and the end.

use serde_json::Value;

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::light_text::{self, nanos};
use crate::dds::daemon_on_ros::peer::{CAMERA, GROUND_TRUTH, Reader, V2I};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;
use crate::support::waiting::wait_for;

/// Messages that a writer keeps for late joiners.
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
    let contents = |reader: &Reader| -> Vec<Value> {
        let samples = reader.samples(Mark::START, "v2i").into_iter();
        samples.map(|mut line| line["data"].take()).collect()
    };
    // DDS tidies up now and then, so that more than the depth may be handed over. A reader that comes later
    // than a second after the first message meets a new writer, which has nothing but the current one.
    let newest = wait_for("the newest messages at both readers", || {
        let [published, handed_over] = [&early, &late].map(contents);
        println!("handed over: {} of {}", handed_over.len(), published.len());
        let is_newest = published.ends_with(&handed_over);
        handed_over.last().filter(|_| is_newest).map(nanos)
    });

    commands.send(0, "V2ITrafficSignalStateAction(34802, green, 20)");
    let next = late.wait(Mark::START, "v2i", "what follows", |data| {
        (nanos(data) > newest).then(|| light_text::of(data))
    });
    assert_eq!(next, "34806: green on circle, red on circle; 120666: red on circle");
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
}
