//! A scenario on its way out: names, types, quality of service, contents, rates.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::{Value, json};

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::light_text::{self, nanos};
use crate::dds::daemon_on_ros::peer::{
    CAMERA, DIAGNOSTICS, ENDPOINTS, GROUND_TRUTH, LEGACY, MARKERS, ROSOUT, Reader, V2I,
};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

const SECOND: i64 = 1_000_000_000;
/// Frames that a busy machine may leave out.
const SLACK_NS: i64 = 250_000_000;
/// Share of the samples that a busy machine may leave out; half the rate would leave out half.
const MAY_BE_MISSING: f64 = 0.4;
const GROUPS: &str = "autoware_perception_msgs::msg::dds_::TrafficLightGroupArray_";
const SIGNALS: &str = "autoware_perception_msgs::msg::dds_::TrafficSignalArray_";

/// Topics and types of all writers, but those of ROS itself.
fn types(reader: &Reader) -> BTreeMap<String, String> {
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let samples = reader.samples(Mark::START, ENDPOINTS.1);
    let written = samples.iter().map(|line| (text(&line["data"]["topic"]), text(&line["data"]["type"])));
    written.filter_map(|(topic, kind)| Some((topic.strip_prefix("rt/")?.to_owned(), kind))).collect()
}

fn expected_types(lights: &[(&str, &str)]) -> BTreeMap<String, String> {
    let diagnostics = (DIAGNOSTICS.2, "diagnostic_msgs::msg::dds_::DiagnosticArray_");
    let log = (ROSOUT.2, "rcl_interfaces::msg::dds_::Log_");
    let parameters = ("parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_");
    lights
        .iter()
        .chain([&diagnostics, &log, &parameters])
        .map(|(topic, kind)| ((*topic).to_owned(), (*kind).to_owned()))
        .collect()
}

/// The states that were published one after the other, each with its first stamp.
fn story(samples: &[Value]) -> Vec<(String, i64)> {
    let mut story: Vec<(String, i64)> = Vec::new();
    for data in samples.iter().map(|line| &line["data"]) {
        let state = light_text::of(data);
        if story.last().is_none_or(|(last, _)| *last != state) {
            story.push((state, if data["stamp"].is_object() { nanos(data) } else { 0 }));
        }
    }
    story
}

fn states(story: &[(String, i64)]) -> Vec<&str> {
    story.iter().map(|(state, _)| state.as_str()).collect()
}

/// Samples a second by when they were sent, of samples with these numbers: the slope of a line through
/// all of them.
fn rate(samples: &[Value], numbers: &[f64]) -> f64 {
    let nanos = |line: &Value| line["sent"].as_i64().unwrap();
    let first = nanos(&samples[0]);
    let seconds = |line: &Value| Duration::from_nanos((nanos(line) - first).unsigned_abs()).as_secs_f64();
    let points: Vec<_> = samples.iter().map(seconds).zip(numbers.iter().copied()).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| {
        points.iter().map(of).sum::<f64>() / f64::from(u32::try_from(points.len()).unwrap())
    };
    let (at, number) = (mean(|point| point.0), mean(|point| point.1));
    let both: f64 = points.iter().map(|point| (point.0 - at) * (point.1 - number)).sum();
    both / points.iter().map(|point| (point.0 - at).powi(2)).sum::<f64>()
}

fn assert_rate(what: &str, hz: f64, expected_hz: f64, tolerance: f64) {
    println!("{what}: {hz:.3} Hz");
    assert!((hz / expected_hz - 1.0).abs() < tolerance, "{what}: {hz} Hz");
}

/// From the stamp of one sample to that of the next, nanoseconds.
fn gap(pair: &[Value]) -> i64 {
    nanos(&pair[1]["data"]) - nanos(&pair[0]["data"])
}

/// Distance of a time from a whole number of periods, nanoseconds.
fn off(ns: i64, period_ns: i64) -> i64 {
    ((ns + period_ns / 2).rem_euclid(period_ns) - period_ns / 2).abs()
}

/// Stamps are whole periods apart, and not too many are missing; gives the number of each sample.
fn numbers(what: &str, samples: &[Value], period_ns: i64) -> Vec<f64> {
    for pair in samples.windows(2) {
        // Each stamp is rounded to nanoseconds.
        assert!(gap(pair) > 0 && off(gap(pair), period_ns) <= 1_000, "{what}: {} ns", gap(pair));
    }
    let number = |line: &Value| (gap(&[samples[0].clone(), line.clone()]) + period_ns / 2) / period_ns;
    let numbers: Vec<_> =
        samples.iter().map(|line| f64::from(u32::try_from(number(line)).unwrap())).collect();
    let (due, came) = (numbers.last().unwrap() + 1.0, f64::from(u32::try_from(samples.len()).unwrap()));
    println!("{what}: {came} of {due}");
    assert!(due * f64::from(u32::try_from(period_ns).unwrap()) > 4.9e9, "{what}: too few to judge");
    assert!(1.0 - came / due < MAY_BE_MISSING, "{what}: {came} of {due}");
    numbers
}

