//! `/clock` from a simulator and to others, and the camera pipeline of others.

use std::collections::BTreeSet;
use std::time::Duration;

use serde_json::Value;

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::light_text::{self, nanos};
use crate::dds::daemon_on_ros::peer::{ARBITER, CAMERA, CLOCK, DIAGNOSTICS, Reader, Writer, status_in};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;
use crate::support::waiting::{Bystander, Pace, wait_until};

const SCENARIO: &str = "traffic_lights_scenario";
const SECOND: i64 = 1_000_000_000;
/// Between two messages of a clock.
const BEAT: Duration = Duration::from_millis(100);
const GREEN: &str = "34806: green on circle; 120666: green on circle";
const STOP: &str = "34806: green on left, red on circle; 120666: green on left, red on circle";

/// Sends a time twice, a nanosecond apart.
fn set(clock: &Writer, topic: usize, ms: i64) {
    for nanos in [ms * 1_000_000, ms * 1_000_000 + 1] {
        clock.send(topic, &format!("{} {}", nanos / SECOND, nanos % SECOND));
    }
}

/// Sends a time until it has its effect: a clock is best effort, so that a message of it may be lost, and is
/// sent all the time.
fn set_until(clock: &Writer, topic: usize, ms: i64, what: &str, has_effect: impl Fn() -> bool) {
    let mut pace = Pace::every(BEAT);
    wait_until(what, || {
        set(clock, topic, ms);
        pace.wait();
        has_effect()
    });
}

/// Sends a time until lights on a topic have been published in a state since then.
fn set_until_state(reader: &Reader, (clock, topic): (&Writer, usize), ms: i64, name: &str, state: &str) {
    let mark = reader.mark();
    set_until(clock, topic, ms, state, || reader.has(mark, name, |data| light_text::of(data) == state));
}

/// Waits for two messages of the diagnostics, a second of the gateway's own time.
fn a_second(reader: &Reader) {
    for _ in 0..2 {
        reader.status(reader.mark(), SCENARIO, "clock_restarts", |_, _| true);
    }
}

/// Sends a time until the clock has begun with it, for the first time or again.
fn begin(reader: &Reader, clock: &Writer, ms: i64, restarts: &str) {
    let mark = reader.mark();
    let has_begun = |data: &Value| {
        status_in(data, SCENARIO, "clock_restarts", |count, level| count == restarts && level == 0).is_some()
    };
    set_until(clock, 0, ms, "the beginning", || reader.has(mark, "diagnostics", has_begun));
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

    // Its first time, and half a second more. Of times that wait only the newest counts, so one after the
    // other.
    begin(&reader, &clock, 1_000_000, "0");
    set_until(&clock, 0, 1_000_500, GREEN, || {
        reader.has(Mark::START, "camera", |data| light_text::of(data) == GREEN)
    });
    a_second(&reader);
    let sent = stamps(&reader, Mark::START, "camera");
    assert!(sent.is_sorted() && sent.len() <= 16, "no more than half a second of frames: {sent:?}");
    assert!(sent.iter().all(|stamp| (1_000 * SECOND..=1_000_500_000_001).contains(stamp)), "{sent:?}");

    // 4.5 s after the beginning the third phase has begun, and the same frame is not sent again by other
    // clocks.
    let mark = reader.mark();
    set_until_state(&reader, (&clock, 0), 1_004_500, "camera", STOP);
    a_second(&reader);
    assert!(stamps(&reader, mark, "camera").iter().all(|stamp| *stamp <= 1_004_500_000_001));

    // The simulator begins again, and so does the scenario.
    let mark = reader.mark();
    begin(&reader, &clock, 10_000, "1");
    set_until(&clock, 0, 10_100, GREEN, || reader.has(mark, "camera", |data| light_text::of(data) == GREEN));
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
    let beside = Bystander::start();
    let mut gateway = bench.run();
    let qos = reader.matched("clock");
    assert!(qos.contains("Reliability.Reliable") && qos.contains("Durability.TransientLocal"), "{qos}");
    reader.wait_for_state(Mark::START, "camera", STOP);
    let times: Vec<_> =
        reader.samples(Mark::START, "clock").iter().map(|line| nanos(&line["data"]["clock"])).collect();
    let distinct: BTreeSet<_> = times.iter().copied().collect();
    assert!(times.is_sorted() && distinct.len() == times.len(), "each frame once, in order: {times:?}");
    // 4 s of 30 Hz, of which a busy machine leaves out some.
    let mut gaps: Vec<_> = times.windows(2).map(|pair| (pair[1] - pair[0]).unsigned_abs()).collect();
    gaps.sort_unstable();
    let median = Duration::from_nanos(gaps[gaps.len() / 2]);
    beside.finish().assert_gap("the median of 30 Hz", median, Duration::from_millis(34));
    let frames = stamps(&reader, Mark::START, "camera");
    let shared = frames.iter().filter(|stamp| distinct.contains(stamp)).count();
    println!("{} times, {} frames, {shared} of them at these times", times.len(), frames.len());
    assert!(
        2 * shared > frames.len(),
        "the camera's messages bear these times: {shared} of {}",
        frames.len()
    );
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
    let clock = (&others, CLOCK_TOPIC);
    for begin_s in [100, 110] {
        begin(&reader, &others, begin_s * 1_000, "0");
        a_second(&reader);
        let mark = reader.mark();
        others.send(CAMERA_TOPIC, &format!("{begin_s} 34806 1 1 2 0.75"));
        reader.wait_for_state(mark, "arbiter", red);
        // No second message: it counts for one second, and is removed with the next message of V2I.
        set(&others, CLOCK_TOPIC, begin_s * 1_000 + 900);
        set_until_state(&reader, clock, begin_s * 1_000 + 2_000, "arbiter", "");
        let last_red = reader.samples(Mark::START, "arbiter").iter().rev().find_map(|line| {
            let has_groups =
                line["data"]["traffic_light_groups"].as_array().is_some_and(|all| !all.is_empty());
            has_groups.then(|| nanos(&line["data"]))
        });
        assert!(last_red.is_some_and(|stamp| stamp <= (begin_s + 1) * SECOND + 1), "{last_red:?}");
    }
    // Beside V2I, which is less sure: the camera's while it sends, V2I's afterwards. V2I comes by another way
    // than the clock, which goes on until it is there.
    let green = "34806: green on circle 0.50";
    others.send(V2I_TOPIC, "112 34806 3 1 2 0.5");
    let (mut pace, mut ms) = (Pace::every(BEAT), 112_200);
    wait_until("V2I's green", || {
        set(&others, CLOCK_TOPIC, ms);
        ms += 50;
        pace.wait();
        reader.has(Mark::START, "arbiter", |data| light_text::of(data) == green)
    });
    let mark = reader.mark();
    let next_s = ms / 1_000 + 1;
    others.send(CAMERA_TOPIC, &format!("{next_s} 34806 1 1 2 0.75"));
    reader.wait_for_state(mark, "arbiter", "34806: red on circle 0.75");
    set_until_state(&reader, clock, (next_s + 2) * 1_000, "arbiter", green);
    gateway.stop("TERM");
}
