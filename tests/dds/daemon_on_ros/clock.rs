//! `/clock` from a simulator and to others, and the camera pipeline of others.

use std::collections::BTreeSet;

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::light_text::nanos;
use crate::dds::daemon_on_ros::peer::{ARBITER, CAMERA, CLOCK, DIAGNOSTICS, Reader, Writer};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

const SCENARIO: &str = "traffic_lights_scenario";
const SECOND: i64 = 1_000_000_000;
const GREEN: &str = "34806: green on circle; 120666: green on circle";
const STOP: &str = "34806: green on left, red on circle; 120666: green on left, red on circle";

/// Sends a time twice, a nanosecond apart: the clock is best effort.
fn set(clock: &Writer, topic: usize, ms: i64) {
    for nanos in [ms * 1_000_000, ms * 1_000_000 + 1] {
        clock.send(topic, &format!("{} {}", nanos / SECOND, nanos % SECOND));
    }
}

/// Waits for two messages of the diagnostics, a second of the gateway's own time.
fn a_second(reader: &Reader) {
    for _ in 0..2 {
        reader.status(reader.mark(), SCENARIO, "clock_restarts", |_, _| true);
    }
}

/// Waits until the clock has begun, for the first time or again.
fn begun(reader: &Reader, mark: Mark, restarts: &str) {
    reader.status(mark, SCENARIO, "clock_restarts", |count, level| count == restarts && level == 0);
}

/// The stamps after `mark`, nanoseconds.
fn stamps(reader: &Reader, mark: Mark, name: &str) -> Vec<i64> {
    reader.samples(mark, name).iter().map(|line| nanos(&line["data"])).collect()
}

#[test]
fn the_lights_follow_the_clock_of_a_peer_and_stand_still_with_it() {
    let bench = require!(Bench::new("scenario = \"crossing.xosc\"\nuse_sim_time = true\n"));
    let mut gateway = bench.run();
    let reader = bench.reader(&[CAMERA, DIAGNOSTICS]);
    let clock = bench.writer(&[("clock", "clock")]);
    let waiting =
        reader.status(Mark::START, SCENARIO, "clock_restarts", |count, level| count == "0" && level == 1);
    assert_eq!(waiting["message"], "waiting for /clock");
    a_second(&reader);
    assert!(stamps(&reader, Mark::START, "camera").is_empty(), "nothing is sent before the first time");

    // Its first time, and half a second more. Of times that wait only the newest counts, so one after the other.
    set(&clock, 0, 1_000_000);
    begun(&reader, Mark::START, "0");
    set(&clock, 0, 1_000_500);
    reader.wait_for_state(Mark::START, "camera", GREEN);
    a_second(&reader);
    let sent = stamps(&reader, Mark::START, "camera");
    assert!(sent.is_sorted() && sent.len() <= 16, "no more than half a second of frames: {sent:?}");
    assert!(sent.iter().all(|stamp| (1_000 * SECOND..=1_000_500_000_001).contains(stamp)), "{sent:?}");

    // 4.5 s after the beginning the third phase has begun, and the same frame is not sent again by other clocks.
    let mark = reader.mark();
    set(&clock, 0, 1_004_500);
    reader.wait_for_state(mark, "camera", STOP);
    a_second(&reader);
    assert!(stamps(&reader, mark, "camera").iter().all(|stamp| *stamp <= 1_004_500_000_001));

    // The simulator begins again, and so does the scenario.
    let mark = reader.mark();
    set(&clock, 0, 10_000);
    begun(&reader, mark, "1");
    set(&clock, 0, 10_100);
    reader.wait_for_state(mark, "camera", GREEN);
    assert!(stamps(&reader, mark, "camera").iter().all(|stamp| *stamp <= 10_100_000_001));

    // Without the clock time stands still, with a warning.
    let mark = reader.mark();
    let silent = reader.wait(mark, "diagnostics", "silence", |data| {
        let statuses = data["status"].as_array()?.iter();
        let messages = statuses.filter_map(|status| status["message"].as_str());
        messages.clone().find(|message| message.contains("/clock")).map(str::to_owned)
    });
    assert_eq!(silent, "/clock is no longer received");
    let late = stamps(&reader, mark, "camera");
    assert!(late.iter().all(|stamp| *stamp <= 10_100_000_001) && late.len() <= 4, "{late:?}");
    gateway.stop("TERM");
}

