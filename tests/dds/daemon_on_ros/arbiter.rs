//! The merged topic, when it is configured.

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::peer::ARBITER;
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

const RED: &str = "34806: red on circle";

#[test]
fn the_arbiter_believes_who_is_surer_group_by_group() {
    let keys = "map = \"crossroads.osm\"\n[traffic_lights.arbiter]\n[traffic_lights.inputs]\n\
                conventional_detected = \"/camera\"\nv2i = \"/v2i\"\n";
    let bench = require!(Bench::new(keys));
    let mut gateway = bench.run();
    let reader = bench.reader(&[ARBITER]);
    let qos = reader.matched("arbiter");
    assert!(qos.contains("Reliability.Reliable") && qos.contains("Durability.TransientLocal"), "{qos}");
    let others = bench.writer(&[("groups", "camera"), ("groups", "v2i")]);
    // Red from the camera, as sure as can be in half.
    others.send(0, "1 34806 1 1 2 0.5");
    let camera = "34806: red on circle 0.50; 120666: red on circle 0.50";
    reader.wait_for_state(Mark::START, "arbiter", camera);
    // Green over V2I, less sure: nothing changes but for the shape that the camera does not see.
    let mark = reader.mark();
    others.send(1, "1 34802 3 1 2 0.25, 34836 3 4 2 0.25");
    let arrow = "34806: red on circle 0.50, green on up 0.25; 120666: red on circle 0.50, green on up 0.25";
    reader.wait_for_state(mark, "arbiter", arrow);
    // Surer than the camera.
    let mark = reader.mark();
    others.send(1, "2 34802 3 1 2 0.75, 34836");
    reader.wait_for_state(mark, "arbiter", "34806: green on circle 0.75; 120666: red on circle 0.50");
    // Nothing from the camera any more, then nothing at all.
    let mark = reader.mark();
    others.send(0, "2 34806");
    others.send(1, "3 34806 1 1 2 1");
    reader.wait_for_state(mark, "arbiter", RED);
    gateway.stop("TERM");
}
