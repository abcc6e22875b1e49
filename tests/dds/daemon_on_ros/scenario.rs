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
use crate::support::processor::waited;
use crate::support::waiting::{Bystander, Lateness, wait_until};

const SECOND: i64 = 1_000_000_000;
/// The phases of the scenario: each lasts so long, seconds.
const PHASES_S: [i64; 3] = [2, 2, 3];
/// Position of the phase with red among them.
const STOP: usize = 2;
/// Duration of all of them.
const ROUND: i64 = 7 * SECOND;
/// A frame and a little more.
const FRAME: i64 = 40_000_000;
const GROUPS: &str = "autoware_perception_msgs::msg::dds_::TrafficLightGroupArray_";
const SIGNALS: &str = "autoware_perception_msgs::msg::dds_::TrafficSignalArray_";

/// Topics and types of all writers, but those of ROS itself.
fn types(reader: &Reader) -> BTreeMap<String, String> {
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let samples = reader.samples(Mark::START, ENDPOINTS.1);
    let written = samples.iter().map(|line| (text(&line["data"]["topic"]), text(&line["data"]["type"])));
    written.filter_map(|(topic, kind)| Some((topic.strip_prefix("rt/")?.to_owned(), kind))).collect()
}

/// Waits until the writers are those of these lights and of what is always written.
fn expect_types(reader: &Reader, lights: &[(&str, &str)]) {
    let diagnostics = (DIAGNOSTICS.2, "diagnostic_msgs::msg::dds_::DiagnosticArray_");
    let log = (ROSOUT.2, "rcl_interfaces::msg::dds_::Log_");
    let parameters = ("parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_");
    let all = lights.iter().chain([&diagnostics, &log, &parameters]);
    let expected: BTreeMap<_, _> =
        all.map(|(topic, kind)| ((*topic).to_owned(), (*kind).to_owned())).collect();
    wait_until(format!("the writers {expected:?}"), || types(reader) == expected);
    assert_eq!(types(reader), expected);
}

/// The beginning of the scenario's rounds.
struct Schedule {
    /// A time at which a round began.
    begin: i64,
    /// The largest error of that.
    error: i64,
}

impl Schedule {
    /// From the change of the phase that was seen best: the one between the two samples that are closest to
    /// each other.
    fn new(samples: &[Value], states: &[&str; 3]) -> Self {
        let phase = |line: &Value| states.iter().position(|state| *state == light_text::of(&line["data"]));
        let changes = samples.windows(2).filter(|pair| phase(&pair[0]) != phase(&pair[1]));
        let best = changes.min_by_key(|pair| gap(pair)).unwrap();
        let begun = phase(&best[1]).unwrap_or_else(|| panic!("no state of a phase: {}", best[1]));
        let begin = nanos(&best[1]["data"]) - PHASES_S[..begun].iter().sum::<i64>() * SECOND;
        Self { begin, error: gap(best) + FRAME }
    }

    /// The time since a round began.
    fn of_round(&self, stamp: i64) -> i64 {
        (stamp - self.begin).rem_euclid(ROUND)
    }

    /// The phase at a time; `None` close to a change.
    fn phase(&self, stamp: i64) -> Option<usize> {
        let mut left = self.of_round(stamp);
        for (phase, duration) in PHASES_S.iter().map(|seconds| seconds * SECOND).enumerate() {
            if left < duration {
                return (self.error..duration - self.error).contains(&left).then_some(phase);
            }
            left -= duration;
        }
        unreachable!("a round ends")
    }

    /// Asserts that all samples have the state of their phase.
    fn assert(&self, what: &str, samples: &[Value], states: &[&str; 3]) {
        for data in samples.iter().map(|line| &line["data"]) {
            let state = light_text::of(data);
            match self.phase(nanos(data)) {
                Some(phase) => assert_eq!(state, states[phase], "{what}: {data}"),
                None => assert!(states.contains(&state.as_str()), "{what}: {data}"),
            }
        }
    }
}

/// From the stamp of one sample to that of the next, nanoseconds.
fn gap(pair: &[Value]) -> i64 {
    nanos(&pair[1]["data"]) - nanos(&pair[0]["data"])
}

/// Distance of a time from a whole number of periods, nanoseconds.
fn off(ns: i64, period_ns: i64) -> i64 {
    ((ns + period_ns / 2).rem_euclid(period_ns) - period_ns / 2).abs()
}

