//! Outages by the leases and intervals that Cyclone DDS and RustDDS have by themselves.

use std::time::Instant;

use crate::dds::delivery::is_match;
use crate::dds::network::Net;
use crate::dds::outage::{has_report, recover_from_outages, turn_reader, with_lease};
use crate::dds::session::Role;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;

/// Cyclone queries addresses that never answered every 30 s, if configured to keep them.
#[test]
#[ignore = "slow: tests/run --full"]
fn without_multicast_too_reports_flow_again_after_an_outage_and_others_miss_nothing() {
    let unicast = "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"10.77.0.1\" PruneDelay=\"inf\"/></Peers></Discovery>\
        <General><AllowMulticast>false</AllowMulticast></General><Discovery>";
    let cyclone = require!(Cyclone::with_defaults());
    recover_from_outages(&require!(Net::new(3)), &cyclone, unicast);
}

/// The peer forgot us, we did not forget the peer. RustDDS has a lease of 50 s.
#[test]
#[ignore = "slow: tests/run --full"]
fn after_an_outage_longer_than_our_lease_but_not_the_peers_reports_flow_again() {
    let cyclone = require!(Cyclone::with_defaults()).configured(&with_lease("200s", ""));
    let net = require!(Net::new(3));
    net.plug();
    let domain = domain();
    let gateway = Role::new(domain).inside(net.name(0)).start();
    let readers = ["transient_local", "volatile"]
        .map(|durability| turn_reader(&cyclone.inside(net.name(1)), domain, durability));
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    for reader in &readers {
        reader.next("a match", is_match);
    }
    gateway.send("turn left 1");
    net.ip(2, "link set port1 down");
    for reader in &readers {
        reader.next("the loss of the gateway", |line| line["event"] == "unmatched");
    }
    gateway.send("turn right 2");
    net.ip(2, "link set port1 up");
    let up = Instant::now();
    readers[0].next("the current report", has_report(3, 2));
    println!("our lease: recovered in {:?}, {}", up.elapsed(), gateway.status());
    let [transient, volatile] = &readers;
    gateway.expect_at(volatile, "turn left 3", has_report(2, 3));
    transient.next("the next report", has_report(2, 3));
}
