//! Autoware, as far as a vehicle can tell: Cyclone DDS in a process of its own, which sends the commands
//! that it is given and receives the gateway's diagnostics.

use std::time::Duration;

use serde_json::Value;

use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::Cyclone;

/// Levels of `DiagnosticStatus`.
pub(crate) const OK: u8 = 0;
pub(crate) const WARN: u8 = 1;
pub(crate) const ERROR: u8 = 2;

/// The tasks about commands.
pub(crate) const TURN: &str = "turn_indicators_command";
pub(crate) const HAZARD: &str = "hazard_lights_command";
pub(crate) const TRANSMISSION: &str = "command_transmission";

/// What a writer offers beyond reliable data of depth 1.
#[derive(Clone, Copy)]
pub(crate) enum Durability {
    Volatile,
    TransientLocal,
}

/// A running commander.
pub(crate) struct Commander(JsonProcess);

impl Commander {
    pub(crate) fn start(cyclone: &Cyclone, domain: u16, durability: Durability) -> Self {
        Self(cyclone.commander(
            domain,
            match durability {
                Durability::Volatile => "volatile",
                Durability::TransientLocal => "transient_local",
            },
        ))
    }

    /// Carries out a line of `commander.py`; gives the mark from which on its effects are found.
    pub(crate) fn send(&self, line: &str) -> Mark {
        let mark = self.mark();
        self.0.send(line);
        self.wait(mark, &format!("{line:?} to be done"), |line| line["event"] == "done");
        mark
    }

    /// Now, to listen from there on.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// Waits until the gateway reads the commands, and the control mode if it is to.
    pub(crate) fn wait_for_readers(&self, mark: Mark, of_mode: bool) {
        for topic in ["turn", "hazard"].into_iter().chain(of_mode.then_some("mode")) {
            let is_it = |line: &Value| line["event"] == "matched" && line["topic"] == topic;
            self.wait(mark, &format!("a reader of {topic}"), is_it);
        }
    }

    /// Waits until the gateway has reported this of `turn` or `hazard` after `mark`.
    pub(crate) fn report(&self, mark: Mark, topic: &str, report: u8) {
        let is_it =
            |line: &Value| line["event"] == "report" && line["topic"] == topic && line["report"] == report;
        self.wait(mark, &format!("{topic} report {report}"), is_it);
    }

    /// Waits until diagnostics have a task with that level and `part` in its message.
    pub(crate) fn status(&self, mark: Mark, task: &str, level: u8, part: &str) {
        let is_it = |line: &Value| is_status_like(line, task, level, part);
        self.wait(mark, &format!("{task} with level {level} and {part:?}"), is_it);
    }

    /// Carries out a line that sends single messages, again and again until diagnostics show it: with depth
    /// 1 the next message may replace one that has not been read yet.
    pub(crate) fn send_until(&self, line: &str, task: &str, level: u8, part: &str) {
        let what = format!("{task} {part:?} with level {level}");
        let send = || _ = self.send(line);
        let is_it = |line: &Value| is_status_like(line, task, level, part);
        self.0.wait_while_doing(self.mark(), &what, Duration::from_millis(500), send, is_it);
    }

    /// Waits until a value of a task is this.
    pub(crate) fn value(&self, mark: Mark, task: &str, key: &str, value: &str) {
        let is_it = |line: &Value| is_status(line, task) && line["values"][key] == value;
        self.wait(mark, &format!("{key} {value} of {task}"), is_it);
    }

    /// Waits until a count of a task is at least `least`; gives it.
    pub(crate) fn count(&self, mark: Mark, task: &str, key: &str, least: u64) -> u64 {
        // Those of sending are given for each message by its name.
        let number = |text: &str| text.rsplit(' ').next()?.parse::<u64>().ok();
        let count = |line: &Value| line["values"][key].as_str().and_then(number);
        let is_it = |line: &Value| is_status(line, task) && count(line).is_some_and(|count| count >= least);
        count(&self.wait(mark, &format!("{least} {key} of {task}"), is_it)).unwrap()
    }

    /// Waits until `more` further messages of a task's topic have come, and gives the level of every
    /// status of the task up to then.
    pub(crate) fn levels_during(&self, mark: Mark, task: &str, key: &str, more: u64) -> Vec<u64> {
        let before = self.count(mark, task, key, 0);
        self.count(mark, task, key, before + more);
        let lines = self.0.lines(mark);
        let statuses = lines.iter().filter(|(_, line)| is_status(line, task));
        statuses.filter_map(|(_, line)| line["level"].as_u64()).collect()
    }

    fn wait(&self, mark: Mark, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.0.wait_for(mark, what, is_it).1
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
