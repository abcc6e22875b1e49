//! Autoware, as far as a vehicle can tell: Cyclone DDS in a process of its own, which says commands as it
//! is told to and hears the gateway's diagnostics.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::interface::skip;
use crate::lines::{Lines, listen};
use crate::process::DEADLINE;

/// On the loopback, which need not have multicast.
pub(crate) const CYCLONE: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
    </General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address=\"127.0.0.1\"/></Peers>\
    </Discovery></Domain></CycloneDDS>";

/// Levels of `DiagnosticStatus`.
pub(crate) const OK: u8 = 0;
pub(crate) const WARN: u8 = 1;
pub(crate) const ERROR: u8 = 2;

/// The tasks about commands.
pub(crate) const TURN: &str = "turn_indicators_command";
pub(crate) const HAZARD: &str = "hazard_lights_command";
pub(crate) const TRANSMISSION: &str = "command_transmission";

/// A Python with the other makes of DDS and DBC.
pub(crate) struct Python(PathBuf);

impl Python {
    /// `None` after saying what is skipped.
    pub(crate) fn for_test(test: &str) -> Option<Self> {
        let python = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON");
        if python.is_none() {
            let peers = "a Python with cyclonedds==11.0.1 and cantools==45.1.0";
            skip(test, &format!("SIGNAL_GATEWAY_PEER_PYTHON is not set ({peers})"));
        }
        python.map(|python| Self(python.into()))
    }

    /// A script of the tests.
    pub(crate) fn script(&self, path: &str) -> Command {
        let mut command = Command::new(&self.0);
        command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(path));
        command
    }
}

/// What a writer offers beyond reliable data of depth 1.
#[derive(Clone, Copy)]
pub(crate) enum Durability {
    Volatile,
    TransientLocal,
}

/// A running commander, and every line it has said.
pub(crate) struct Commander {
    child: Child,
    input: Option<ChildStdin>,
    lines: Lines,
}

/// How many lines there were at some moment.
#[derive(Clone, Copy)]
pub(crate) struct Heard(usize);

impl Heard {
    /// Before everything.
    pub(crate) const START: Self = Self(0);
}

impl Commander {
    pub(crate) fn start(python: &Python, domain: u32, durability: Durability) -> Self {
        let mut command = python.script("dds_peer/commander.py");
        command.arg(domain.to_string()).arg(match durability {
            Durability::Volatile => "volatile",
            Durability::TransientLocal => "transient_local",
        });
        command.env("CYCLONEDDS_URI", CYCLONE).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let lines = listen(&mut child);
        let input = child.stdin.take();
        let commander = Self { child, input, lines };
        commander.wait(Heard::START, "its start", |line| line["event"] == "ready");
        commander
    }

    /// Carries out a line of `commander.py`; says from where on to listen for what comes of it.
    pub(crate) fn say(&self, line: &str) -> Heard {
        let mark = self.mark();
        let mut input = self.input.as_ref().unwrap();
        input.write_all(format!("{line}\n").as_bytes()).unwrap();
        self.wait(mark, &format!("{line:?} to be done"), |said| said["event"] == "done");
        mark
    }

    /// Now, to listen from there on.
    pub(crate) fn mark(&self) -> Heard {
        Heard(self.lines.0.lock().unwrap().len())
    }

    /// Waits until the gateway reads the commands, and the control mode if it is to.
    pub(crate) fn wait_for_readers(&self, mark: Heard, of_mode: bool) {
        for topic in ["turn", "hazard"].into_iter().chain(of_mode.then_some("mode")) {
            let is_it = |line: &Value| line["event"] == "matched" && line["topic"] == topic;
            self.wait(mark, &format!("a reader of {topic}"), is_it);
        }
    }

    /// Waits until the gateway has reported this of `turn` or `hazard` after `mark`.
    pub(crate) fn report(&self, mark: Heard, topic: &str, report: u8) {
        let is_it =
            |line: &Value| line["event"] == "report" && line["topic"] == topic && line["report"] == report;
        self.wait(mark, &format!("{topic} report {report}"), is_it);
    }

