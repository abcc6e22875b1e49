//! Networks that go, come back, or offer little: peers are found again by the same process.

use std::process::Command;
use std::sync::atomic::{AtomicU16, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::bench::{Gateway, Side, domain};
use super::cyclone::{Reader, Writer, python};

const TURN: &str = "rt/vehicle/status/turn_indicators_status";

/// Cyclone on the loopback, with multicast.
const ON_LOOPBACK: &str = "<CycloneDDS><Domain><General><AllowMulticast>true</AllowMulticast><Interfaces>\
    <NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>";

/// Two hosts joined by a switch, or one host with nothing but a loopback.
struct Net {
    names: Vec<String>,
}

impl Net {
    /// `count` hosts with a loopback each, or `None` after saying what is skipped.
    fn new(test: &str, count: u16) -> Option<Self> {
        static NEXT: AtomicU16 = AtomicU16::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut net = Self { names: vec![] };
        for host in 0..count {
            let name = format!("sg{}n{number}h{host}", std::process::id());
            let made = Command::new("ip").args(["netns", "add", &name]).output();
            if !made.is_ok_and(|output| output.status.success()) {
                println!("skipped: {test}: no network namespaces (needs root and iproute2)");
                return None;
            }
            net.names.push(name);
            net.ip(host, "link set lo up");
        }
        Some(net)
    }

    fn name(&self, host: u16) -> &str {
        &self.names[usize::from(host)]
    }

    fn ip(&self, host: u16, command: &str) {
        let output =
            Command::new("ip").args(["-n", self.name(host)]).args(command.split(' ')).output().unwrap();
        assert!(output.status.success(), "ip {command}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Joins hosts 0 and 1 by a switch, host 2, with the ports `port0` and `port1`; they get the
    /// addresses 10.77.0.1 and 10.77.0.2 on `cable`.
    fn plug(&self) {
        self.ip(2, "link add switch type bridge mcast_snooping 0");
        self.ip(2, "link set switch up");
        for host in [0, 1] {
            self.ip(host, &format!("link add cable type veth peer name port{host} netns {}", self.name(2)));
            self.ip(host, &format!("addr add 10.77.0.{}/24 dev cable", host + 1));
            self.ip(host, "link set cable up");
            self.ip(2, &format!("link set port{host} master switch up"));
        }
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        for name in &self.names {
            let _ = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}

fn has_report(report: u8, sec: i32) -> impl Fn(&Value) -> bool {
    move |line| {
        let data = &line["data"];
        line["event"] == "sample" && data["report"] == report && data["stamp"]["sec"] == sec
    }
}

/// Whether slow tests are wanted; says what is skipped.
fn slow(test: &str) -> bool {
    let wanted = std::env::var_os("SIGNAL_GATEWAY_SLOW_TESTS").is_some();
    if !wanted {
        println!("skipped: {test}: takes more than a minute; set SIGNAL_GATEWAY_SLOW_TESTS");
    }
    wanted
}

/// As short as tests like it; the environment can ask for another one.
fn lease() -> String {
    std::env::var("SIGNAL_GATEWAY_PEER_LEASE").unwrap_or_else(|_| "2s".to_owned())
}

/// Cyclone with that lease, and more settings of its discovery.
fn cyclone(lease: &str, discovery: &str) -> String {
    format!(
        "<CycloneDDS><Domain><Discovery><LeaseDuration>{lease}</LeaseDuration>{discovery}</Discovery>\
         <Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>"
    )
}

#[test]
fn after_an_outage_longer_than_the_lease_reports_flow_again_and_others_miss_nothing() {
    let test = "after_an_outage_longer_than_the_lease_reports_flow_again_and_others_miss_nothing";
    recover_from_outages(test, &cyclone(&lease(), ""));
}

/// Cyclone asks addresses that never answered every 30 s, if told not to forget them.
#[test]
fn without_multicast_too_reports_flow_again_after_an_outage_and_others_miss_nothing() {
    let test = "without_multicast_too_reports_flow_again_after_an_outage_and_others_miss_nothing";
    if !slow(test) {
        return;
    }
    let unicast = "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"10.77.0.1\" PruneDelay=\"inf\"/></Peers></Discovery>\
        <General><AllowMulticast>false</AllowMulticast></General><Discovery>";
    recover_from_outages(test, &cyclone(&lease(), unicast));
}

fn recover_from_outages(test: &str, config: &str) {
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    net.plug();
    let domain = domain();
    let reader = |host| {
        let namespace = Some(net.name(host));
        let durability = if host == 0 { "volatile" } else { "transient_local" };
        Reader { python: &python, domain, kind: "turn", topic: TURN, durability, config, namespace }.start()
    };
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "transient_local");
    let (near, far) = (reader(0), reader(1));
    let (namespace, durability) = (Some(net.name(1)), "volatile");
    let far_diagnostics = Reader {
        python: &python,
        domain,
        kind: "diagnostics",
        topic: "rt/diagnostics",
        durability,
        config,
        namespace,
    }
    .start();
    gateway.wait_until("both readers", |status| status["readers"][0] == 2);
    near.wait_for("a match", |line| line["event"] == "matched");
    let mut number = 0;
    let mut speak = |gateway: &mut Gateway| {
        number += 1;
        gateway.tell(&format!("turn left {number}"));
        gateway.tell(&format!("diagnostics {number}"));
        number
    };
    let first = speak(&mut gateway);
    far.wait_for("a report before the outage", has_report(2, first));

    // The first outage is seen by the gateway's host, the second happens elsewhere.
    for (outage, port) in [(1, "port0"), (2, "port1")] {
        net.ip(2, &format!("link set {port} down"));
        let mut status = gateway.status();
        let down = Instant::now();
        while status["missing"] != 2 {
            assert!(down.elapsed() < Duration::from_secs(30), "the far peer is not missed: {status}");
            speak(&mut gateway);
            thread::sleep(Duration::from_millis(50));
            status = gateway.status();
        }
        // Long enough for the lookout to be made, and for the far side to be lost to it for good.
        for _ in 0..60 {
            speak(&mut gateway);
            thread::sleep(Duration::from_millis(50));
        }
        let last = speak(&mut gateway);
        net.ip(2, &format!("link set {port} up"));
        let up = Instant::now();
        far.wait_for("the current report after the outage", has_report(2, last));
        println!("outage at {port}: {:?} long, recovered in {:?}", up - down, up.elapsed());
        let following = speak(&mut gateway);
        far.wait_for("the next report", has_report(2, following));
        for _ in 0..40 {
            speak(&mut gateway);
            thread::sleep(Duration::from_millis(50));
        }
        let status = gateway.status();
        assert_eq!((&status["rebuilds"], &status["missing"]), (&json!(outage), &json!(0)), "{status}");
        assert_eq!(status["write_errors"], 0);
        let newest = speak(&mut gateway).to_string();
        far_diagnostics.wait_for("diagnostics", |line| line["data"]["status"][0]["message"] == newest);
    }
    // Reports may overtake each other while a participant is made, for some 10 ms.
    let last = speak(&mut gateway);
    let mut newest = first;
    while newest < last {
        let sample = near.wait_for("reports without a gap", |line| line["event"] == "sample");
        let seen = i32::try_from(sample["data"]["stamp"]["sec"].as_i64().unwrap()).unwrap();
        assert!(seen <= newest + 10, "the near reader missed what lies between {newest} and {seen}");
        newest = newest.max(seen);
    }
}

/// The far writer is found again by the new participant's readers; the near one is read by both
/// participants for a while, and each of its commands counts once.
#[test]
fn after_an_outage_commands_are_received_again_and_none_twice() {
    let test = "after_an_outage_commands_are_received_again_and_none_twice";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    net.plug();
    let (domain, config) = (domain(), &cyclone(&lease(), ""));
    let mut gateway = Gateway::start_with_lights(Some(net.name(0)), domain);
    let writer = |host, kind, topic, durability| {
        let namespace = Some(net.name(host));
        let reliability = "reliable";
        Writer { python: &python, domain, kind, topic, reliability, durability, config, namespace }.start()
    };
    let mut far = writer(1, "text", "rt/commands", "volatile");
    let mut far_groups = writer(1, "groups", "rt/groups", "volatile");
    // A new reader of this one is handed all it said before.
    let mut near = writer(0, "text", "rt/kept_commands", "transient_local");
    gateway.wait_until("the writers", |status| {
        [0, 1, 3].iter().all(|position| status["incoming"][*position]["writers"] == 1)
    });
    let mut said = 0;
    let mut say = |near: &mut Side| {
        said += 1;
        near.tell(&said.to_string());
        thread::sleep(Duration::from_millis(50));
    };
    far.tell("before");
    say(&mut near);
    gateway.wait_for("a command before the outage", |line| line["what"]["text"] == "before");
    net.ip(2, "link set port1 down");
    let mut seen = vec![];
    while gateway.status()["missing"] != 2 {
        say(&mut near);
    }
    for _ in 0..60 {
        say(&mut near);
    }
    net.ip(2, "link set port1 up");
    let up = Instant::now();
    while gateway.status()["rebuilds"] != 1 {
        assert!(up.elapsed() < Duration::from_secs(60), "no new participant");
        say(&mut near);
    }
    println!("commands: recovered in {:?}", up.elapsed());
    for _ in 0..40 {
        say(&mut near);
    }
    gateway.wait_until("the far writers", |status| {
        [0, 1, 3].iter().all(|position| status["incoming"][*position]["writers"] == 1)
    });
    // The new reader must be known there as well: nothing volatile is kept for it.
    for writer in [&far, &far_groups] {
        writer.wait_for("the new reader", |line| line["event"] == "matched");
    }
    far.tell("after");
    far_groups.tell("5 1 1 1 2 1.0");
    near.tell("end");
    let (mut after, mut groups, mut end) = (false, false, false);
    while !(after && groups && end) {
        let line = gateway.wait_for("what was sent", |line| line["event"] == "arrived");
        after |= line["what"]["text"] == "after";
        groups |= line["what"]["sec"] == 5;
        end |= line["what"]["text"] == "end";
        seen.push(line);
    }
    let total = gateway.status()["incoming"][3]["received"].clone();
    assert_eq!(total, said + 1, "each command of the near writer counts once");
}

/// A volatile writer hands nothing to a reader it has just met; here the reader is an old acquaintance.
#[test]
fn a_volatile_report_that_changed_during_an_outage_arrives_after_it() {
    let test = "a_volatile_report_that_changed_during_an_outage_arrives_after_it";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    net.plug();
    let (domain, kind, topic, durability) = (domain(), "turn", TURN, "volatile");
    let (config, namespace) = (&cyclone(&lease(), ""), Some(net.name(1)));
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "volatile");
    let far = Reader { python: &python, domain, kind, topic, durability, config, namespace }.start();
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    far.wait_for("a match", |line| line["event"] == "matched");
    net.ip(2, "link set port1 down");
    gateway.wait_until("the loss of the reader", |status| status["missing"] == 1);
    gateway.tell("turn right 2");
    thread::sleep(Duration::from_secs(4)); // the lookout looks
    net.ip(2, "link set port1 up");
    far.wait_for("the report", has_report(3, 2));
}

/// The peer forgot us, we did not forget the peer.
#[test]
fn after_an_outage_longer_than_our_lease_but_not_the_peers_reports_flow_again() {
    let test = "after_an_outage_longer_than_our_lease_but_not_the_peers_reports_flow_again";
    if !slow(test) {
        return;
    }
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    net.plug();
    let domain = domain();
    let config = &cyclone("200s", "");
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "transient_local");
    let readers = ["transient_local", "volatile"].map(|durability| {
        let namespace = Some(net.name(1));
        Reader { python: &python, domain, kind: "turn", topic: TURN, durability, config, namespace }.start()
    });
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    for reader in &readers {
        reader.wait_for("a match", |line| line["event"] == "matched");
    }
    gateway.tell("turn left 1");
    net.ip(2, "link set port1 down");
    for reader in &readers {
        reader.wait_for("the loss of the gateway", |line| line["event"] == "unmatched");
    }
    gateway.tell("turn right 2");
    net.ip(2, "link set port1 up");
    let up = Instant::now();
    readers[0].wait_for("the current report", has_report(3, 2));
    println!("our lease: recovered in {:?}, {}", up.elapsed(), gateway.status());
    gateway.tell("turn left 3");
    for reader in &readers {
        reader.wait_for("the next report", has_report(2, 3));
    }
}

#[test]
fn a_killed_peer_is_looked_for_without_disturbing_anybody() {
    let Some(python) = python("a_killed_peer_is_looked_for_without_disturbing_anybody") else { return };
    let (domain, config) = (domain(), cyclone(&lease(), ""));
    let reader = || {
        let (durability, namespace) = ("transient_local", None);
        Reader { python: &python, domain, kind: "turn", topic: TURN, durability, config: &config, namespace }
            .start()
    };
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let (healthy, victim, leaver) = (reader(), reader(), reader());
    gateway.wait_until("three readers", |status| status["readers"][0] == 3);
    drop(leaver);
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    assert_eq!(gateway.status()["missing"], 0, "who says goodbye is not missed");
    victim.kill();
    gateway.wait_until("one reader", |status| status["readers"][0] == 1);
    gateway.wait_until("one missing", |status| status["missing"] == 1);
    thread::sleep(Duration::from_secs(4)); // the lookout looks
    gateway.tell("turn left 1");
    healthy.wait_for("a report", has_report(2, 1));
    let again = reader();
    again.wait_for("the current report", has_report(2, 1));
    let status = gateway.status();
    assert_eq!((&status["rebuilds"], &status["missing"]), (&json!(0), &json!(1)), "{status}");
    assert!(healthy.during(Duration::ZERO).iter().all(|line| line["event"] != "unmatched"));
    let took = gateway.stop();
    println!("stop took {took:?} with a lookout");
    assert!(took < Duration::from_millis(500));
}

#[test]
fn an_address_that_comes_after_the_start_is_used() {
    let test = "an_address_that_comes_after_the_start_is_used";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    let domain = domain();
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "transient_local");
    gateway.tell("turn left 1");
    net.plug();
    let plugged = Instant::now();
    let namespace = Some(net.name(1));
    let durability = "transient_local";
    let far =
        Reader { python: &python, domain, kind: "turn", topic: TURN, durability, config: "", namespace }
            .start();
    far.wait_for("the current report", has_report(2, 1));
    println!("new address used after {:?}", plugged.elapsed());
    assert_eq!(gateway.status()["rebuilds"], 1);
}

#[test]
fn networks_that_were_not_named_are_not_used() {
    let test = "networks_that_were_not_named_are_not_used";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 3) else { return };
    net.plug();
    net.ip(0, "link set lo multicast on");
    let (domain, kind, topic, durability) = (domain(), "turn", TURN, "transient_local");
    let reader = |host, config| {
        let namespace = Some(net.name(host));
        Reader { python: &python, domain, kind, topic, durability, config, namespace }.start()
    };
    let (near, far) = (reader(0, ON_LOOPBACK), reader(1, ""));
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "transient_local 127.0.0.1");
    gateway.tell("turn left 1");
    near.wait_for("a report on the named network", has_report(2, 1));
    let seen = far.during(Duration::from_secs(3));
    assert!(seen.is_empty(), "{seen:?}");
    drop(gateway);
    let mut gateway = Gateway::start(Some(net.name(0)), domain, "transient_local 10.77.0.1");
    gateway.tell("turn right 2");
    far.wait_for("a report on the named network", has_report(3, 2));
}

