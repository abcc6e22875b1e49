//! What a late reader gets: the report that stands, and nothing once it is withdrawn.

use std::time::Duration;

use serde_json::json;

use super::peer::{Peer, router, session};
use crate::session::Role;
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;
use ros_messages::type_hash;

/// The key of the report on turn indicators in a domain.
pub(crate) fn turn_key(domain: u16) -> String {
    let hash = type_hash("autoware_vehicle_msgs/msg/TurnIndicatorsReport").unwrap();
    format!(
        "{domain}/vehicle/status/turn_indicators_status/autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_/{hash}"
    )
}

/// Time in which a sample would have come: a report that stands is repeated each second, and history comes at
/// once.
const SILENCE: Duration = Duration::from_millis(2500);

#[test]
fn a_late_reader_gets_the_report_that_stands_and_nothing_after_its_withdrawal() {
    let (domain, port) = (domain(), free_port());
    let _router = require!(Peer::start(domain, &router(port)));
    let gateway = Role::new(domain).over_zenoh(&session(port)).isolated().start();
    let key = turn_key(domain);
    gateway.send("turn left 5");
    gateway.send("turn right 6");
    let late = require!(Peer::start(domain, &session(port)));
    let token = late.token(Mark::START, "put", &["/MP/", "turn_indicators_status"]);
    late.read("turn", "turn", &key, true);
    let sample = late.sample(Mark::START, "turn", |_| true);
    assert_eq!(
        (sample["data"]["report"].as_i64(), sample["data"]["stamp"]["sec"].as_i64()),
        (Some(3), Some(6))
    );
    assert_eq!(sample["gid"], token["gid"]);
    // It stands, and is repeated as it is.
    let mark = late.mark();
    let again = late.sample(mark, "turn", |_| true);
    assert_eq!(again["data"], sample["data"]);
    let mark = late.mark();
    gateway.send("turn withdraw");
    late.token(mark, "delete", &[token["key"].as_str().unwrap()]);
    let renewed = late.token(mark, "put", &["/MP/", "turn_indicators_status"]);
    assert_ne!(renewed["gid"], token["gid"]);
    let withdrawn = late.moment();
    let later = require!(Peer::start(domain, &session(port)));
    later.token(Mark::START, "put", &["/MP/", "turn_indicators_status"]);
    later.read("turn", "turn", &key, true);
    gateway.next_during(SILENCE);
    assert_eq!(later.samples(Mark::START, "turn"), Vec::<serde_json::Value>::new());
    assert_eq!(late.unexpected(&withdrawn, "turn"), Vec::<serde_json::Value>::new());
    // Both hear the next one.
    gateway.send("turn left 9");
    for reader in [&late, &later] {
        let sample = reader.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == 9);
        assert_eq!(sample["gid"], renewed["gid"]);
    }
}

#[test]
fn another_gateway_on_the_same_topics_is_named_while_it_is_there() {
    let (domain, port) = (domain(), free_port());
    let _router = require!(Peer::start(domain, &router(port)));
    let role = || Role::new(domain).over_zenoh(&session(port)).isolated().start();
    let gateway = role();
    let shares = |topics: serde_json::Value| move |status: &serde_json::Value| status["shared"] == topics;
    assert!(shares(json!([]))(&gateway.status()));
    let other = role();
    let topics = ["/vehicle/status/turn_indicators_status 1", "/vehicle/status/hazard_lights_status 1"];
    gateway.wait_until("the other's writers", shares(json!(topics)));
    other.stop();
    gateway.wait_until("no other writer", shares(json!([])));
}
