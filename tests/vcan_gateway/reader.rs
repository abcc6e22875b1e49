//! The reader: Cyclone DDS in a process of its own, which says in lines of JSON what it sees.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::interface::skip;
use crate::process::DEADLINE;

/// On the loopback, which need not have multicast.
const CYCLONE: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
    </General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"127.0.0.1\"/></Peers>\
    </Discovery></Domain></CycloneDDS>";

/// A Python with `cyclonedds`.
pub(crate) struct Python(PathBuf);

impl Python {
    /// `None` after saying what is skipped.
    pub(crate) fn for_test(test: &str) -> Option<Self> {
        let python = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON");
        if python.is_none() {
            skip(test, "SIGNAL_GATEWAY_PEER_PYTHON is not set (a Python with cyclonedds==11.0.1)");
        }
        python.map(|python| Self(python.into()))
    }
}

type Lines = Vec<(Instant, Value)>;

/// A running reader, and every line it has said.
pub(crate) struct Reader {
    child: Child,
    lines: Arc<(Mutex<Lines>, Condvar)>,
}

/// How many lines there were at some moment.
#[derive(Clone, Copy)]
pub(crate) struct Mark(usize);

impl Mark {
    /// Before everything.
    pub(crate) const START: Self = Self(0);
}

impl Reader {
    /// Of both reports and the diagnostics.
    pub(crate) fn of_all(python: &Python, domain: u32) -> Self {
        Self::start(python, domain, &["turn", "hazard", "diagnostics"])
    }

    /// Of the turn reports only.
    pub(crate) fn of_turn(python: &Python, domain: u32) -> Self {
        Self::start(python, domain, &["turn"])
    }

    fn start(Python(python): &Python, domain: u32, kinds: &[&str]) -> Self {
        let mut command = Command::new(python);
        command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds_peer/reader.py"));
        command.arg(domain.to_string());
        for kind in kinds {
            command.args(match *kind {
                "turn" => ["turn", "rt/vehicle/status/turn_indicators_status", "transient_local"],
                "hazard" => ["hazard", "rt/vehicle/status/hazard_lights_status", "transient_local"],
                _ => ["diagnostics", "rt/diagnostics", "volatile"],
            });
        }
        command.env("CYCLONEDDS_URI", CYCLONE).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let lines = Arc::<(Mutex<Lines>, Condvar)>::default();
        let writer = Arc::clone(&lines);
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let line = serde_json::from_str(&line).unwrap();
                writer.0.lock().unwrap().push((Instant::now(), line));
                writer.1.notify_all();
            }
        });
        let reader = Self { child, lines };
        reader.wait(Mark::START, "its start", |line| line["event"] == "ready");
        reader
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> Mark {
        Mark(self.lines.0.lock().unwrap().len())
    }

    /// Waits for the first line after `mark` that `is_it`; says when it came.
    pub(crate) fn wait(&self, mark: Mark, what: &str, is_it: impl Fn(&Value) -> bool) -> (Instant, Value) {
        let find =
            |lines: &[(Instant, Value)]| lines.iter().skip(mark.0).find(|(_, line)| is_it(line)).cloned();
        let lacks = |lines: &mut Lines| find(lines).is_none();
        let lines = self.lines.0.lock().unwrap();
        let (lines, _) = self.lines.1.wait_timeout_while(lines, DEADLINE, lacks).unwrap();
        let found = find(&lines);
        found.unwrap_or_else(|| {
            let last: Vec<_> = lines.iter().rev().take(8).map(|(_, line)| line.to_string()).collect();
            panic!("the reader: waited for {what}; the last lines, newest first:\n{}", last.join("\n"))
        })
    }

    /// Waits for a report; gives its stamp in nanoseconds.
    pub(crate) fn report(&self, mark: Mark, kind: &str, report: u8) -> i64 {
        let is_it = |line: &Value| is_sample(line, kind) && line["data"]["report"] == report;
        stamp(&self.wait(mark, &format!("{kind} report {report}"), is_it).1)
    }

    /// Waits until diagnostics say `part` of a task, with that level; gives the whole status.
    pub(crate) fn status(&self, mark: Mark, task: &str, level: u8, part: &str) -> Value {
        let name = format!("signal_gateway: {task}");
        let find = |line: &Value| {
            let statuses = line["data"]["status"].as_array()?;
            let is_it = |status: &&Value| {
                status["name"] == name.as_str()
                    && status["level"] == level
                    && status["message"].as_str().unwrap().contains(part)
            };
            statuses.iter().find(is_it).cloned()
        };
        let what = format!("{task} with level {level} and {part:?}");
        find(&self.wait(mark, &what, |line| find(line).is_some()).1).unwrap()
    }

    /// The quality of service of the writer matched first after `mark`.
    pub(crate) fn matched(&self, mark: Mark, kind: &str) -> String {
        let is_it = |line: &Value| line["event"] == "matched" && line["kind"] == kind;
        self.wait(mark, &format!("a writer of {kind}"), is_it).1["qos"].as_str().unwrap().to_owned()
    }

    /// The samples after `mark`.
    pub(crate) fn samples(&self, mark: Mark, kind: &str) -> Vec<Value> {
        let lines = self.lines.0.lock().unwrap();
        let lines = lines.iter().skip(mark.0).map(|(_, line)| line);
        lines.filter(|line| is_sample(line, kind)).cloned().collect()
    }

    /// The samples that come during a while.
    pub(crate) fn during(&self, while_: Duration, kind: &str) -> Vec<Value> {
        let mark = self.mark();
        std::thread::sleep(while_);
        self.samples(mark, kind)
    }

    /// Once what is on its way has arrived, nothing comes any more.
    pub(crate) fn expect_silence(&self, kind: &str) {
        std::thread::sleep(Duration::from_millis(500));
        assert_eq!(self.during(Duration::from_millis(1500), kind), Vec::<Value>::new());
    }
}

/// The stamp of a report, nanoseconds.
pub(crate) fn stamp(line: &Value) -> i64 {
    let part = |name: &str| line["data"]["stamp"][name].as_i64().unwrap();
    part("sec") * 1_000_000_000 + part("nanosec")
}

fn is_sample(line: &Value, kind: &str) -> bool {
    line["event"] == "sample" && line["kind"] == kind
}

impl Drop for Reader {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let asked = Instant::now();
        while asked.elapsed() < Duration::from_secs(5) {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ended = (self.child.kill(), self.child.wait());
    }
}
