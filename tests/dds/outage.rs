//! Networks that go, come back, or offer little: peers are found again by the same process.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::delivery::{TURN, is_match};
use super::network::{Net, UNICAST};
use super::session::{Gateway, Role};
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, LOOPBACK, Writing, domain};
use crate::support::prerequisite::require;
use crate::support::waiting::{Bystander, Pace, let_pass};

/// Cyclone on the loopback, with multicast.
const ON_LOOPBACK: &str = "<CycloneDDS><Domain><General><AllowMulticast>true</AllowMulticast><Interfaces>\
    <NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>";

/// The lease of peers that are to be missed soon, but not when a busy machine keeps them from announcing
/// themselves.
pub(crate) const SHORT: &str = "8s";
/// The lease of a peer that is not to be missed.
const LONG: &str = "60s";
/// Peers of a short lease are missed when they are silent, and not when a busy machine delays the one
/// announcement that Cyclone makes in it.
const OFTEN: &str = "<SPDPInterval>200ms</SPDPInterval>";

/// Between two messages of a stream.
const PERIOD: Duration = Duration::from_millis(50);
/// Messages after a recovery, which outlast the participant that was replaced.
const AFTERWARDS: u32 = 40;
/// Commands that may be on their way at once, fewer than a reader that joins late is handed.
const IN_FLIGHT: usize = 5;

pub(crate) fn has_report(report: u8, sec: i32) -> impl Fn(&Value) -> bool {
    move |line| {
        let data = &line["data"];
        line["event"] == "sample" && data["report"] == report && data["stamp"]["sec"] == sec
    }
}

/// Cyclone with that lease, and more settings of its discovery.
pub(crate) fn with_lease(lease: &str, discovery: &str) -> String {
    format!(
        "<CycloneDDS><Domain><Discovery><LeaseDuration>{lease}</LeaseDuration>{discovery}</Discovery>\
         <Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>"
    )
}

pub(crate) fn turn_reader(cyclone: &Cyclone, domain: u16, durability: &str) -> JsonProcess {
    cyclone.topic_reader(domain, "turn", TURN, durability)
}

/// True if so many peers are missed, and a probe looks for them.
fn looks_for(missing: u32) -> impl Fn(&Value) -> bool {
    move |status| status["missing"] == missing && status["probe"] == true
}

/// Likewise, or when the gateway stood still during the outage: then it has begun anew, and misses nobody.
fn looks_for_or_stood_still(gateway: &Gateway, missing: u32) -> impl Fn(&Value) -> bool {
    let before = gateway.standstills();
    move |status| looks_for(missing)(status) || gateway.standstills() > before
}

#[test]
fn after_an_outage_longer_than_the_lease_reports_flow_again_and_others_miss_nothing() {
    let cyclone = require!(Cyclone::with_defaults());
    recover_from_outages(&require!(Net::new(3)), &cyclone, OFTEN);
}

/// Peers with these settings of their discovery.
pub(crate) fn recover_from_outages(net: &Net, cyclone: &Cyclone, discovery: &str) {
    net.plug();
    let domain = domain();
    let at = |host: u16| {
        let lease = if host == 0 { LONG } else { SHORT };
        cyclone.configured(&with_lease(lease, discovery)).inside(net.name(host))
    };
    let gateway = Role::new(domain).alert().isolated().inside(net.name(0)).start();
    let (near, far) =
        (turn_reader(&at(0), domain, "volatile"), turn_reader(&at(1), domain, "transient_local"));
    let far_diagnostics = at(1).topic_reader(domain, "diagnostics", "rt/diagnostics", "volatile");
    gateway.wait_until("both readers", |status| status["readers"] == json!([2, 0, 1]));
    near.next("a match", is_match);
    let (mut number, mut pace) = (0, Pace::every(PERIOD));
    // The near reader misses nothing.
    let mut publish = || {
        number += 1;
        gateway.send(&format!("diagnostics {number}"));
        gateway.expect_at(&near, &format!("turn left {number}"), has_report(2, number));
        pace.wait();
        number
    };
    let first = publish();
    far.next("a report before the outage", has_report(2, first));

    // The first outage affects the gateway's host, the second happens elsewhere.
    for (outage, port) in [(1, "port0"), (2, "port1")] {
        net.ip(2, &format!("link set {port} down"));
        let down = Instant::now();
        let is_lost = looks_for_or_stood_still(&gateway, 2);
        gateway.wait_while_doing("the loss of the far readers", is_lost, || {
            publish();
        });
        let last = publish();
        net.ip(2, &format!("link set {port} up"));
        let up = Instant::now();
        far.next("the current report after the outage", has_report(2, last));
        println!("outage at {port}: {:?} long, recovered in {:?}", up - down, up.elapsed());
        let following = publish();
        far.next("the next report", has_report(2, following));
        for _ in 0..AFTERWARDS {
            publish();
        }
        let status = gateway.expect_rebuilds(outage);
        assert_eq!(status["write_errors"], 0, "{status}");
        gateway.wait_until("nobody who is missing", |status| status["missing"] == 0);
        let newest = publish();
        let is_newer = |line: &Value| {
            let message = line["data"]["status"][0]["message"].as_str().and_then(|text| text.parse().ok());
            message.is_some_and(|number: i32| number >= newest)
        };
        far_diagnostics.wait_while_doing(Mark::START, "diagnostics", PERIOD, || _ = publish(), is_newer);
    }
}

