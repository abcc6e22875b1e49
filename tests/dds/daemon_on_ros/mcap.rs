//! What a run records is what readers on DDS receive.

use std::path::Path;

use serde_json::Value;

use crate::dds::daemon_on_ros::peer::{CAMERA, DIAGNOSTICS, GROUND_TRUTH, MARKERS, Reader, TopicToRead, V2I};
use crate::support::json_process::Mark;
use crate::support::mcap::{McapReaders, only_entry};
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process, ros_in};

const TURN: TopicToRead<'_> = ("turn", "turn", "vehicle/status/turn_indicators_status");
const HAZARD: TopicToRead<'_> = ("hazard", "hazard", "vehicle/status/hazard_lights_status");

/// Checks that samples that are among the recorded messages, in the same order.
fn is_in_order(received: &[&Value], recorded: &[&Value]) -> Result<(), String> {
    let mut recorded = recorded.iter();
    for (number, sample) in received.iter().enumerate() {
        if !recorded.any(|message| message == sample) {
            return Err(format!("sample {number} of {} was not recorded: {sample}", received.len()));
        }
    }
    Ok(())
}

#[test]
fn every_sample_that_a_peer_receives_is_in_the_recording_in_the_same_order() {
    let readers = require!(McapReaders::find());
    let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let keys = format!(
        "source = \"recording\"\n[recording]\nfile = \"{}\"\n{}[traffic_lights]\nmap = \"crossroads.osm\"\n\
         scenario = \"crossing.xosc\"\n[traffic_lights.topics]\nmarkers = \"/traffic_light/marker\"\n",
        log.display(),
        ros_in(domain)
    );
    let folder = Folder::with_demo_vehicle("can0", &keys);
    super::add_crossing(&folder);
    let topics = [TURN, HAZARD, DIAGNOSTICS, GROUND_TRUTH, CAMERA, V2I, MARKERS];
    let reader = Reader::start(&cyclone, domain, &topics);
    let mut gateway = Process::run_with(&folder, |command| _ = command.args(["--record", "bags"]));
    let mut turns = 0;
    reader.wait(Mark::START, "turn", "60 reports", |_| {
        turns += 1;
        (turns == 60).then_some(())
    });
    gateway.stop("TERM");
    let messages = readers.messages(&only_entry(&folder.path().join("bags")));
    let frames = messages.iter().filter(|message| message["topic"] == "/body/from_can_bus").count();
    assert!(frames > 1_000, "{frames} frames");
    for (_, name, topic) in topics {
        let samples = reader.samples(Mark::START, name);
        let mut received: Vec<_> = samples.iter().map(|line| &line["data"]).collect();
        if [TURN.1, HAZARD.1].contains(&name) {
            // What is current is sent again for a reader that has joined.
            received.dedup();
        }
        if super::stood_still(&gateway) {
            // Two participants have sent what was current meanwhile.
            let all = received.clone();
            let mut position = 0;
            received.retain(|sample| {
                position += 1;
                !all[..position - 1].contains(sample)
            });
        }
        let of_topic = messages.iter().filter(|message| message["topic"] == format!("/{topic}"));
        let recorded: Vec<_> = of_topic.map(|message| &message["fields"]).collect();
        println!("{name}: {} received, {} recorded", received.len(), recorded.len());
        assert!(received.len() > 3, "{name}");
        is_in_order(&received, &recorded).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