#[test]
fn a_scenario_comes_out_on_every_topic_with_its_type_its_quality_of_service_and_its_rate() {
    let keys = "scenario = \"crossing.xosc\"\n[traffic_lights.topics]\nmarkers = \"/traffic_light/marker\"\n";
    let bench = require!(Bench::new(keys));
    let reader = bench.reader(&[GROUND_TRUTH, CAMERA, V2I, LEGACY, MARKERS, DIAGNOSTICS, ENDPOINTS]);
    let mut gateway = bench.run();

    for (_, name, _) in [GROUND_TRUTH, CAMERA, V2I, LEGACY, MARKERS] {
        let qos = reader.matched(name);
        assert!(
            qos.contains("Durability.TransientLocal") && qos.contains("Reliability.Reliable"),
            "{name}: {qos}"
        );
    }
    // The second change to red, 11 s after the first frame, and a while more.
    let red = reader.wait(Mark::START, "v2i", "red", |data| {
        light_text::of(data).starts_with("34806: red").then(|| nanos(data))
    });
    reader.wait(Mark::START, "v2i", "the end", |data| (nanos(data) > red + 9_300_000_000).then_some(()));

    // Neither an arbiter nor the reports of a vehicle.
    let expected = expected_types(&[
        (GROUND_TRUTH.2, "traffic_simulator_msgs::msg::dds_::TrafficLightArrayV1_"),
        (CAMERA.2, GROUPS),
        (V2I.2, GROUPS),
        (LEGACY.2, GROUPS),
        (MARKERS.2, "visualization_msgs::msg::dds_::MarkerArray_"),
    ]);
    assert_eq!(types(&reader), expected);

    let [truth, camera, v2i, legacy] =
        [GROUND_TRUTH, CAMERA, V2I, LEGACY].map(|(_, name, _)| reader.samples(Mark::START, name));
    let (go, stop) = (
        "34802: green on circle; 34836: green on circle",
        "34802: red on circle; 34836: green on left, red on circle",
    );
    assert_eq!(states(&story(&truth))[..4], [go, stop, go, stop]);
    let (go, uncertain, stop) = (
        "34806: green on circle; 120666: green on circle",
        "34806: green on circle, unknown unknown circle; 120666: green on circle",
        "34806: green on left, red on circle; 120666: green on left, red on circle",
    );
    let camera_story = story(&camera);
    assert_eq!(states(&camera_story)[..6], [go, uncertain, stop, go, uncertain, stop]);
    for (pair, seconds) in camera_story[1..6].windows(2).zip([2, 3, 2, 2]) {
        assert!((pair[1].1 - pair[0].1 - seconds * SECOND).abs() <= SLACK_NS, "{pair:?}");
    }
    let stop = "34806: red on circle; 120666: red on circle";
    assert_eq!(states(&story(&v2i))[..4], [go, stop, go, stop]);
    assert_eq!(v2i.iter().map(|line| &line["data"]).collect::<Vec<_>>(), legacy_of(&legacy, &v2i));
    predictions(&v2i, &camera_story);
    markers(&reader, camera_story[2].1);

    // The scenario sets 25 Hz of V2I 8 s after its start, one frame before 1 s of the second `go`.
    let change = v2i.windows(2).position(|pair| off(gap(pair), SECOND / 10) > 1_000);
    let (before, after) = v2i.split_at(change.unwrap() + 1);
    let late = nanos(&after[0]["data"]) - camera_story[3].1 - SECOND;
    assert!(late.abs() <= SLACK_NS, "{late}");
    for (what, samples, period_ns, hz) in [
        ("camera", &camera[..], 33_333_333, 30.0),
        ("v2i", before, SECOND / 10, 10.0),
        ("v2i at 25 Hz", after, SECOND / 25, 25.0),
    ] {
        let numbers = numbers(what, samples, period_ns);
        assert_rate(what, rate(samples, &numbers), hz, 0.02);
    }
    // Without stamps; each counts.
    for (what, samples) in [("ground truth", truth), ("markers", reader.samples(Mark::START, "markers"))] {
        let count = u32::try_from(samples.len()).unwrap();
        assert!(count > 200, "{count}");
        let numbers: Vec<_> = (0..count).map(f64::from).collect();
        assert_rate(what, rate(&samples, &numbers), 30.0, MAY_BE_MISSING);
    }
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
}