/// Text commands that a peer sends to a subscription of the gateway.
struct Commands<'a> {
    gateway: &'a Gateway,
    writer: JsonProcess,
    subscription: usize,
    sent: Vec<String>,
    pace: Pace,
}

impl<'a> Commands<'a> {
    fn new(gateway: &'a Gateway, writer: JsonProcess, subscription: usize) -> Self {
        Self { gateway, writer, subscription, sent: vec![], pace: Pace::every(PERIOD) }
    }

    fn send(&mut self) {
        // A gateway that is behind is waited for, since the writer keeps only the latest for it.
        if let Some(earlier) = self.sent.len().checked_sub(IN_FLIGHT) {
            self.gateway.wait_for(Mark::START, "an earlier command", has_text(&self.sent[earlier]));
        }
        let command = self.sent.len().to_string();
        self.writer.send(&command);
        self.sent.push(command);
        self.pace.wait();
    }

    fn assert_each_arrived_once(&self) {
        let last = self.sent.last().unwrap();
        self.gateway.wait_for(Mark::START, "the last command", has_text(last));
        let lines = self.gateway.lines().into_iter().filter(|line| line["subscription"] == self.subscription);
        let texts: Vec<Value> = lines.map(|line| line["what"]["text"].clone()).collect();
        assert_eq!(texts, self.sent, "each command arrives once, and in order");
        // The count may show a moment after the arrival.
        let received = |status: &Value| status["incoming"][self.subscription]["received"].as_u64();
        let all = u64::try_from(self.sent.len()).unwrap();
        let status = self.gateway.wait_until("the count", |status| received(status) >= Some(all));
        assert_eq!(received(&status), Some(all), "each command counts once");
    }
}

fn has_text(text: &str) -> impl Fn(&Value) -> bool + use<> {
    let text = json!(text);
    move |line| line["event"] == "arrived" && line["what"]["text"] == text
}

fn rebuilds(status: &Value) -> u64 {
    status["rebuilds"].as_u64().unwrap()
}

/// The far writer is found again by the new participant's readers; the near one is read by both
/// participants for a while, and each of its commands arrives once.
#[test]
fn after_an_outage_commands_are_received_again_and_none_twice() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(3));
    net.plug();
    let domain = domain();
    let gateway = Role::new(domain).with_lights().alert().inside(net.name(0)).start();
    let writer = |host, lease, kind, topic, durability| {
        let topic = Writing { kind, topic, reliability: "reliable", durability };
        cyclone.configured(&with_lease(lease, OFTEN)).inside(net.name(host)).writer(domain, &[topic])
    };
    let far = writer(1, SHORT, "text", "rt/commands", "volatile");
    let far_groups = writer(1, SHORT, "groups", "rt/groups", "volatile");
    // A new reader of this one is handed its latest samples. It is never missed, however busy the machine is.
    let near = writer(0, LONG, "text", "rt/kept_commands", "transient_local");
    let has_writers =
        |status: &Value| [0, 1, 3].iter().all(|position| status["incoming"][*position]["writers"] == 1);
    gateway.wait_until("the writers", has_writers);
    let mut near = Commands::new(&gateway, near, 3);
    far.send("before");
    near.send();
    gateway.next("a command before the outage", has_text("before"));
    let before = rebuilds(&gateway.status());
    let is_lost = looks_for_or_stood_still(&gateway, 2);
    net.ip(2, "link set port1 down");
    gateway.wait_while_doing("the loss of the far writers", is_lost, || near.send());
    let marks = [&far, &far_groups].map(|writer| (writer, writer.mark()));
    net.ip(2, "link set port1 up");
    let up = Instant::now();
    let is_rebuilt = |status: &Value| rebuilds(status) > before;
    gateway.wait_while_doing("a new participant", is_rebuilt, || near.send());
    println!("commands: recovered in {:?}", up.elapsed());
    for _ in 0..AFTERWARDS {
        near.send();
    }
    gateway.wait_until("the far writers", has_writers);
    // The new reader must be known there as well: nothing volatile is kept for it.
    for (writer, mark) in marks {
        writer.wait_for(mark, "the new reader", is_match);
    }
    // Whatever the old reader took as well has arrived before what is sent after its end.
    near.writer.next("the end of the old reader", |line| line["event"] == "unmatched");
    far.send("after");
    far_groups.send("5 1 1 1 2 1.0");
    near.send();
    let (mut after, mut groups) = (false, false);
    while !(after && groups) {
        let line = gateway.next("what was sent", |line| line["event"] == "arrived");
        after |= line["what"]["text"] == "after";
        groups |= line["what"]["sec"] == 5;
    }
    near.assert_each_arrived_once();
}

