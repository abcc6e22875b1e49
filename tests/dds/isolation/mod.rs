//! The network side as a process: attacked, killed, stopped; the gateway runs on and starts another.

mod busy;
mod latency;
mod memory;

use std::fs::{self, File};
use std::process::Command;
use std::time::{Duration, Instant};

use rustix::io::FdFlags;
use serde_json::Value;

use super::delivery::{TURN, is_report};
use super::session::{Gateway, Role};
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process, ros_in};
use crate::support::rtps::{Attack, Mutations, Target, announcement};
use crate::support::waiting::{Pace, wait_for, wait_until};

/// Packets of each attack, one each 50 ms.
const ATTACKS: u32 = 40;
/// What the gateway's own process may grow by under attack, kB: what a late answer or a longer line takes.
const MAX_GROWTH: u64 = 8 * 1024;

/// The network process of a process.
pub(crate) fn network_process(parent: u32) -> Option<u32> {
    let processes =
        fs::read_dir("/proc").unwrap().filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let mut processes = processes.filter(|process: &u32| {
        let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        let mut words = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
        words.next() != Some("Z") && words.next() == Some(&parent.to_string())
    });
    processes.next()
}

/// Waits for another network process than `before`.
fn next_network_process(parent: u32, before: Option<u32>) -> u32 {
    wait_for("another network process", || network_process(parent).filter(|process| Some(*process) != before))
}

pub(crate) fn signal(name: &str, process: u32) {
    assert!(Command::new("kill").args([name, &process.to_string()]).status().unwrap().success());
}

/// A number of `/proc/PROCESS/status`.
fn status_of(process: u32, key: &str) -> u64 {
    status_if_there(process, key).unwrap()
}

/// Likewise; `None` when the process is gone.
pub(crate) fn status_if_there(process: u32, key: &str) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'))?;
    line.split_whitespace().next()?.parse().ok()
}

fn is_up(status: &Value) -> bool {
    status["up"] == true
}

fn restarts(gateway: &Gateway) -> u64 {
    gateway.status()["restarts"].as_u64().unwrap()
}

#[test]
fn a_network_process_that_is_killed_or_stopped_is_replaced_and_readers_get_the_current_report() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").isolated().start();
    let turn_reader = || cyclone.topic_reader(domain, "turn", TURN, "transient_local");
    let early = turn_reader();
    gateway.send("turn left 1");
    early.next("a report", is_report(2, 1));
    let mut process = next_network_process(gateway.id(), None);
    for name in ["-KILL", "-STOP", "-ABRT"] {
        let (start, before) = (Instant::now(), restarts(&gateway));
        let mark = early.mark();
        signal(name, process);
        process = next_network_process(gateway.id(), Some(process));
        let replaced = start.elapsed();
        let is_another = |status: &Value| status["restarts"].as_u64().unwrap() > before && is_up(status);
        let status = gateway.wait_until("another network side", is_another);
        early.wait_for(mark, "the report again", is_report(2, 1));
        println!("{name}: replaced after {replaced:?}, report back after {:?}: {status}", start.elapsed());
        let late = turn_reader();
        late.next("the current report", is_report(2, 1));
    }
    gateway.send("turn right 2");
    early.next("the next report", is_report(3, 2));
    println!("stop: {:?}", gateway.stop());
    assert!(network_process(std::process::id()).is_none_or(|other| other != process));
}

/// Even one that was stopped, and could not see the end.
#[test]
fn a_network_process_ends_after_its_gateway() {
    let gateway = Role::new(domain()).only_on("127.0.0.1").isolated().start();
    gateway.wait_until("a network side", is_up);
    let process = next_network_process(gateway.id(), None);
    signal("-STOP", process);
    signal("-KILL", gateway.id());
    let start = Instant::now();
    wait_until("the end of the network process", || {
        fs::read_to_string(format!("/proc/{process}/stat")).map_or(true, |stat| stat.contains(") Z "))
    });
    println!("it ended {:?} after the gateway", start.elapsed());
}

#[test]
fn a_packet_that_takes_dds_down_does_not_take_the_gateway_down() {
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").isolated().start();
    gateway.send("turn left 1");
    gateway.wait_until("a network side", is_up);
    let target = Target::new(domain);
    let before = status_of(gateway.id(), "VmRSS");
    for (attack, is_announced) in
        [(Attack::Heartbeat, true), (Attack::Gap, true), (Attack::Fragment, true), (Attack::Fragment, false)]
    {
        let (begun, first) = (Instant::now(), restarts(&gateway));
        let mut slowest = Duration::ZERO;
        let mut pace = Pace::every(Duration::from_millis(50));
        for count in 1..=ATTACKS {
            strike(&target, attack, is_announced, count);
            pace.wait();
            let start = Instant::now();
            gateway.status();
            slowest = slowest.max(start.elapsed());
        }
        let ended = Instant::now();
        gateway.wait_until("a network side", is_up);
        println!(
            "{attack:?}, announced {is_announced}: {:?} of packets, {} network sides lost, the gateway answered \
             within {slowest:?}, up again after {:?}, memory {before} to {} kB",
            ended - begun,
            restarts(&gateway) - first,
            ended.elapsed(),
            status_of(gateway.id(), "VmRSS")
        );
    }
    let (mut count, mut pace) = (ATTACKS, Pace::every(Duration::from_millis(50)));
    wait_until("the end of a network process: does RustDDS bear all of this now?", || {
        count += 1;
        strike(&target, Attack::Heartbeat, true, count);
        pace.wait();
        restarts(&gateway) > 0
    });
    gateway.wait_until("a network side", is_up);
    let after = status_of(gateway.id(), "VmRSS");
    assert!(after < before + MAX_GROWTH, "memory of the gateway: {before} kB, then {after} kB");
    println!("stop: {:?}", gateway.stop());
}