/// Both orders of start, so that each side comes to have the first unicast port once.
fn exchange_on_loopback(net: &Net, python: &std::path::Path, config: &str) {
    let reader = |domain| -> Side {
        let (durability, namespace) = ("transient_local", Some(net.name(0)));
        Reader { python, domain, kind: "turn", topic: TURN, durability, config, namespace }.start()
    };
    let domain_a = domain();
    let mut gateway = Gateway::start(Some(net.name(0)), domain_a, "transient_local");
    gateway.tell("turn left 1");
    reader(domain_a).wait_for("a report from a gateway that was first", has_report(2, 1));

    let domain_b = domain();
    let first = reader(domain_b);
    let mut gateway = Gateway::start(Some(net.name(0)), domain_b, "transient_local");
    gateway.tell("turn right 2");
    first.wait_for("a report from a gateway that was second", has_report(3, 2));
}

#[test]
fn a_loopback_without_multicast_is_enough() {
    let test = "a_loopback_without_multicast_is_enough";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 1) else { return };
    net.ip(0, "link set lo multicast off");
    let config = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>\
        <NetworkInterface name=\"lo\"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>\
        <Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";
    exchange_on_loopback(&net, &python, config);
}

#[test]
fn a_loopback_with_multicast_is_enough() {
    let test = "a_loopback_with_multicast_is_enough";
    let Some(python) = python(test) else { return };
    let Some(net) = Net::new(test, 1) else { return };
    net.ip(0, "link set lo multicast on");
    exchange_on_loopback(&net, &python, ON_LOOPBACK);
}