/// The peer, which knows the gateway's address and hears no multicast, meets new participants late. Until
/// then it writes for the first one.
#[test]
fn two_new_addresses_in_a_row_lose_no_command_of_a_peer_without_multicast() {
    let cyclone = require!(Cyclone::with_defaults()).configured(UNICAST);
    let net = require!(Net::new(3));
    net.plug();
    net.stop_multicast();
    let domain = domain();
    let gateway = Role::new(domain).with_lights().alert().inside(net.name(0)).start();
    let commands =
        Writing { kind: "text", topic: "rt/commands", reliability: "reliable", durability: "volatile" };
    let writer = cyclone.inside(net.name(1)).writer(domain, &[commands]);
    gateway.wait_until("the writer", |status| status["incoming"][1]["writers"] == 1);
    let mut commands = Commands::new(&gateway, writer, 1);
    for number in 1..=2 {
        net.ip(0, &format!("addr add 10.77.0.1{number}/24 dev cable"));
        let is_rebuilt = |status: &Value| rebuilds(status) >= number;
        gateway.wait_while_doing("a new participant", is_rebuilt, || commands.send());
    }
    for _ in 0..AFTERWARDS {
        commands.send();
    }
    commands.assert_each_arrived_once();
}

/// RustDDS finds a peer again whose announcement is another one than before the outage, but does not match
/// its endpoints.
#[test]
fn a_peer_that_announces_something_else_after_an_outage_is_written_to_again() {
    let cyclone = require!(Cyclone::with_defaults()).configured(&with_lease(SHORT, OFTEN));
    let net = require!(Net::new(3));
    net.plug();
    let domain = domain();
    let gateway = Role::new(domain).alert().inside(net.name(0)).start();
    let far = turn_reader(&cyclone.inside(net.name(1)), domain, "transient_local");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    for report in 1..=3 {
        net.ip(2, "link set port1 down");
        let is_lost = looks_for_or_stood_still(&gateway, 1);
        gateway.wait_until("a discovery probe", is_lost);
        far.send(&report.to_string());
        far.next("another announcement", |line| line["event"] == "announced");
        gateway.send(&format!("turn left {report}"));
        net.ip(2, "link set port1 up");
        far.next("the current report", has_report(2, report));
        gateway.wait_until("no missing peer", |status| status["missing"] == 0);
    }
}

/// A volatile writer hands nothing to a reader it has just met; here the reader is an old acquaintance.
#[test]
fn a_volatile_report_that_changed_during_an_outage_arrives_after_it() {
    let cyclone = require!(Cyclone::with_defaults()).configured(&with_lease(SHORT, OFTEN));
    let net = require!(Net::new(3));
    net.plug();
    let domain = domain();
    let gateway = Role::new(domain).volatile().alert().inside(net.name(0)).start();
    let far = turn_reader(&cyclone.inside(net.name(1)), domain, "volatile");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    far.next("a match", is_match);
    let beside = Bystander::start();
    net.ip(2, "link set port1 down");
    let is_lost = looks_for_or_stood_still(&gateway, 1);
    gateway.wait_until("the loss of the reader", |status| status["missing"] == 1 || is_lost(status));
    gateway.send("turn right 2");
    gateway.wait_until("a discovery probe", is_lost);
    net.ip(2, "link set port1 up");
    gateway.expect_by_itself(&far, "turn right 2", beside, has_report(3, 2));
}

