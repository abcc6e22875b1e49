//! Routers, sessions and links that fail: when data is back, and that none of it is wrong.

use std::time::Duration;

use serde_json::Value;

use super::delivery::turn_key;
use super::peer::{Peer, router, session};
use crate::session::Role;
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;
use crate::support::waiting::Bystander;

/// The longest time until data is back.
const BACK: Duration = Duration::from_secs(3);

/// Waits until the reader has the report of this second, and asserts that it has it in time.
fn assert_back(reader: &Peer, sec: u32, when: &str) {
    assert_back_within(BACK, reader, sec, when);
}

fn assert_back_within(limit: Duration, reader: &Peer, sec: u32, when: &str) {
    let bystander = Bystander::start();
    reader.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == sec);
    let took = bystander.assert_in_time(format_args!("{when}: the report"), limit);
    println!("{when}: the report was there after {took:?}");
}

/// No report is older than one before, nor one that was never sent.
fn assert_in_order(samples: &[Value]) {
    let seconds: Vec<_> = samples.iter().map(|line| line["data"]["stamp"]["sec"].as_u64().unwrap()).collect();
    assert!(seconds.is_sorted(), "{seconds:?}");
    assert!(samples.iter().all(|line| line["data"]["report"] == 2));
}

#[test]
fn a_router_that_comes_later_or_is_killed_keeps_nobody_apart() {
    let (domain, port) = (domain(), free_port());
    let gateway = Role::new(domain).over_zenoh(&session(port)).isolated().start();
    let reader = require!(Peer::start(domain, &session(port)));
    gateway.send("turn left 1");
    assert_eq!(gateway.status()["readers"][0], 0, "nobody knows of each other without a router");
    reader.read("turn", "turn", &turn_key(domain), true);
    let first = require!(Peer::start(domain, &router(port)));
    assert_back(&reader, 1, "a router came");
    first.kill();
    for sec in 2..20 {
        gateway.send(&format!("turn left {sec}"));
        assert_back(&reader, sec, "without its router");
    }
    // A reader that comes while there is no router finds nothing, and everything once there is one again.
    let later = require!(Peer::start(domain, &session(port)));
    later.read("turn", "turn", &turn_key(domain), true);
    let _second = require!(Peer::start(domain, &router(port)));
    assert_back(&later, 19, "the router came back");
    assert_in_order(&reader.samples(Mark::START, "turn"));
    assert_in_order(&later.samples(Mark::START, "turn"));
}

mod slow {
    use ros_messages::{dds_type, type_hash};
    use serde_json::json;

    use super::*;
    use crate::session::{Gateway, KINDS};
    use crate::zenoh::peer::rmw_session;

    /// Longer than a lease of Zenoh by default, 10 s.
    const PAUSE: Duration = Duration::from_secs(25);

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn data_is_back_when_the_publisher_or_the_reader_stood_still() {
        let (domain, port) = (domain(), free_port());
        let _router = require!(Peer::start(domain, &router(port)));
        // In one process, as a computer that sleeps stops all of it.
        let gateway = Role::new(domain).over_zenoh(&session(port)).start();
        let id = "11111111111111111111111111111111";
        let reader = require!(Peer::start(domain, &with_id(&session(port), id)));
        // As any node: when both ends have given each other up, a router still knows of it, and it is sought.
        reader.order(&json!({"token": format!("@ros2_lv/{domain}/{id}/0/0/NN/%/%/reader")}));
        reader.read("turn", "turn", &turn_key(domain), true);
        gateway.send("turn left 1");
        reader.sample(Mark::START, "turn", |_| true);
        gateway.stand_still(PAUSE);
        gateway.send("turn left 2");
        assert_back_within(FOUND, &reader, 2, "the publisher stood still");
        reader.signal("-STOP");
        gateway.next_during(PAUSE / 2);
        gateway.send("turn left 3");
        gateway.next_during(PAUSE / 2);
        reader.signal("-CONT");
        assert_back_within(FOUND, &reader, 3, "the reader stood still");
        gateway.send("turn left 4");
        assert_back(&reader, 4, "afterwards");
        assert_in_order(&reader.samples(Mark::START, "turn"));
    }

    /// The longest time until data is back of a peer that nobody speaks of any more: a second in which it may
    /// come back by itself, then a question and a new session.
    const FOUND: Duration = Duration::from_secs(5);
    /// An id between those of the peers, since the greater of two connects.
    const GATEWAY: &str = "88888888888888888888888888888888";

    fn with_id(config: &str, id: &str) -> String {
        config.replacen('{', &format!("{{ id: '{id}', "), 1)
    }

