//! The demo publishes what it invents on this computer alone, in a domain of its own, and says how to listen.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::delivery::{Peer as _, TURN};
use super::fast_dds::FastDds;
use super::network::Net;
use super::two_hosts::sent;
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, inside};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process};

/// What the demo says of its domain and of Cyclone DDS; the first test shows it.
const DEMO_DOMAIN: u16 = 100;
const CYCLONE_ON_LOOPBACK: &str =
    r#"<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>"#;

fn demo(folder: &Folder, change: impl FnOnce(&mut Command)) -> Process {
    Process::start(folder.path(), |command| {
        // On a vehicle PC it is that of the vehicle.
        command.args(["demo", "--plain", "--repeat"]).env("ROS_DOMAIN_ID", "19");
        change(command);
    })
}

/// The text between two others in a line of the log; fails without it.
fn between(log: &[String], before: &str, after: &str) -> String {
    let found = log.iter().find_map(|line| Some(line.split_once(before)?.1.split_once(after)?.0));
    found.unwrap_or_else(|| panic!("{before:?} is not in {log:#?}")).to_owned()
}

fn wait_for_report(reader: &JsonProcess) {
    reader.next("a report", |line| line["event"] == "sample");
}

#[test]
fn the_lines_that_the_demo_prints_listen_to_it() {
    let cyclone = require!(Cyclone::with_defaults());
    let fast_dds = require!(FastDds::with_all_transports());
    let folder = Folder::with_configuration("");
    let mut demo = demo(&folder, |_| {});
    demo.wait_for_log("with rmw_cyclonedds_cpp");
    let log = demo.log();
    let domain = between(&log, "ROS_DOMAIN_ID=", " ros2 topic echo /vehicle/status/turn_indicators_status");
    let domain: u16 = domain.parse().unwrap();
    let uri = between(&log, "export CYCLONEDDS_URI='", "'");
    assert_eq!((domain, &*uri), (DEMO_DOMAIN, CYCLONE_ON_LOOPBACK));
    wait_for_report(&fast_dds.reader(domain, "turn", TURN, "volatile"));
    wait_for_report(&cyclone.configured(&uri).topic_reader(domain, "turn", TURN, "volatile"));
}

#[test]
fn nothing_of_the_demo_leaves_this_computer_unless_a_domain_is_given() {
    let cyclone = require!(Cyclone::with_defaults());
    let net = require!(Net::new(3));
    net.plug();
    let folder = Folder::with_configuration("");
    let udp_sent_by = |arguments: &[&str], reader: &Cyclone, domain: u16| {
        let packets = cyclone.inside(net.name(0)).start("packets.py", domain, &["cable"]);
        let demo = demo(&folder, |command| {
            let gateway = PathBuf::from(command.get_program());
            let mut namespaced = inside(Some(net.name(0)), &gateway);
            namespaced.args(command.get_args()).args(arguments).env("ROS_DOMAIN_ID", "19");
            namespaced.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
            *command = namespaced;
        });
        wait_for_report(&reader.topic_reader(domain, "turn", TURN, "volatile"));
        let udp = sent(&packets)["udp"].as_u64().unwrap();
        drop(demo);
        udp
    };
    let here = cyclone.configured(CYCLONE_ON_LOOPBACK).inside(net.name(0));
    assert_eq!(udp_sent_by(&[], &here, DEMO_DOMAIN), 0);
    assert!(udp_sent_by(&["--domain", "19"], &cyclone.inside(net.name(1)), 19) > 0);
}
