//! Cyclone DDS as a peer: scripts of `tests/peer`, each in a process of its own.

use std::cell::RefCell;
use std::net::UdpSocket;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};

use serde_json::Value;

use super::json_process::JsonProcess;
use super::prerequisite::{Missing, peer_python};

/// `CYCLONEDDS_URI` for the loopback, which need not have multicast.
pub(crate) const LOOPBACK: &str = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>\
    <NetworkInterface name=\"lo\"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>\
    <Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";

/// A `CYCLONEDDS_URI` that goes before the others: a peer that a busy machine keeps from announcing itself
/// for seconds is not taken for gone, and one that is killed is forgotten before a gateway misses its
/// acknowledgements.
pub(crate) const PATIENT: &str = "<CycloneDDS><Domain><Discovery><LeaseDuration>40s</LeaseDuration>\
    <SPDPInterval>1s</SPDPInterval></Discovery></Domain></CycloneDDS>";

/// A DDS domain that no other test on this machine uses until the test's thread ends, with ports below
/// the ephemeral range.
///
/// A domain is held by a socket of its name, so that tests of other programs and working copies see it. One
/// in which a process of an earlier test still has to leave is not taken.
pub(crate) fn domain() -> u16 {
    const COUNT: u16 = 80;
    static NEXT: AtomicU16 = AtomicU16::new(0);
    thread_local! {
        static HELD: RefCell<Vec<UnixDatagram>> = const { RefCell::new(Vec::new()) };
    }
    let hold = |domain: u16| {
        let name = SocketAddr::from_abstract_name(format!("signal-gateway-test-domain-{domain}")).unwrap();
        let socket = UnixDatagram::bind_addr(&name).ok().filter(|_| is_left(domain))?;
        HELD.with_borrow_mut(|held| held.push(socket));
        Some(domain)
    };
    // Far from the default domain first; different programs begin apart.
    let begin = u16::try_from(std::process::id() % u32::from(COUNT)).unwrap();
    let next = || NEXT.fetch_add(1, Ordering::Relaxed) % COUNT;
    let free = (0..COUNT).find_map(|_| hold(20 + (begin + next()) % COUNT));
    free.unwrap_or_else(|| panic!("no DDS domain is free"))
}

/// True if nobody listens on the ports of a domain: those of multicast, and those of the first participants.
fn is_left(domain: u16) -> bool {
    let base = 7400 + 250 * domain;
    [0, 1].into_iter().chain(10..30).all(|offset| UdpSocket::bind(("0.0.0.0", base + offset)).is_ok())
}

/// A topic that a peer reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading<'a> {
    /// `KIND` or `KIND=NAME` of `reader.py`.
    pub(crate) kind: &'a str,
    /// The DDS name, as `rt/diagnostics`.
    pub(crate) topic: &'a str,
    /// `volatile` or `transient_local`.
    pub(crate) durability: &'a str,
}

/// A topic that a peer writes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Writing<'a> {
    /// `KIND` of `writer.py`.
    pub(crate) kind: &'a str,
    /// The DDS name, as `rt/diagnostics`.
    pub(crate) topic: &'a str,
    /// `reliable` or `best_effort`.
    pub(crate) reliability: &'a str,
    /// `volatile` or `transient_local`.
    pub(crate) durability: &'a str,
}

/// Environment in which processes of Cyclone DDS run.
#[derive(Debug, Clone)]
pub(crate) struct Cyclone {
    python: PathBuf,
    uri: String,
    depth: u32,
    namespace: Option<String>,
}

impl Cyclone {
    /// On every interface, with Cyclone's own settings but for its lease. Readers and writers keep so many
    /// samples that none is lost on a busy machine.
    pub(crate) fn with_defaults() -> Result<Self, Missing> {
        Ok(Self { python: peer_python()?, uri: PATIENT.to_owned(), depth: 1000, namespace: None })
    }

    /// On the loopback alone.
    pub(crate) fn on_loopback() -> Result<Self, Missing> {
        Self::with_defaults().map(|cyclone| cyclone.configured(LOOPBACK))
    }

    /// The same with readers and writers that keep so many samples.
    pub(crate) fn keeping(&self, depth: u32) -> Self {
        Self { depth, ..self.clone() }
    }

    /// The same with this `CYCLONEDDS_URI`, whose settings replace those before.
    pub(crate) fn configured(&self, uri: &str) -> Self {
        Self { uri: format!("{PATIENT},{uri}"), ..self.clone() }
    }

    /// The same in a network namespace.
    pub(crate) fn inside(&self, namespace: &str) -> Self {
        Self { namespace: Some(namespace.to_owned()), ..self.clone() }
    }

    /// `tests/peer/{script}`, with the domain as its first argument.
    pub(crate) fn command(&self, script: &str, domain: u16) -> Command {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer").join(script);
        let mut command = inside(self.namespace.as_deref(), &self.python);
        command.arg(script).arg(domain.to_string());
        command.env("SIGNAL_GATEWAY_PEER_DEPTH", self.depth.to_string()).env("CYCLONEDDS_URI", &self.uri);
        command
    }

    /// Starts a script that takes commands as lines, and waits until it is ready.
    pub(crate) fn start(&self, script: &str, domain: u16, args: &[&str]) -> JsonProcess {
        let process = JsonProcess::start(script, self.command(script, domain).args(args));
        process.next("its start", |line| line["event"] == "ready");
        process
    }

    /// Runs a script to its end; returns the line of JSON that it prints.
    pub(crate) fn run(&self, script: &str, domain: u16, args: &[&str]) -> Value {
        let output = self.command(script, domain).args(args).stderr(Stdio::inherit()).output().unwrap();
        assert!(output.status.success(), "{script}: {}", output.status);
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Starts a `reader.py` and waits until it reads.
    pub(crate) fn reader(&self, domain: u16, topics: &[Reading<'_>]) -> JsonProcess {
        let args = topics.iter().flat_map(|topic| [topic.kind, topic.topic, topic.durability]);
        self.start("reader.py", domain, &args.collect::<Vec<_>>())
    }

    /// Starts a `reader.py` for one topic.
    pub(crate) fn topic_reader(&self, domain: u16, kind: &str, topic: &str, durability: &str) -> JsonProcess {
        self.reader(domain, &[Reading { kind, topic, durability }])
    }

    /// Starts a `writer.py` and waits until every topic is read.
    pub(crate) fn writer(&self, domain: u16, topics: &[Writing<'_>]) -> JsonProcess {
        let args =
            topics.iter().flat_map(|topic| [topic.kind, topic.topic, topic.reliability, topic.durability]);
        let process = self.start("writer.py", domain, &args.collect::<Vec<_>>());
        for topic in topics {
            process.next(&format!("a reader of {}", topic.topic), |line| line["event"] == "matched");
        }
        process
    }

    /// Starts a `commander.py` and waits until it takes commands.
    pub(crate) fn commander(&self, domain: u16, durability: &str) -> JsonProcess {
        self.start("commander.py", domain, &[durability])
    }
}

/// A program to be run in a network namespace, or here.
pub(crate) fn inside(namespace: Option<&str>, program: &Path) -> Command {
    let Some(namespace) = namespace else { return Command::new(program) };
    let mut command = Command::new("ip");
    command.args(["netns", "exec", namespace]).arg(program);
    command
}