    /// With a lease of a second, a node that stands still for longer gives the gateway up when it goes on,
    /// while its router does not; then neither looks for the other.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_node_that_has_given_the_gateway_up_is_sought_and_named_until_it_is_back() {
        let (domain, port) = (domain(), free_port());
        let _router = require!(Peer::start(domain, &router(port)));
        for (first, id) in
            [(10, "11111111111111111111111111111111"), (20, "eeeeeeeeeeeeeeeeeeeeeeeeeeeeeeee")]
        {
            let short = with_id(&session(port), GATEWAY).replacen(
                '{',
                "{ transport: { link: { tx: { lease: 1000, keep_alive: 4 } } },",
                1,
            );
            let gateway = Role::new(domain).over_zenoh(&short).isolated().with_autoware().start();
            let peer = require!(Peer::start(domain, &with_id(&rmw_session(port), id)));
            let node = json!({"token": format!("@ros2_lv/{domain}/{id}/0/0/NN/%/%/planner")});
            peer.order(&node);
            peer.read("turn", "turn", &turn_key(domain), true);
            gateway.send(&format!("turn left {first}"));
            peer.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == first);
            assert_heard(&gateway, &peer, domain, 0, "before");
            // Which of its timers is first is chance.
            let took = loop {
                peer.signal("-STOP");
                gateway.next_during(Duration::from_secs(3));
                let bystander = Bystander::start();
                peer.signal("-CONT");
                gateway.next_during(Duration::from_secs(2));
                if gateway.has_logged(
                    "node /planner is there, but the connection with it is lost; connecting again",
                ) {
                    let is_back = |line: &Value| {
                        line["text"]
                            .as_str()
                            .is_some_and(|text| text.contains("node /planner is connected again"))
                    };
                    gateway.wait_for(Mark::START, "its return", is_back);
                    break bystander.assert_in_time(format_args!("the node {id}"), FOUND);
                }
            };
            println!("the node {id} had given the gateway up, and was back after {took:?}");
            gateway.send(&format!("turn left {}", first + 1));
            assert_back(&peer, first + 1, "the node had given the gateway up");
            assert_heard(&gateway, &peer, domain, 0, "afterwards");
            let is_found = |status: &Value| status["links"]["unreachable"] == json!([]);
            assert_eq!(gateway.wait_until("nobody missing", is_found)["restarts"], 0);
            assert_in_order(&peer.samples(Mark::START, "turn"));
        }
    }

    /// Has a peer write a topic that the gateway reads, and waits until it has arrived in time.
    fn assert_heard(gateway: &Gateway, peer: &Peer, domain: u16, position: usize, when: &str) {
        let (name, kind) = KINDS[position];
        let type_name = kind.row().type_name;
        let hash = type_hash(type_name).unwrap();
        let key = format!("{domain}/{name}/{}/{hash}", dds_type(type_name));
        let bystander = Bystander::start();
        peer.order(&json!({"write": key, "sample": name}));
        gateway.next(name, |line| line["event"] == "arrived" && line["subscription"] == position);
        let took = bystander.assert_in_time(format_args!("{when}: a sample for the gateway"), BACK);
        println!("{when}: a sample for the gateway was there after {took:?}");
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn nodes_of_rmw_zenoh_that_stood_still_are_back_at_once() {
        let (domain, port) = (domain(), free_port());
        let _router = require!(Peer::start(domain, &router(port)));
        let gateway = Role::new(domain).over_zenoh(&session(port)).isolated().with_autoware().start();
        let peers = [(); 4].map(|()| Peer::start(domain, &rmw_session(port)));
        let peers = peers.map(|peer| peer.unwrap_or_else(|_| unreachable!("the router is one as well")));
        gateway.send("turn left 1");
        for (position, peer) in peers.iter().enumerate() {
            peer.read("turn", "turn", &turn_key(domain), true);
            peer.sample(Mark::START, "turn", |_| true);
            assert_heard(&gateway, peer, domain, position, "before");
        }
        for (sec, pause) in [(2, 15), (3, 25)] {
            let pause = Duration::from_secs(pause);
            for peer in &peers {
                peer.signal("-STOP");
            }
            gateway.next_during(pause / 2);
            gateway.send(&format!("turn left {sec}"));
            gateway.next_during(pause / 2);
            for (position, peer) in peers.iter().enumerate() {
                let when = format!("peer {position} stood still for {pause:?}");
                peer.signal("-CONT");
                assert_back(peer, sec, &when);
                assert_heard(&gateway, peer, domain, position, &when);
            }
        }
    }
}