/// Asserts that stamps are whole periods apart, mostly one, and that samples were sent at their stamps, as
/// far as the machine lets a thread beside the gateway run in time.
fn assert_rhythm(what: &str, samples: &[Value], period_ns: i64, beside: Lateness) {
    for pair in samples.windows(2) {
        // Each stamp is rounded to nanoseconds.
        assert!(gap(pair) > 0 && off(gap(pair), period_ns) <= 1_000, "{what}: {} ns", gap(pair));
    }
    let stamps: Vec<_> = samples.iter().map(|line| nanos(&line["data"])).collect();
    assert_period(what, &stamps, period_ns, beside);
    let delays: Vec<_> = samples.iter().zip(&stamps).map(|(line, stamp)| sent(line) - stamp).collect();
    assert!(delays.iter().all(|delay| *delay > -1_000_000), "{what}: sent before its stamp: {delays:?}");
    let delay = median(delays);
    println!("{what}: {} samples, delayed by {delay:?} at the median", samples.len());
    beside.assert_gap(format!("{what}: the median delay"), delay, Duration::from_millis(100));
}

/// Asserts that times are one period apart at the median: at half the rate they would be two.
fn assert_period(what: &str, times: &[i64], period_ns: i64, beside: Lateness) {
    let apart = median(times.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let period = Duration::from_nanos(period_ns.unsigned_abs());
    println!("{what}: {apart:?} apart");
    assert!(apart > period.mul_f64(0.6), "{what}: {apart:?} apart, more often than {period:?}");
    beside.assert_gap(format!("{what}: the median distance"), apart, period.mul_f64(1.5));
}

fn median(mut times: Vec<i64>) -> Duration {
    times.sort_unstable();
    Duration::from_nanos(times[times.len() / 2].max(0).unsigned_abs())
}

/// The time at which a sample was sent, nanoseconds.
fn sent(line: &Value) -> i64 {
    line["sent"].as_i64().unwrap()
}

#[test]
fn a_scenario_comes_out_on_every_topic_with_its_type_its_quality_of_service_and_its_rate() {
    let keys = "scenario = \"crossing.xosc\"\n[traffic_lights.topics]\nmarkers = \"/traffic_light/marker\"\n";
    let bench = require!(Bench::new(keys));
    let reader = bench.reader(&[GROUND_TRUTH, CAMERA, V2I, LEGACY, MARKERS, DIAGNOSTICS, ENDPOINTS]);
    let beside = Bystander::start();
    let mut gateway = bench.run();

    for (_, name, _) in [GROUND_TRUTH, CAMERA, V2I, LEGACY, MARKERS] {
        let qos = reader.matched(name);
        assert!(
            qos.contains("Durability.TransientLocal") && qos.contains("Reliability.Reliable"),
            "{name}: {qos}"
        );
    }
    let (go, stop) = (
        "34802: green on circle; 34836: green on circle",
        "34802: red on circle; 34836: green on left, red on circle",
    );
    let truth_states = [go, go, stop];
    let (go, uncertain, stop) = (
        "34806: green on circle; 120666: green on circle",
        "34806: green on circle, unknown unknown circle; 120666: green on circle",
        "34806: green on left, red on circle; 120666: green on left, red on circle",
    );
    let camera_states = [go, uncertain, stop];
    let v2i_states = [go, go, "34806: red on circle; 120666: red on circle"];
    // The second change to red, 11 s after the first frame, and a while more.
    let red = reader.wait(Mark::START, "v2i", "red", |data| {
        (light_text::of(data) == v2i_states[STOP]).then(|| nanos(data))
    });
    reader.wait(Mark::START, "v2i", "the end", |data| (nanos(data) > red + 9_300_000_000).then_some(()));
    for (name, states) in [("truth", truth_states), ("camera", camera_states), ("v2i", v2i_states)] {
        for state in states {
            reader.wait_for_state(Mark::START, name, state);
        }
    }
    let (lateness, waited) = (beside.finish(), waited(gateway.id()));

    // Neither an arbiter nor the reports of a vehicle.
    expect_types(
        &reader,
        &[
            (GROUND_TRUTH.2, "traffic_simulator_msgs::msg::dds_::TrafficLightArrayV1_"),
            (CAMERA.2, GROUPS),
            (V2I.2, GROUPS),
            (LEGACY.2, GROUPS),
            (MARKERS.2, "visualization_msgs::msg::dds_::MarkerArray_"),
        ],
    );

    let [truth, camera, v2i, legacy, shown] =
        [GROUND_TRUTH, CAMERA, V2I, LEGACY, MARKERS].map(|(_, name, _)| reader.samples(Mark::START, name));
    let schedule = Schedule::new(&camera, &camera_states);
    schedule.assert("camera", &camera, &camera_states);
    schedule.assert("v2i", &v2i, &v2i_states);
    // Without stamps.
    assert!(truth.iter().all(|line| truth_states.contains(&light_text::of(&line["data"]).as_str())));
    assert_eq!(v2i.iter().map(|line| &line["data"]).collect::<Vec<_>>(), legacy_of(&legacy, &v2i));
    predictions(&v2i, &schedule);

    // The scenario sets 25 Hz of V2I 8 s after its start, a second after a round began.
    let change = v2i.windows(2).position(|pair| off(gap(pair), SECOND / 10) > 1_000).unwrap();
    let (before, after) = v2i.split_at(change + 1);
    let changed = nanos(&after[0]["data"]);
    let late = (schedule.of_round(changed) - SECOND + ROUND / 2).rem_euclid(ROUND) - ROUND / 2;
    let slack = schedule.error + SECOND / 4;
    assert!((-slack..slack + gap(&v2i[change..change + 2])).contains(&late), "{late}");
    markers(&reader, &shown, &schedule, changed);
    println!("beside: {lateness:?}; the gateway waited for a processor for up to {waited:?}");
    assert_rhythm("camera", &camera, 33_333_333, lateness);
    assert_rhythm("v2i", before, SECOND / 10, lateness);
    assert_rhythm("v2i at 25 Hz", after, SECOND / 25, lateness);
    let longest = Duration::from_nanos(camera.windows(2).map(gap).max().unwrap().unsigned_abs());
    lateness.assert_gap("frames of the camera", longest, Duration::from_millis(500) + waited);
    for (what, samples) in [("ground truth", truth), ("markers", shown)] {
        assert_period(what, &samples.iter().map(sent).collect::<Vec<_>>(), 33_333_333, lateness);
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
fn predictions(v2i: &[Value], schedule: &Schedule) {
    let is_stop = |data: &&Value| schedule.phase(nanos(data)) == Some(STOP);
    let mut checked = 0;
    for data in v2i.iter().map(|line| &line["data"]).filter(is_stop) {
        for group in data["traffic_light_groups"].as_array().unwrap() {
            let listed = group["predictions"].as_array().unwrap().iter();
            let listed: Vec<_> = listed
                .map(|prediction| {
                    assert_eq!(prediction["information_source"], "SIMULATION");
                    assert_eq!(prediction["reliability"], json!(1.0));
                    let text = light_text::list_of(prediction["simultaneous_elements"].as_array().unwrap());
                    (nanos(&prediction["predicted_stamp"]), text)
                })
                .collect();
            let end = nanos(data) + (ROUND - schedule.of_round(nanos(data)));
            let expected = [(0, "green on circle"), (2, "green on circle"), (4, "red on circle")];
            for ((at, text), (seconds, state)) in listed[..3].iter().zip(expected) {
                assert!((at - end - seconds * SECOND).abs() <= schedule.error, "{data}");
                assert_eq!(text, state, "{data}");
            }
            checked += 1;
        }
    }
    assert!(checked > 0, "no message in the phase with red");
}

/// Lamps of the two heads, from the change of V2I on also of the third one, which V2I shows yellow.
fn markers(reader: &Reader, samples: &[Value], schedule: &Schedule, changed: i64) {
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
    let stamp = |data: &Value| nanos(&data["markers"][0]["header"]["stamp"]);
    for data in samples.iter().map(|line| &line["data"]) {
        let count = data["markers"].as_array().unwrap().len();
        match stamp(data) - changed {
            ..-500_000_000 => assert_eq!(count, 6, "{data}"),
            500_000_000.. => assert_eq!(count, 9, "{data}"),
            _ => assert!([6, 9].contains(&count), "{data}"),
        }
    }
    let is_stop = |data: &Value| schedule.phase(stamp(data)) == Some(STOP);
    let red = reader.wait(Mark::START, "markers", "red", |data| is_stop(data).then(|| data.clone()));
    assert_eq!((lit(&red, 34_802), lit(&red, 34_836)), ([false, false, true], [false, false, true]));
    let lamp = at(&red, 34_836 * 4 + 2);
    assert_eq!(lamp["pose"]["position"], json!({"x": 3769.15, "y": 73737.92, "z": 5.81}));
    assert_eq!(
        (&lamp["type"], &lamp["color"]["r"], &lamp["color"]["g"]),
        (&json!(2), &json!(1.0), &json!(0.0))
    );
    let has_third = |data: &Value| data["markers"].as_array().unwrap().len() == 9;
    let later =
        reader.wait(Mark::START, "markers", "three heads", |data| has_third(data).then(|| data.clone()));
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
    expect_types(
        &reader,
        &[
            (GROUND_TRUTH.2, "traffic_simulator_msgs::msg::dds_::TrafficLightArrayV1_"),
            (CAMERA.2, SIGNALS),
            (V2I.2, SIGNALS),
            (LEGACY.2, SIGNALS),
        ],
    );
    gateway.stop("TERM");
}
