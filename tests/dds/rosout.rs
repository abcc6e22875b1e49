//! `/rosout` of a session, as readers that come early or late see it.

use std::time::Duration;

use serde_json::Value;

use super::session::Role;
use crate::support::peer::{Cyclone, Reading, domain};
use crate::support::prerequisite::require;

const ROSOUT: Reading<'_> = Reading { kind: "log", topic: "rt/rosout", durability: "transient_local" };

fn has_text(text: &str) -> impl Fn(&Value) -> bool {
    move |line| line["event"] == "sample" && line["data"]["msg"] == text
}

#[test]
fn a_warning_has_its_logger_and_level_and_reaches_who_comes_later() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").with_rosout().start();
    let early = cyclone.reader(domain, &[ROSOUT]);
    let matched = early.next("the writer", |line| line["event"] == "matched");
    let offered = matched["qos"].as_str().unwrap();
    for policy in ["Reliable", "TransientLocal", "Lifespan(lifespan=10000000000)"] {
        assert!(offered.contains(policy), "{policy}: {offered}");
    }
    gateway.send("warn can0: the interface is down");
    let line = early.next("the warning", has_text("can0: the interface is down"))["data"].clone();
    assert_eq!((&line["level"], &line["name"]), (&30.into(), &"vehicle.gateway_under_test".into()), "{line}");
    assert!(line["stamp"]["sec"].as_i64().unwrap() > 1_700_000_000, "{line}");

    // Nobody knows how long a reader takes to start, and the lifespan does not wait for it.
    let reaches_the_late = (0..5).any(|attempt| {
        let text = format!("turn: attempt {attempt}");
        gateway.send(&format!("warn {text}"));
        early.next("the warning", has_text(&text));
        let late = cyclone.reader(domain, &[ROSOUT]);
        late.next("the writer", |line| line["event"] == "matched");
        late.next_during(Duration::from_secs(1)).iter().any(has_text(&text))
    });
    assert!(reaches_the_late, "no late reader was handed a warning of the last 10 s");
}

#[test]
fn a_warning_waits_for_the_first_reader() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").with_rosout().start();
    let is_handed_over = (0..5).any(|attempt| {
        let texts = [format!("turn: first {attempt}"), format!("turn: second {attempt}")];
        for text in &texts {
            gateway.send(&format!("warn {text}"));
        }
        let reader = cyclone.reader(domain, &[ROSOUT]);
        reader.next("the writer", |line| line["event"] == "matched");
        let lines = reader.next_during(Duration::from_secs(1));
        texts.iter().all(|text| lines.iter().filter(|line| has_text(text)(line)).count() == 1)
    });
    assert!(is_handed_over, "the first reader did not get the warnings of the last 10 s once each");
}
