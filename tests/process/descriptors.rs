//! What comes and goes leaves no descriptor open: clients, requests, reloads.

use std::io::{BufRead as _, BufReader};
use std::os::unix::net::UnixStream;
use std::path::Path;

use super::metrics_endpoint::Gateway;
use crate::support::waiting::{described, wait_until};

/// What the process has open, by what each descriptor leads to.
fn open(process: u32) -> Vec<String> {
    let links = std::fs::read_dir(format!("/proc/{process}/fd")).unwrap();
    let mut links: Vec<String> = links
        .filter_map(|link| Some(std::fs::read_link(link.ok()?.path()).ok()?.display().to_string()))
        .collect();
    links.sort_unstable();
    links
}

/// A client of each kind comes and goes, and the configuration is read again.
fn come_and_go(gateway: &mut Gateway, round: usize) {
    for path in ["/metrics", "/", "/nothing"] {
        gateway.get(path);
    }
    let socket: &Path = &gateway.folder().join("status.sock");
    let client = BufReader::new(UnixStream::connect(socket).unwrap());
    assert!(client.lines().next().is_some_and(|line| line.is_ok()), "the status socket");
    // One that leaves without reading.
    drop(UnixStream::connect(socket));
    gateway.process().signal("HUP");
    gateway.process().wait_for_logs("configuration reloaded", round);
}

#[test]
fn clients_and_reloads_leave_no_descriptor_open() {
    let mut gateway = Gateway::run("[status]\nsocket = \"status.sock\"\n");
    // What is opened by the first of each stays.
    come_and_go(&mut gateway, 1);
    let process = gateway.process().id();
    let before = open(process).len();
    for round in 2..12 {
        come_and_go(&mut gateway, round);
    }
    let what = described(|| format!("{before} descriptors again, not {:#?}", open(process)));
    wait_until(what, || open(process).len() <= before);
}
