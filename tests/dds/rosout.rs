//! `/rosout` of a session, as readers that come early or late see it.

use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::Duration;

use serde_json::Value;

use super::session::{Gateway, Role};
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, Reading, domain};
use crate::support::prerequisite::require;
use crate::support::waiting::Pace;

const ROSOUT: Reading<'_> = Reading { kind: "log", topic: "rt/rosout", durability: "transient_local" };

/// Readers that are tried: one that takes 10 s from its beginning until it meets the writer is handed
/// nothing.
const ATTEMPTS: usize = 10;
/// Time for which one that has met the writer is waited for.
const PATIENCE: Duration = Duration::from_secs(10);

fn has_text(text: &str) -> impl Fn(&Value) -> bool {
    move |line| line["event"] == "sample" && line["data"]["msg"] == text
}

/// The number of one of the warnings that come while a reader starts, and when it was warned of, nanoseconds.
fn numbered(line: &Value) -> Option<(i64, i64)> {
    let number = line["data"]["msg"].as_str()?.strip_prefix("turn: number ")?.parse().ok()?;
    let stamp = &line["data"]["stamp"];
    Some((number, stamp["sec"].as_i64()? * 1_000_000_000 + stamp["nanosec"].as_i64()?))
}

/// Sets a flag when it is dropped.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Starts a reader while numbered warnings come, one each second, and waits until it has met the writer: then
/// some are of the last 10 s. Gives the time since which it reads, nanoseconds, and the number of the last
/// warning.
fn reader_amid_warnings(gateway: &Gateway, cyclone: &Cyclone, domain: u16) -> (JsonProcess, i64, i64) {
    let (is_over, last) = (AtomicBool::new(false), AtomicI64::new(0));
    let reader = std::thread::scope(|scope| {
        let over = Over(&is_over);
        scope.spawn(|| {
            let mut pace = Pace::every(Duration::from_secs(1));
            while !is_over.load(Ordering::Relaxed) {
                let number = last.fetch_add(1, Ordering::Relaxed) + 1;
                gateway.send(&format!("warn turn: number {number}"));
                pace.wait();
            }
        });
        let reader = cyclone.reader(domain, &[ROSOUT]);
        reader.next("the writer", |line| line["event"] == "matched");
        drop(over);
        reader
    });
    let (_, ready) = reader.wait_for(Mark::START, "its start", |line| line["event"] == "ready");
    let since = ready["since"].as_i64().unwrap();
    (reader, since, last.into_inner())
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

    let reaches_the_late = (0..ATTEMPTS).any(|_| {
        let (late, since, _) = reader_amid_warnings(&gateway, &cyclone, domain);
        let is_earlier = |(_, at): &(i64, i64)| *at < since;
        late.find_within(PATIENCE, Mark::START, |(_, line)| numbered(line).filter(is_earlier)).is_some()
    });
    assert!(reaches_the_late, "no late reader was handed a warning of the last 10 s");
}

#[test]
fn warnings_wait_for_the_first_reader() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").with_rosout().start();
    let is_handed_over = (0..ATTEMPTS).any(|_| {
        let (reader, since, last) = reader_amid_warnings(&gateway, &cyclone, domain);
        let is_last = |(number, _): &(i64, i64)| *number == last;
        let found = reader.find_within(PATIENCE, Mark::START, |(_, line)| numbered(line).filter(is_last));
        let received: Vec<_> =
            reader.lines(Mark::START).iter().filter_map(|(_, line)| numbered(line)).collect();
        let Some((first, at)) = found.and(received.first().copied()) else { return false };
        let numbers: Vec<_> = received.iter().map(|(number, _)| *number).collect();
        if gateway.is_undisturbed() {
            assert_eq!(numbers, (first..=last).collect::<Vec<_>>(), "each once, in order");
        }
        at < since
    });
    assert!(is_handed_over, "the first reader did not get the warnings of the last 10 s");
}