/// One attack of a series.
fn strike(target: &Target, attack: Attack, is_announced: bool, count: u32) {
    if is_announced {
        target.send(&announcement(target.own_port(), count));
    }
    target.send(&attack.packet(count));
}

#[test]
fn mutated_packets_do_not_take_the_gateway_down() {
    mutated_packets(5_000);
}

/// Sends packets of all kinds in which some bytes are others.
fn mutated_packets(count: u32) {
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").isolated().start();
    let target = Target::new(domain);
    let before = status_of(gateway.id(), "VmRSS");
    let mut mutations = Mutations::of(target.capture());
    let begun = Instant::now();
    for number in 1..=count {
        target.send(&mutations.next(target.own_port()));
        if number.is_multiple_of(100) {
            gateway.status();
        }
    }
    let ended = Instant::now();
    gateway.wait_until("a network side", is_up);
    let after = status_of(gateway.id(), "VmRSS");
    println!(
        "{count} packets in {:?}: {} network sides lost, up again after {:?}, memory {before} to {after} kB",
        ended - begun,
        restarts(&gateway),
        ended.elapsed()
    );
    assert!(after < before + MAX_GROWTH, "memory of the gateway: {before} kB, then {after} kB");
}

#[test]
fn the_daemon_reports_its_network_process_which_has_few_privileges_left() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let folder = Folder::with_demo_vehicle("sg-none0", &ros_in(domain));
    let reader = cyclone.topic_reader(domain, "diagnostics", "rt/diagnostics", "volatile");
    // As a shell may leave it to whatever it starts.
    let left_open = File::open(folder.path().join("gateway.toml")).unwrap();
    rustix::io::fcntl_setfd(&left_open, FdFlags::empty()).unwrap();
    let mut gateway = Process::run(&folder);
    drop(left_open);
    let ros = |mark: Mark, what: &str, is_it: &dyn Fn(&Value) -> bool| {
        reader.find(mark, what, |(_, line)| {
            let statuses = line["data"]["status"].as_array()?;
            let ros = |status: &&Value| status["name"].as_str().is_some_and(|name| name.ends_with(": ros"));
            statuses.iter().find(ros).filter(|status| is_it(status)).cloned()
        })
    };
    let joined = ros(Mark::START, "that it has joined", &|status| status["message"] == "joined");
    println!("{joined}");
    let process = next_network_process(gateway.id(), None);
    let limits = fs::read_to_string(format!("/proc/{process}/limits")).unwrap();
    println!("{limits}");
    assert_eq!(status_of(process, "Seccomp"), 2);
    assert_eq!(status_of(process, "NoNewPrivs"), 1);
    for set in ["CapInh", "CapPrm", "CapEff", "CapAmb"] {
        assert_eq!(status_of(process, set), 0, "{set}");
    }
    let has_left_open = |process| descriptors(process).iter().any(|link| link.ends_with("gateway.toml"));
    assert!(has_left_open(gateway.id()) && !has_left_open(process), "{:?}", descriptors(process));
    let score = fs::read_to_string(format!("/proc/{process}/oom_score_adj")).unwrap();
    assert_eq!(score.trim(), "500");
    for key in ["VmPeak", "VmData", "VmRSS", "Threads", "FDSize"] {
        println!("{key}: {}", status_of(process, key));
    }
    let (ours, theirs) = (sockets(gateway.id()), sockets(process));
    assert!(!theirs.is_empty() && theirs.iter().all(|socket| !ours.contains(socket)), "{ours:?} {theirs:?}");
    let mark = reader.mark();
    signal("-KILL", process);
    let replaced = ros(mark, "that it was replaced", &|status| {
        status["message"] == "the network side was replaced: killed by signal 9"
    });
    assert_eq!(replaced["level"], 1, "{replaced}");
    println!("{replaced}\nSIGTERM: {:?}", gateway.stop("TERM"));
}

/// The sockets that a process has open.
fn sockets(process: u32) -> Vec<String> {
    descriptors(process).into_iter().filter(|link| link.starts_with("socket:")).collect()
}

/// What the descriptors of a process stand for.
fn descriptors(process: u32) -> Vec<String> {
    let links = fs::read_dir(format!("/proc/{process}/fd")).unwrap();
    links.filter_map(|link| fs::read_link(link.ok()?.path()).ok()?.to_str().map(str::to_owned)).collect()
}

/// Nobody reads standard error; only the network process has something to write.
#[test]
fn log_lines_that_the_network_process_drops_are_counted() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let folder = Folder::with_demo_vehicle("sg-none0", &ros_in(domain));
    let reader = cyclone.topic_reader(domain, "diagnostics", "rt/diagnostics", "volatile");
    let (unread, full) = std::io::pipe().unwrap();
    let gateway = Process::run_with(&folder, |command| {
        command.env("RUST_LOG", "off,rustdds=trace").stderr(full);
    });
    let value = |status: &Value, key: &str| {
        let values = status["values"].as_array()?;
        let value = values.iter().find(|value| value["key"] == key)?;
        value["value"].as_str()?.parse::<u64>().ok()
    };
    let dropped = reader.find(Mark::START, "lines that were dropped", |(_, line)| {
        let statuses = line["data"]["status"].as_array()?;
        let log = statuses
            .iter()
            .find(|status| status["name"].as_str().is_some_and(|name| name.ends_with(": log")))?;
        value(log, "dropped_lines").filter(|dropped| *dropped > 0)
    });
    println!("{dropped} lines dropped");
    drop((gateway, unread));
}
