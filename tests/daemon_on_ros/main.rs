//! Traffic lights and turn signal decisions end to end: scenarios, and what others say over ROS 2, come out of
//! the built binary at a reader of another make.
//!
//! `SIGNAL_GATEWAY_PEER_PYTHON` names a Python with `cyclonedds==11.0.1`; tests that need it say so and
//! pass without. Everything happens on the loopback.

#![cfg(feature = "ros")]
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod arbiter;
mod drive;
mod faults;
mod inputs;
mod joining;
mod notes;
mod peer;
#[path = "../vcan_gateway/process.rs"]
mod process;
mod scenario;
mod stale;
mod words;

use peer::{Python, Reader, Wanted, Writer};
use process::{Folder, Process};

const SCENARIO: &str = include_str!("crossing.xosc");
const MAP: &str = include_str!("../maps/crossroads.osm");

/// A gateway without a vehicle, and a peer.
struct Bench {
    python: Python,
    folder: Folder,
    domain: u32,
}

impl Bench {
    /// `[traffic_lights]` with these keys, the crossroads, and `crossing.xosc` beside; `None` after saying
    /// what is skipped.
    fn new(test: &str, keys: &str) -> Option<Self> {
        let python = Python::for_test(test)?;
        let ros = process::ros();
        let domain = ros.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
        Some(Self { python, folder: folder(&format!("{ros}[traffic_lights]\n{keys}")), domain })
    }

    fn run(&self) -> Process {
        Process::run(&self.folder)
    }

    fn reader(&self, wanted: &[Wanted<'_>]) -> Reader {
        Reader::start(&self.python, self.domain, wanted)
    }

    fn writer(&self, topics: &[(&str, &str)]) -> Writer {
        Writer::start(&self.python, self.domain, topics)
    }
}

/// A configuration beside the crossroads and their scenario.
fn folder(configuration: &str) -> Folder {
    let folder = Folder::with_configuration(configuration);
    add_crossing(&folder);
    folder
}

fn add_crossing(folder: &Folder) {
    folder.write("crossroads.osm", MAP);
    folder.write("crossing.xosc", SCENARIO);
}