#[test]
fn a_killed_peer_is_looked_for_without_disturbing_anybody() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let reader =
        |lease| turn_reader(&cyclone.configured(&with_lease(lease, OFTEN)), domain, "transient_local");
    let gateway = Role::new(domain).alert().start();
    let (healthy, victim, leaver) = (reader(LONG), reader(SHORT), reader(LONG));
    gateway.wait_until("three readers", |status| status["readers"][0] == 3);
    drop(leaver);
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    assert_eq!(gateway.status()["missing"], 0, "who leaves orderly is not missed");
    let is_lost = looks_for_or_stood_still(&gateway, 1);
    victim.kill();
    gateway.wait_until("one reader", |status| status["readers"][0] == 1);
    gateway.wait_until("the loss of the victim", is_lost);
    let_pass(Duration::from_secs(2), "in which healthy peers announce themselves to the probe");
    gateway.send("turn left 1");
    healthy.next("a report", has_report(2, 1));
    let again = reader(LONG);
    again.next("the current report", has_report(2, 1));
    gateway.expect_rebuilds(0);
    if gateway.is_undisturbed() {
        assert!(healthy.next_during(Duration::ZERO).iter().all(|line| line["event"] != "unmatched"));
        gateway.wait_until("a probe that still looks for the victim", looks_for(1));
    }
    gateway.stop();
}

#[test]
fn an_address_that_comes_after_the_start_is_used() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(3));
    let domain = domain();
    let gateway = Role::new(domain).inside(net.name(0)).start();
    gateway.send("turn left 1");
    net.plug();
    let plugged = Instant::now();
    let far = turn_reader(&cyclone.inside(net.name(1)), domain, "transient_local");
    far.next("the current report", has_report(2, 1));
    println!("new address used after {:?}", plugged.elapsed());
    gateway.expect_rebuilds(1);
}

#[test]
fn networks_that_were_not_named_are_not_used() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(3));
    net.plug();
    net.ip(0, "link set lo multicast on");
    let domain = domain();
    let near = turn_reader(&cyclone.configured(ON_LOOPBACK).inside(net.name(0)), domain, "transient_local");
    let far = turn_reader(&cyclone.inside(net.name(1)), domain, "transient_local");
    let gateway_on = |address| Role::new(domain).only_on(address).inside(net.name(0)).start();
    let gateway = gateway_on("127.0.0.1");
    gateway.send("turn left 1");
    near.next("a report on the named network", has_report(2, 1));
    let received = far.next_during(Duration::from_secs(3));
    assert!(received.is_empty(), "{received:?}");
    drop(gateway);
    let gateway = gateway_on("10.77.0.1");
    gateway.send("turn right 2");
    far.next("a report on the named network", has_report(3, 2));
}

/// Both orders of start, so that each side comes to have the first unicast port once.
fn exchange_on_loopback(net: &Net, cyclone: &Cyclone) {
    let cyclone = cyclone.inside(net.name(0));
    let start = |domain| -> Gateway { Role::new(domain).inside(net.name(0)).start() };
    let domain_a = domain();
    let gateway = start(domain_a);
    gateway.send("turn left 1");
    let second = turn_reader(&cyclone, domain_a, "transient_local");
    second.next("a report from a gateway that was first", has_report(2, 1));

    let domain_b = domain();
    let first = turn_reader(&cyclone, domain_b, "transient_local");
    let gateway = start(domain_b);
    gateway.send("turn right 2");
    first.next("a report from a gateway that was second", has_report(3, 2));
}

#[test]
fn a_loopback_without_multicast_is_enough() {
    let cyclone = require!(Cyclone::with_defaults()).configured(LOOPBACK);
    let net = require!(Net::new(1));
    net.ip(0, "link set lo multicast off");
    exchange_on_loopback(&net, &cyclone);
}

#[test]
fn a_loopback_with_multicast_is_enough() {
    let cyclone = require!(Cyclone::with_defaults()).configured(ON_LOOPBACK);
    let net = require!(Net::new(1));
    net.ip(0, "link set lo multicast on");
    exchange_on_loopback(&net, &cyclone);
}