/// The messages of the legacy topic with the stamps of `v2i`; the two may begin and end a message apart.
fn legacy_of<'a>(legacy: &'a [Value], v2i: &'a [Value]) -> Vec<&'a Value> {
    let by_stamp: BTreeMap<i64, &Value> =
        legacy.iter().map(|line| (nanos(&line["data"]), &line["data"])).collect();
    let (first, last) = (*by_stamp.keys().next().unwrap(), *by_stamp.keys().last().unwrap());
    let in_both = v2i.iter().map(|line| &line["data"]);
    in_both
        .map(|data| match by_stamp.get(&nanos(data)) {
            Some(legacy) => *legacy,
            None if !(first..=last).contains(&nanos(data)) => data,
            None => panic!("missing on the legacy topic: {data}"),
        })
        .collect()
}

/// In `stop`: green 3 s after its begin, green again (uncertain) 2 s later, then red.
fn predictions(v2i: &[Value], camera_story: &[(String, i64)]) {
    let begin = camera_story[2].1;
    // Seen on another topic, it may have begun a little sooner.
    let is_stop = |data: &&Value| (begin..begin + 3 * SECOND - SLACK_NS).contains(&nanos(data));
    let mut checked = 0;
    for data in v2i.iter().map(|line| &line["data"]).filter(is_stop).skip(1) {
        for group in data["traffic_light_groups"].as_array().unwrap() {
            let listed = group["predictions"].as_array().unwrap().iter();
            let listed: Vec<_> = listed
                .map(|prediction| {
                    assert_eq!(prediction["information_source"], "SIMULATION");
                    assert_eq!(prediction["reliability"], json!(1.0));
                    let after = nanos(&prediction["predicted_stamp"]) - begin;
                    let after_ms = (after + SLACK_NS).div_euclid(2 * SLACK_NS) * 500;
                    (after_ms, light_text::list_of(prediction["simultaneous_elements"].as_array().unwrap()))
                })
                .collect();
            let expected = [(3_000, "green on circle"), (5_000, "green on circle"), (7_000, "red on circle")];
            assert_eq!(listed[..3], expected.map(|(at, text)| (at, text.to_owned())), "{data}");
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}

/// Lamps of the two heads, from 8 s on also of the third one, which V2I shows yellow.
fn markers(reader: &Reader, red_from: i64) {
    let samples = reader.samples(Mark::START, "markers");
    let at = |data: &Value, id: i64| {
        let all = data["markers"].as_array().unwrap();
        let marker = all.iter().find(|marker| marker["id"] == id).unwrap().clone();
        assert_eq!((&marker["header"]["frame_id"], &marker["ns"]), (&json!("map"), &json!("bulb")));
        marker
    };
    // Green, yellow, red.
    let lit = |data: &Value, way_id: i64| {
        [0, 1, 2].map(|color| at(data, way_id * 4 + color)["color"]["a"] == json!(1.0))
    };
    let find = |from: i64| {
        let stamp = |line: &&Value| nanos(&line["data"]["markers"][0]["header"]["stamp"]);
        let found = samples.iter().find(|line| stamp(line) >= from);
        found.unwrap()["data"].clone()
    };
    let red = find(red_from + SECOND);
    assert_eq!(red["markers"].as_array().unwrap().len(), 6);
    assert_eq!((lit(&red, 34_802), lit(&red, 34_836)), ([false, false, true], [false, false, true]));
    let lamp = at(&red, 34_836 * 4 + 2);
    assert_eq!(lamp["pose"]["position"], json!({"x": 3769.15, "y": 73737.92, "z": 5.81}));
    assert_eq!(
        (&lamp["type"], &lamp["color"]["r"], &lamp["color"]["g"]),
        (&json!(2), &json!(1.0), &json!(0.0))
    );
    let later = find(red_from + 5 * SECOND);
    assert_eq!(later["markers"].as_array().unwrap().len(), 9);
    assert_eq!(lit(&later, 34_844), [false, true, false]);
}

#[test]
fn an_older_autoware_gets_its_own_types() {
    let keys = "scenario = \"crossing.xosc\"\narchitecture = \"awf/universe/20230906\"\n";
    let bench = require!(Bench::new(keys));
    let older = [CAMERA, V2I, LEGACY].map(|(_, name, topic)| ("signals", name, topic));
    let reader = bench.reader(&[older[0], older[1], older[2], ENDPOINTS]);
    let mut gateway = bench.run();
    let uncertain = "34806: green on circle, unknown unknown circle; 120666: green on circle";
    reader.wait_for_state(Mark::START, "camera", uncertain);
    for name in ["v2i", "legacy"] {
        reader.wait_for_state(Mark::START, name, "34806: red on circle; 120666: red on circle");
    }
    let expected = expected_types(&[
        (GROUND_TRUTH.2, "traffic_simulator_msgs::msg::dds_::TrafficLightArrayV1_"),
        (CAMERA.2, SIGNALS),
        (V2I.2, SIGNALS),
        (LEGACY.2, SIGNALS),
    ]);
    assert_eq!(types(&reader), expected);
    gateway.stop("TERM");
}
