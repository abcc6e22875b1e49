//! The gateway on one host, its reader on another: one of two networks is used, with multicast or without.

use std::time::Duration;

use serde_json::Value;

use super::network::{Net, UNICAST};
use super::outage::{has_report, turn_reader};
use super::session::Role;
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::waiting::wait_for;

/// Packets that have left over the interface.
pub(crate) fn sent(packets: &JsonProcess) -> Value {
    packets.send("");
    packets.next("the counts", |line| line["event"] == "sent")
}

#[test]
fn only_the_chosen_one_of_two_networks_carries_traffic() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(4));
    net.plug();
    net.connect(0, 3);
    let domain = domain();
    let [chosen, other] = ["cable", "other"]
        .map(|interface| cyclone.inside(net.name(0)).start("packets.py", domain, &[interface]));
    let stranger = turn_reader(&cyclone.inside(net.name(3)), domain, "transient_local");
    let reader = turn_reader(&cyclone.inside(net.name(1)), domain, "transient_local");
    let gateway = Role::new(domain).only_on("10.77.0.1").isolated().inside(net.name(0)).start();
    for second in 1..=20 {
        gateway.send(&format!("turn left {second}"));
        reader.next("a report", has_report(2, second));
    }
    let received = stranger.next_during(Duration::from_secs(1));
    assert!(received.is_empty(), "{received:?}");
    // Counted beside their delivery.
    let chosen = wait_for("20 packets on the chosen network", || {
        Some(sent(&chosen)).filter(|sent| sent["udp"].as_u64() >= Some(20))
    });
    let other = sent(&other);
    println!("two hosts: chosen {chosen}, other {other}");
    assert_eq!((&other["udp"], &other["igmp"]), (&0.into(), &0.into()), "{other}");

    // The same host does use both networks when none is chosen.
    drop(gateway);
    let gateway = Role::new(domain).inside(net.name(0)).start();
    gateway.send("turn right 30");
    stranger.next("a report on the other network", has_report(3, 30));
}

#[test]
fn a_network_without_multicast_needs_only_the_address_of_the_gateway_at_its_reader() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(3));
    net.plug();
    net.stop_multicast();
    let domain = domain();
    let gateway = Role::new(domain).only_on("10.77.0.1").isolated().inside(net.name(0)).start();
    gateway.send("turn left 1");
    let multicast = turn_reader(&cyclone.inside(net.name(1)), domain, "transient_local");
    let received = multicast.next_during(Duration::from_secs(2));
    assert!(received.is_empty(), "multicast passes: {received:?}");
    let reader = turn_reader(&cyclone.configured(UNICAST).inside(net.name(1)), domain, "transient_local");
    reader.next("the current report", has_report(2, 1));
    gateway.send("turn right 2");
    reader.next("the next report", has_report(3, 2));
}
