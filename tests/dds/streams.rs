//! Published traffic lights: types, contents, quality of service, late joiners, large messages.

use std::time::Duration;

use serde_json::{Value, json};

use super::session::{Gateway, Role};
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::processor::waited_in_all;

const V2I: &str = "rt/external/traffic_signals";

fn is_sample(line: &Value) -> bool {
    line["event"] == "sample"
}

fn sec(line: &Value) -> i64 {
    line["data"]["stamp"]["sec"].as_i64().unwrap()
}

#[test]
fn each_kind_of_traffic_lights_arrives_as_sent_with_its_quality_of_service() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let stamp = json!({"sec": 5, "nanosec": 0});
    let element = json!({"color": 1, "shape": 1, "status": 2, "confidence": 0.5});
    let bulb = json!({"enum_revision": 0, "color": 1, "shape": 1, "status": 2, "confidence": 0.5});
    let prediction = json!({"predicted_stamp": {"sec": 9, "nanosec": 1}, "simultaneous_elements": [element],
        "reliability": 1.0, "information_source": "SIMULATION"});
    let groups = json!({"stamp": stamp, "traffic_light_groups":
        [{"traffic_light_group_id": 0, "elements": [element], "predictions": [prediction]}]});
    let empty = json!({"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""});
    let marker = json!({"header": {"stamp": stamp, "frame_id": "map"}, "ns": "bulb", "id": 6, "type": 2, "action": 0,
        "pose": {"position": {"x": 1.0, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
        "scale": {"x": 0.3, "y": 0.3, "z": 0.3}, "color": {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0},
        "lifetime": {"sec": 0, "nanosec": 0}, "frame_locked": false, "points": [], "colors": [],
        "texture_resource": "", "texture": {"header": empty, "format": "", "data": []}, "uv_coordinates": [],
        "text": "", "mesh_resource": "", "mesh_file": {"filename": "", "data": []},
        "mesh_use_embedded_materials": false});
    #[rustfmt::skip]
    let cases = [
        ("truth", "array_v1", "rt/simulation/traffic_lights",
            json!({"traffic_lights": [{"lanelet_way_id": 0, "traffic_light_bulbs": [bulb]}]})),
        ("camera", "signals", "rt/camera/traffic_signals",
            json!({"stamp": stamp, "signals": [{"traffic_signal_id": 0, "elements": [element]}]})),
        ("v2i", "groups", V2I, groups.clone()),
        ("v2i", "groups", "rt/v2x/traffic_signals", groups),
        ("markers", "markers", "rt/traffic_light/marker", json!({"markers": [marker]})),
    ];
    let readers: Vec<_> = cases
        .iter()
        .map(|(_, kind, topic, _)| cyclone.topic_reader(domain, kind, topic, "transient_local"))
        .collect();
    gateway.wait_until("five readers", |status| status["lights"] == json!([1, 1, 1, 1, 1]));
    for ((topic, _, name, expected), reader) in cases.iter().zip(&readers) {
        let matched = reader.next("a match", |line| line["event"] == "matched");
        let qos = matched["qos"].as_str().unwrap();
        assert!(qos.contains("Durability.TransientLocal") && qos.contains("Reliability.Reliable"), "{qos}");
        gateway.send(&format!("lights {topic} 5"));
        assert_eq!(reader.next("a sample", is_sample)["data"], *expected, "{name}");
    }
}

#[test]
fn a_late_joiner_of_a_stream_gets_the_newest_at_once_and_what_follows() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let markers = cyclone.topic_reader(domain, "markers", "rt/traffic_light/marker", "transient_local");
    // First nobody has read the earlier emissions, then somebody who is gone.
    for round in [100, 200] {
        gateway.send(&format!("lights v2i {round} 1 20"));
        gateway.next("the end of the stream", |line| line["event"] == "sent");
        wait_until_written(&gateway, &markers, round);
        let late = cyclone.topic_reader(domain, "groups", V2I, "transient_local");
        assert_eq!(sec(&late.next("the newest", is_sample)), round + 19);
        gateway.send("lights v2i 7");
        let next = late.next("the next", |line| is_sample(line) && sec(line) != round + 19);
        assert_eq!(sec(&next), 7);
        drop(late);
        gateway.wait_until("the reader's leave", |status| status["lights"][2] == 0);
    }
}

/// Waits until the network side has what was sent before: an emission on another topic follows on the same
/// way.
fn wait_until_written(gateway: &Gateway, markers: &JsonProcess, number: i64) {
    gateway.send(&format!("lights markers {number}"));
    markers.next("the emission that follows", |line| {
        is_sample(line) && line["data"]["markers"][0]["header"]["stamp"]["sec"] == number
    });
}

/// With a history that would take seconds to hand over: the joiner is not made to wait for it, and who
/// read before misses nothing.
#[test]
fn a_late_joiner_of_a_busy_stream_is_soon_up_to_date_and_others_miss_nothing() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let early = cyclone.topic_reader(domain, "groups", V2I, "transient_local");
    gateway.wait_until("a reader", |status| status["lights"][2] == 1);
    let kept_waiting = || waited_in_all(early.id()) + waited_in_all(gateway.id());
    let before = kept_waiting();
    gateway.send("lights v2i 1 101 90"); // three seconds, 7 kB each
    gateway.next("the end of the stream", |line| line["event"] == "sent");
    let mut received = Vec::new();
    while received.last() != Some(&90) {
        received.push(sec(&early.next("the stream", is_sample)));
    }
    if gateway.is_undisturbed() {
        assert!(received.is_sorted_by(|one, next| one < next), "{received:?}");
    }
    received.sort_unstable();
    received.dedup();
    // A machine too slow for the stream leaves some out on purpose, here and in the writer, which keeps the
    // newest only.
    let missed = 90 - received.len();
    let overtaken = gateway.status()["overtaken"].as_u64().unwrap();
    let kept_waiting = kept_waiting().saturating_sub(before);
    println!("{missed} missed, {overtaken} overtaken; both waited {kept_waiting:?} for a processor");
    if kept_waiting < Duration::from_millis(30) && gateway.is_undisturbed() {
        assert_eq!(overtaken, missed as u64, "the early reader missed something: {received:?}");
    }
    let late = cyclone.topic_reader(domain, "groups", V2I, "transient_local");
    let mut handed_over = 1;
    while sec(&late.next("the newest", is_sample)) != 90 {
        handed_over += 1;
    }
    println!("the late joiner was handed {handed_over} samples");
    gateway.assert_brief("handing over no more samples than the topic's depth", handed_over <= 10);
    gateway.wait_until("both readers", |status| status["lights"][2] == 2);
    gateway.send("lights v2i 91");
    for reader in [&early, &late] {
        reader.next("what follows", |line| is_sample(line) && sec(line) == 91);
    }
}

#[test]
fn ten_thousand_groups_thirty_times_a_second_go_through() {
    // Making objects of all samples takes Python a minute; the newest tells as much.
    let cyclone = require!(Cyclone::with_defaults()).keeping(1);
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let reader = cyclone.topic_reader(domain, "groups", V2I, "transient_local");
    gateway.wait_until("a reader", |status| status["lights"][2] == 1);
    gateway.send("lights v2i 1 10000 60");
    let sent = gateway.next("the end of the stream", |line| line["event"] == "sent");
    let newest = reader.next("the newest", |line| is_sample(line) && sec(line) == 60);
    assert_eq!(newest["data"]["groups"], 10_000);
    let status = gateway.status();
    println!("{sent}, {status}");
    assert_eq!(status["write_errors"], 0, "{status}");
    gateway.expect_rebuilds(0);
    // The session goes on as before.
    gateway.send("lights v2i 77");
    reader.next("what follows", |line| is_sample(line) && sec(line) == 77);
}
