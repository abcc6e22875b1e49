//! A link that is slow and loses packets, in a namespace of our own: reports come late, and never wrong.

use std::process::Command;
use std::time::Duration;

use serde_json::Value;

use super::delivery::turn_key;
use super::peer::{Peer, router, session};
use crate::network::Net;
use crate::session::Role;
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::prerequisite::{Missing, Prerequisite, require};
use crate::support::waiting::{Bystander, Pace};

const REPORTS: u32 = 200;
/// The longest time after which the newest report is there: some lost packets in a row, each sent again after
/// a second or so.
const LATE: Duration = Duration::from_secs(20);

/// Everything on the loopback of a host is late by 200 ms, and one packet of twenty is lost.
fn slow_network() -> Result<Net, Missing> {
    let net = Net::new(1)?;
    let arguments = ["netns", "exec", net.name(0), "tc", "qdisc", "add", "dev", "lo", "root"];
    let made = Command::new("ip").args(arguments).args(["netem", "delay", "200ms", "loss", "5%"]).output();
    if made.is_ok_and(|output| output.status.success()) {
        Ok(net)
    } else {
        Err(Prerequisite::Netem.missing("the kernel has no sch_netem, or there is no tc"))
    }
}

fn second(line: &Value) -> u64 {
    line["data"]["stamp"]["sec"].as_u64().unwrap()
}

#[test]
fn a_slow_link_that_loses_packets_brings_no_wrong_and_no_stale_report() {
    let net = require!(slow_network());
    let (domain, port, host) = (domain(), 7447, Some(net.name(0)));
    let _router = require!(Peer::start_inside(host, domain, &router(port)));
    let gateway = Role::new(domain).over_zenoh(&session(port)).isolated().inside(net.name(0)).start();
    let reader = require!(Peer::start_inside(host, domain, &session(port)));
    reader.token(Mark::START, "put", &["/MP/", "turn_indicators_status"]);
    reader.read("turn", "turn", &turn_key(domain), true);
    let report = |number: u32| if number.is_multiple_of(2) { ("left", 2) } else { ("off", 1) };
    let (bystander, mut pace) = (Bystander::start(), Pace::every(Duration::from_millis(50)));
    for number in 1..=REPORTS {
        gateway.send(&format!("turn {} {number}", report(number).0));
        pace.wait();
    }
    reader.sample(Mark::START, "turn", |line| second(line) == u64::from(REPORTS));
    let samples = reader.samples(Mark::START, "turn");
    let numbers: Vec<_> = samples.iter().map(second).collect();
    assert!(numbers.is_sorted(), "{numbers:?}");
    for (sample, number) in samples.iter().zip(&numbers) {
        assert_eq!(sample["data"]["report"], report(u32::try_from(*number).unwrap()).1, "report {number}");
    }
    let lateness = bystander.finish();
    let late = |line: &Value| (line["at"].as_i64().unwrap() - line["sent"].as_i64().unwrap()) / 1_000_000;
    let mut late: Vec<_> = samples.iter().map(late).collect();
    late.sort_unstable();
    let mut distinct = numbers.clone();
    distinct.dedup();
    let of = |share: usize| late[(late.len() - 1) * share / 100];
    println!(
        "200 ms and 5 % loss: {} of {REPORTS} reports arrived, late by {} ms in the middle, {} ms at most for 95 %, {} ms at most",
        distinct.len(),
        of(50),
        of(95),
        of(100)
    );
    lateness.assert_gap("from a report to its arrival", Duration::from_millis(of(100).unsigned_abs()), LATE);
    // What was on its way when it was withdrawn arrives; then nothing does, for nobody.
    let mark = reader.mark();
    gateway.send("turn withdraw");
    reader.token(mark, "delete", &["/MP/", "turn_indicators_status"]);
    reader.token(mark, "put", &["/MP/", "turn_indicators_status"]);
    let withdrawn = reader.moment();
    let later = require!(Peer::start_inside(host, domain, &session(port)));
    later.token(Mark::START, "put", &["/MP/", "turn_indicators_status"]);
    later.read("turn", "turn", &turn_key(domain), true);
    gateway.next_during(Duration::from_secs(5));
    assert_eq!(reader.unexpected(&withdrawn, "turn"), Vec::<Value>::new());
    assert_eq!(later.samples(Mark::START, "turn"), Vec::<Value>::new());
    gateway.send("turn left 999");
    later.sample(Mark::START, "turn", |line| second(line) == 999);
}