#[test]
fn a_peer_reads_the_clock_of_the_frames() {
    let keys = "scenario = \"crossing.xosc\"\n[traffic_lights.topics]\nclock = \"/clock\"\n";
    let bench = require!(Bench::new(keys));
    let reader = bench.reader(&[CLOCK, CAMERA]);
    let mut gateway = bench.run();
    let qos = reader.matched("clock");
    assert!(qos.contains("Reliability.Reliable") && qos.contains("Durability.TransientLocal"), "{qos}");
    reader.wait_for_state(Mark::START, "camera", STOP);
    let times: Vec<_> =
        reader.samples(Mark::START, "clock").iter().map(|line| nanos(&line["data"]["clock"])).collect();
    let distinct: BTreeSet<_> = times.iter().copied().collect();
    assert!(times.is_sorted() && distinct.len() == times.len(), "each frame once, in order: {times:?}");
    // 4 s of 30 Hz, of which a busy machine may leave out some.
    assert!(times.len() > 60, "{}", times.len());
    let frames = stamps(&reader, Mark::START, "camera");
    let shared = frames.iter().filter(|stamp| distinct.contains(stamp)).count();
    assert!(shared > 60, "the camera's messages bear these times: {shared} of {}", frames.len());
    gateway.stop("TERM");
}

#[test]
fn the_camera_of_a_peer_is_merged_and_not_repeated_when_it_stops() {
    const CLOCK_TOPIC: usize = 0;
    const CAMERA_TOPIC: usize = 1;
    const V2I_TOPIC: usize = 2;
    let keys = format!(
        "map = \"crossroads.osm\"\nuse_sim_time = true\n[traffic_lights.arbiter]\n[traffic_lights.topics]\n\
         camera = \"\"\n[traffic_lights.inputs]\ncamera = \"/{}\"\nv2i = \"/v2i\"\n",
        CAMERA.2
    );
    let bench = require!(Bench::new(&keys));
    let mut gateway = bench.run();
    let reader = bench.reader(&[ARBITER, DIAGNOSTICS]);
    let others = bench.writer(&[("clock", "clock"), ("groups", CAMERA.2), ("groups", "v2i")]);
    let red = "34806: red on circle 0.75";
    for begin_s in [100, 110] {
        set(&others, CLOCK_TOPIC, begin_s * 1_000);
        begun(&reader, reader.mark(), "0");
        let mark = reader.mark();
        others.send(CAMERA_TOPIC, &format!("{begin_s} 34806 1 1 2 0.75"));
        reader.wait_for_state(mark, "arbiter", red);
        // No second message: it counts for one second, and is removed with the next message of V2I.
        set(&others, CLOCK_TOPIC, begin_s * 1_000 + 900);
        let mark = reader.mark();
        set(&others, CLOCK_TOPIC, begin_s * 1_000 + 2_000);
        reader.wait_for_state(mark, "arbiter", "");
        let last_red = reader.samples(Mark::START, "arbiter").iter().rev().find_map(|line| {
            let has_groups =
                line["data"]["traffic_light_groups"].as_array().is_some_and(|all| !all.is_empty());
            has_groups.then(|| nanos(&line["data"]))
        });
        assert!(last_red.is_some_and(|stamp| stamp <= (begin_s + 1) * SECOND + 1), "{last_red:?}");
    }
    // Beside V2I, which is less sure: the camera's while it sends, V2I's afterwards.
    let green = "34806: green on circle 0.50; 120666: green on circle 0.50";
    others.send(V2I_TOPIC, "112 34806 3 1 2 0.5");
    let mark = reader.mark();
    set(&others, CLOCK_TOPIC, 112_200);
    reader.wait_for_state(mark, "arbiter", green);
    let mark = reader.mark();
    others.send(CAMERA_TOPIC, "112 34806 1 1 2 0.75");
    reader.wait_for_state(mark, "arbiter", "34806: red on circle 0.75; 120666: green on circle 0.50");
    let mark = reader.mark();
    set(&others, CLOCK_TOPIC, 114_000);
    reader.wait_for_state(mark, "arbiter", green);
    gateway.stop("TERM");
}
