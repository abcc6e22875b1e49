//! Hosts of a test's own: network namespaces, and a switch between them.

use std::process::Command;
use std::sync::atomic::{AtomicU16, Ordering};

use crate::support::prerequisite::{Missing, Prerequisite};

/// Cyclone as a host has it that knows the gateway's address, and sends no multicast.
pub(crate) const UNICAST: &str = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>\
    <ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"10.77.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";

/// Two hosts joined by a switch, or one host with nothing but a loopback.
pub(crate) struct Net {
    names: Vec<String>,
}

impl Net {
    /// `count` hosts with a loopback each.
    pub(crate) fn new(count: u16) -> Result<Self, Missing> {
        static NEXT: AtomicU16 = AtomicU16::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut net = Self { names: vec![] };
        for host in 0..count {
            let name = format!("sg{}n{number}h{host}", std::process::id());
            let made = Command::new("ip").args(["netns", "add", &name]).output();
            if !made.is_ok_and(|output| output.status.success()) {
                return Err(Prerequisite::NetworkNamespaces.missing("needs root and iproute2"));
            }
            let entered = Command::new("ip").args(["-n", &name, "link", "set", "lo", "up"]).output().unwrap();
            net.names.push(name);
            if !entered.status.success() {
                let why = String::from_utf8_lossy(&entered.stderr).trim().replace('\n', "; ");
                return Err(Prerequisite::NetworkNamespaces.missing(&why));
            }
        }
        Ok(net)
    }

    pub(crate) fn name(&self, host: u16) -> &str {
        &self.names[usize::from(host)]
    }

    pub(crate) fn ip(&self, host: u16, command: &str) {
        let output =
            Command::new("ip").args(["-n", self.name(host)]).args(command.split(' ')).output().unwrap();
        assert!(output.status.success(), "ip {command}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Joins hosts 0 and 1 by a switch, host 2, with the ports `port0` and `port1`; they get the
    /// addresses 10.77.0.1 and 10.77.0.2 on `cable`.
    pub(crate) fn plug(&self) {
        self.ip(2, "link add switch type bridge mcast_snooping 0");
        self.ip(2, "link set switch up");
        for host in [0, 1] {
            self.ip(host, &format!("link add cable type veth peer name port{host} netns {}", self.name(2)));
            self.ip(host, &format!("addr add 10.77.0.{}/24 dev cable", host + 1));
            self.ip(host, "link set cable up");
            self.ip(2, &format!("link set port{host} master switch up"));
        }
    }

    /// Joins two hosts by a cable of their own, `other` on both, with the addresses 10.78.0.1 and 10.78.0.2.
    pub(crate) fn connect(&self, host: u16, far: u16) {
        self.ip(host, &format!("link add other type veth peer name other netns {}", self.name(far)));
        for (number, host) in (1..).zip([host, far]) {
            self.ip(host, &format!("addr add 10.78.0.{number}/24 dev other"));
            self.ip(host, "link set other up");
        }
    }

    /// Has the switch pass no multicast on.
    pub(crate) fn stop_multicast(&self) {
        for host in [0, 1] {
            self.ip(2, &format!("link set port{host} type bridge_slave mcast_flood off"));
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
