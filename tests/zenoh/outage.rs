//! Routers, sessions and links that fail: when data is back, and that none of it is wrong.

use std::time::{Duration, Instant};

use serde_json::Value;

use super::delivery::turn_key;
use super::peer::{Peer, free_port, router, session};
use crate::session::{Gateway, Role};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::prerequisite::require;

/// The longest time until data is back.
const BACK: Duration = Duration::from_secs(3);

/// Sends a report, and gives the time until the reader has it.
fn arrival(gateway: &Gateway, reader: &Peer, sec: u32) -> Duration {
    let (mark, begin) = (reader.mark(), Instant::now());
    gateway.send(&format!("turn left {sec}"));
    reader.sample(mark, "turn", |line| line["data"]["stamp"]["sec"] == sec);
    begin.elapsed()
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
    let begin = Instant::now();
    reader.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == 1);
    let took = begin.elapsed();
    println!("a router came: the report was there after {took:?}");
    assert!(took < BACK, "{took:?}");
    first.kill();
    for sec in 2..20 {
        let took = arrival(&gateway, &reader, sec);
        assert!(took < BACK, "without its router: {took:?}");
    }
    // A reader that comes while there is no router finds nothing, and everything once there is one again.
    let later = require!(Peer::start(domain, &session(port)));
    later.read("turn", "turn", &turn_key(domain), true);
    let _second = require!(Peer::start(domain, &router(port)));
    let begin = Instant::now();
    later.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == 19);
    let took = begin.elapsed();
    println!("the router came back: the report was there after {took:?}");
    assert!(took < BACK, "{took:?}");
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
        let took = arrival(&gateway, &reader, 2);
        println!("the publisher stood still for {PAUSE:?}: data was back after {took:?}");
        assert!(took < BACK, "{took:?}");
        signal(reader.id(), "-STOP");
        gateway.next_during(PAUSE / 2);
        gateway.send("turn left 3");
        gateway.next_during(PAUSE / 2);
        signal(reader.id(), "-CONT");
        let begin = Instant::now();
        reader.sample(Mark::START, "turn", |line| line["data"]["stamp"]["sec"] == 3);
        let took = begin.elapsed();
        println!("the reader stood still for {PAUSE:?}: data was back after {took:?}");
        assert!(took < BACK, "{took:?}");
        assert!(arrival(&gateway, &reader, 4) < BACK);
        assert_in_order(&reader.samples(Mark::START, "turn"));
    }
}