    /// Waits until diagnostics say `part` of a task with that level.
    pub(crate) fn status(&self, mark: Heard, task: &str, level: u8, part: &str) {
        let is_it = |line: &Value| is_status_like(line, task, level, part);
        self.wait(mark, &format!("{task} with level {level} and {part:?}"), is_it);
    }

    /// Carries out a line that sends single messages, again and again until diagnostics say so: with depth
    /// 1 the next message may take the place of one that has not been read yet.
    pub(crate) fn say_until(&self, line: &str, task: &str, level: u8, part: &str) {
        let begun = Instant::now();
        let mark = self.mark();
        while begun.elapsed() < DEADLINE {
            self.say(line);
            let lacks = |lines: &mut Vec<Value>| {
                !lines.iter().skip(mark.0).any(|line| is_status_like(line, task, level, part))
            };
            let lines = self.lines.0.lock().unwrap();
            let patience = Duration::from_millis(500);
            let (_lines, timeout) = self.lines.1.wait_timeout_while(lines, patience, lacks).unwrap();
            if !timeout.timed_out() {
                return;
            }
        }
        panic!("{line:?} never made {task} say {part:?} with level {level}");
    }

    /// Waits until a value of a task is this.
    pub(crate) fn value(&self, mark: Heard, task: &str, key: &str, value: &str) {
        let is_it = |line: &Value| is_status(line, task) && line["values"][key] == value;
        self.wait(mark, &format!("{key} {value} of {task}"), is_it);
    }

    /// Waits until a count of a task is at least `least`; gives it.
    pub(crate) fn count(&self, mark: Heard, task: &str, key: &str, least: u64) -> u64 {
        // Those of sending are said for each message by its name.
        let number = |text: &str| text.rsplit(' ').next()?.parse::<u64>().ok();
        let count = |line: &Value| line["values"][key].as_str().and_then(number);
        let is_it = |line: &Value| is_status(line, task) && count(line).is_some_and(|count| count >= least);
        count(&self.wait(mark, &format!("{least} {key} of {task}"), is_it)).unwrap()
    }

    /// Waits until `more` further messages of a task's topic have come, and gives the level of every
    /// status of the task up to then.
    pub(crate) fn levels_during(&self, mark: Heard, task: &str, key: &str, more: u64) -> Vec<u64> {
        let before = self.count(mark, task, key, 0);
        self.count(mark, task, key, before + more);
        let lines = self.lines.0.lock().unwrap();
        let statuses = lines.iter().skip(mark.0).filter(|line| is_status(line, task));
        statuses.filter_map(|line| line["level"].as_u64()).collect()
    }

    fn wait(&self, mark: Heard, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let find = |lines: &[Value]| lines.iter().skip(mark.0).find(|line| is_it(line)).cloned();
        let lacks = |lines: &mut Vec<Value>| find(lines).is_none();
        let lines = self.lines.0.lock().unwrap();
        let (lines, _) = self.lines.1.wait_timeout_while(lines, DEADLINE, lacks).unwrap();
        find(&lines).unwrap_or_else(|| {
            let last: Vec<_> = lines.iter().rev().take(12).map(Value::to_string).collect();
            panic!("the commander: waited for {what}; the last lines, newest first:\n{}", last.join("\n"))
        })
    }
}

fn is_status_like(line: &Value, task: &str, level: u8, part: &str) -> bool {
    is_status(line, task)
        && line["level"] == level
        && line["message"].as_str().is_some_and(|message| message.contains(part))
}

fn is_status(line: &Value, task: &str) -> bool {
    line["event"] == "status" && line["task"] == task
}

impl Drop for Commander {
    fn drop(&mut self) {
        drop(self.input.take());
        // It ends by itself when its input does, and at once when it is stuck.
        for _ in 0..500 {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ended = (self.child.kill(), self.child.wait());
    }
}
