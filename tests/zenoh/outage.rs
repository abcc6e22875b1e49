//! Routers, sessions and links that fail: when data is back, and that none of it is wrong.

use std::time::Duration;

use serde_json::Value;

use super::delivery::turn_key;
use super::peer::{Peer, free_port, router, session};
use crate::session::Role;
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::prerequisite::require;
use crate::support::waiting::Bystander;

/// The longest time until data is back.
const BACK: Duration = Duration::from_secs(3);

/// Waits until the reader has the report of this second, and asserts that it has it in time.
fn assert_back(reader: &Peer, sec: u32, when: &str) {
    let bystander = Bystander::start();
    reader.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == sec);
    let took = bystander.assert_in_time(format_args!("{when}: the report"), BACK);
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
    use super::*;
    use std::process::Command;

    /// Longer than a lease of Zenoh, 10 s.
    const PAUSE: Duration = Duration::from_secs(25);

    fn signal(process: u32, name: &str) {
        assert!(Command::new("kill").args([name, &process.to_string()]).status().unwrap().success());
    }

    #[test]
    fn data_is_back_when_the_publisher_or_the_reader_stood_still() {
        let (domain, port) = (domain(), free_port());
        let _router = require!(Peer::start(domain, &router(port)));
        // In one process, as a computer that sleeps stops all of it.
        let gateway = Role::new(domain).over_zenoh(&session(port)).start();
        let reader = require!(Peer::start(domain, &session(port)));
        reader.read("turn", "turn", &turn_key(domain), true);
        gateway.send("turn left 1");
        reader.sample(Mark::START, "turn", |_| true);
        gateway.stand_still(PAUSE);
        gateway.send("turn left 2");
        assert_back(&reader, 2, "the publisher stood still");
        signal(reader.id(), "-STOP");
        gateway.next_during(PAUSE / 2);
        gateway.send("turn left 3");
        gateway.next_during(PAUSE / 2);
        signal(reader.id(), "-CONT");
        assert_back(&reader, 3, "the reader stood still");
        gateway.send("turn left 4");
        assert_back(&reader, 4, "afterwards");
        assert_in_order(&reader.samples(Mark::START, "turn"));
    }
}
