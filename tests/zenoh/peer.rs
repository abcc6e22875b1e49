//! The other side: sessions and routers of Zenoh's Python binding, on the loopback.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::inside;
use crate::support::prerequisite::{Missing, peer_python};
use crate::support::vcan::wall;

/// A moment in the output of a peer.
pub(crate) struct Moment {
    mark: Mark,
    /// The wall clock, nanoseconds.
    wall: i64,
}

/// A session of the peer.
pub(crate) struct Peer(JsonProcess);

impl Peer {
    /// Starts it in a domain with a configuration, perhaps in a network namespace, and waits until it is
    /// there.
    pub(crate) fn start_inside(namespace: Option<&str>, domain: u16, config: &str) -> Result<Self, Missing> {
        let python = peer_python()?;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/zenoh_peer.py");
        let mut command: Command = inside(namespace, &python);
        command.arg(script).args([&domain.to_string(), config]);
        let process = JsonProcess::start("zenoh_peer.py", &mut command);
        process.wait_for(Mark::START, "its start", |line| line["event"] == "ready");
        Ok(Self(process))
    }

    pub(crate) fn start(domain: u16, config: &str) -> Result<Self, Missing> {
        Self::start_inside(None, domain, config)
    }

    /// The id of its process.
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// The present end of its output.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// Has it do something, and waits until that is done.
    pub(crate) fn order(&self, command: &Value) {
        let mark = self.mark();
        self.0.send(&command.to_string());
        self.0.wait_for(mark, "an answer", |line| line["event"] == "done");
    }

    /// Reads a key from now on, under a name; with history also what is current.
    pub(crate) fn read(&self, name: &str, kind: &str, key: &str, history: bool) {
        self.order(&json!({"read": name, "kind": kind, "key": key, "history": history}));
    }

    /// Waits for a token after `mark` that has all of these parts.
    pub(crate) fn token(&self, mark: Mark, kind: &str, parts: &[&str]) -> Value {
        let has_all = |key: &str| parts.iter().all(|part| key.contains(part));
        let is_it = |line: &Value| {
            line["event"] == "token" && line["kind"] == kind && has_all(line["key"].as_str().unwrap())
        };
        self.0.wait_for(mark, &format!("a token with {parts:?}"), is_it).1
    }

    /// Waits for a sample of a name after `mark` that `is_it`.
    pub(crate) fn sample(&self, mark: Mark, name: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.0.wait_for(mark, &format!("a sample of {name}"), |line| is_sample(line, name) && is_it(line)).1
    }

    /// The samples of a name after `mark`, as they arrived.
    pub(crate) fn samples(&self, mark: Mark, name: &str) -> Vec<Value> {
        self.0.lines(mark).into_iter().map(|(_, line)| line).filter(|line| is_sample(line, name)).collect()
    }

    /// The replies to requests after `mark`, as they arrived.
    pub(crate) fn answers(&self, mark: Mark) -> Vec<Value> {
        let lines = self.0.lines(mark).into_iter().map(|(_, line)| line);
        lines.filter(|line| line["event"] == "answer").collect()
    }

    /// The present moment.
    pub(crate) fn moment(&self) -> Moment {
        Moment { mark: self.mark(), wall: wall() }
    }

    /// The samples of a name that came after a moment at which it was withdrawn already: those that were sent
    /// later, or come again. What was on its way is none of them.
    pub(crate) fn unexpected(&self, withdrawn: &Moment, name: &str) -> Vec<Value> {
        let all = self.samples(Mark::START, name);
        let later = self.samples(withdrawn.mark, name);
        let (before, later) = all.split_at(all.len() - later.len());
        let is_repeated = |sample: &Value| {
            before.iter().any(|known| ["gid", "number"].iter().all(|key| known[key] == sample[key]))
        };
        let is_unexpected =
            |sample: &&Value| sample["sent"].as_i64().unwrap() > withdrawn.wall || is_repeated(sample);
        later.iter().filter(is_unexpected).cloned().collect()
    }

    /// Lets it run, or stops it, by a signal.
    pub(crate) fn signal(&self, name: &str) {
        assert!(Command::new("kill").args([name, &self.id().to_string()]).status().unwrap().success());
    }

    /// Ends it without a word.
    pub(crate) fn kill(self) {
        self.0.kill();
    }
}

fn is_sample(line: &Value, name: &str) -> bool {
    line["event"] == "sample" && line["name"] == name
}

/// A session that looks for a router at this port as often as the shipped configurations do.
pub(crate) fn session(port: u16) -> String {
    format!(
        "{{ mode: 'peer', connect: {{ endpoints: ['tcp/127.0.0.1:{port}'], timeout_ms: -1, exit_on_failure: false, \
         retry: {{ period_init_ms: 200, period_max_ms: 1000, period_increase_factor: 2 }} }}, \
         listen: {{ endpoints: ['tcp/127.0.0.1:0'] }}, timestamping: {{ enabled: true }}, \
         scouting: {{ multicast: {{ enabled: false }} }} }}"
    )
}

/// A session as `rmw_zenoh_cpp` configures it, which looks for a router at this port: it tells its router
/// alone where it is, and of two peers the one with the greater id connects.
pub(crate) fn rmw_session(port: u16) -> String {
    format!(
        "{{ mode: 'peer', connect: {{ endpoints: ['tcp/127.0.0.1:{port}'], timeout_ms: -1, exit_on_failure: false, \
         retry: {{ period_init_ms: 1000, period_max_ms: 4000, period_increase_factor: 2 }} }}, \
         listen: {{ endpoints: ['tcp/127.0.0.1:0'] }}, timestamping: {{ enabled: true }}, \
         scouting: {{ multicast: {{ enabled: false }}, gossip: {{ target: {{ router: ['router', 'peer'], peer: ['router'] }}, \
         autoconnect_strategy: {{ peer: {{ to_router: 'always', to_peer: 'greater-zid' }} }} }} }}, \
         transport: {{ link: {{ tx: {{ lease: 60000, keep_alive: 2 }} }} }} }}"
    )
}

/// A router at this port.
pub(crate) fn router(port: u16) -> String {
    format!(
        "{{ mode: 'router', listen: {{ endpoints: ['tcp/127.0.0.1:{port}'] }}, \
         scouting: {{ multicast: {{ enabled: false }} }} }}"
    )
}
