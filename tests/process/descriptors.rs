//! What comes and goes leaves no descriptor open: clients, requests, reloads.

use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;

use crate::support::http::{ask, free_address};
use crate::support::process::{Folder, Process};
use crate::support::waiting::{described, wait_for, wait_until};

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
fn come_and_go(gateway: &mut Process, folder: &Folder, address: SocketAddr, round: usize) {
    for path in ["/metrics", "/", "/nothing"] {
        wait_for("an answer", || ask(address, &format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n")));
    }
    let socket = folder.path().join("status.sock");
    let client = BufReader::new(UnixStream::connect(&socket).unwrap());
    assert!(client.lines().next().is_some_and(|line| line.is_ok()), "the status socket");
    // One that leaves without reading.
    drop(UnixStream::connect(&socket));
    gateway.signal("HUP");
    gateway.wait_for_logs("configuration reloaded", round);
}

#[test]
fn clients_and_reloads_leave_no_descriptor_open() {
    let address = free_address();
    let keys = format!(
        "[status]\nsocket = \"status.sock\"\n[ros]\nenabled = false\n[http]\naddress = \"{address}\"\n"
    );
    let folder = Folder::with_demo_vehicle("no-such-can", &keys);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("no-such-can is missing");
    // What is opened by the first of each stays.
    come_and_go(&mut gateway, &folder, address, 1);
    let before = open(gateway.id()).len();
    for round in 2..12 {
        come_and_go(&mut gateway, &folder, address, round);
    }
    let what = described(|| format!("{before} descriptors again, not {:#?}", open(gateway.id())));
    wait_until(what, || open(gateway.id()).len() <= before);
}
