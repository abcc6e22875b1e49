//! The reader: Cyclone DDS in a process of its own, which writes samples as lines of JSON.

use serde_json::Value;

use crate::support::json_process::{JsonProcess, Line, Mark};
use crate::support::peer::{Cyclone, Reading};

/// A running reader of both reports and the diagnostics.
pub(crate) struct Reader(JsonProcess);

impl Reader {
    pub(crate) fn start(cyclone: &Cyclone, domain: u16) -> Self {
        let topics = [
            ("turn", "rt/vehicle/status/turn_indicators_status", "transient_local"),
            ("hazard", "rt/vehicle/status/hazard_lights_status", "transient_local"),
            ("diagnostics", "rt/diagnostics", "volatile"),
        ];
        Self(
            cyclone
                .reader(domain, &topics.map(|(kind, topic, durability)| Reading { kind, topic, durability })),
        )
    }

    /// Kills the reader before it can announce that it leaves.
    pub(crate) fn kill(self) {
        self.0.kill();
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// Waits for the first sample after `mark` that `is_it`; gives its time.
    pub(crate) fn sample(&self, mark: Mark, kind: &str, is_it: impl Fn(&Value) -> bool) -> Line {
        self.0.wait_for(mark, &format!("a sample of {kind}"), |line| is_sample(line, kind) && is_it(line))
    }

    /// Waits for a report; gives its stamp in nanoseconds.
    pub(crate) fn report(&self, mark: Mark, kind: &str, report: u8) -> i64 {
        stamp(&self.sample(mark, kind, |line| line["data"]["report"] == report).1)
    }

    /// Waits until diagnostics have a task with that level and `part` in its message; gives the whole status.
    pub(crate) fn status(&self, mark: Mark, task: &str, level: u8, part: &str) -> Value {
        let name = format!("signal_gateway: {task}");
        self.0.find(mark, &format!("{task} with level {level} and {part:?}"), |(_, line)| {
            let is_it = |status: &&Value| {
                status["name"] == name.as_str()
                    && status["level"] == level
                    && status["message"].as_str().unwrap().contains(part)
            };
            line["data"]["status"].as_array()?.iter().find(is_it).cloned()
        })
    }

    /// The quality of service of the first writer matched.
    pub(crate) fn matched(&self, kind: &str) -> String {
        let is_it = |line: &Value| line["event"] == "matched" && line["kind"] == kind;
        let (_, line) = self.0.wait_for(Mark::START, &format!("a writer of {kind}"), is_it);
        line["qos"].as_str().unwrap().to_owned()
    }

    /// The samples after `mark`.
    pub(crate) fn samples(&self, mark: Mark, kind: &str) -> Vec<Value> {
        let lines = self.0.lines(mark).into_iter().map(|(_, line)| line);
        lines.filter(|line| is_sample(line, kind)).collect()
    }

    /// Number of writers of a kind that have gone since `mark`.
    pub(crate) fn unmatched(&self, mark: Mark, kind: &str) -> usize {
        let lines = self.0.lines(mark).into_iter();
        lines.filter(|(_, line)| line["event"] == "unmatched" && line["kind"] == kind).count()
    }

    /// Waits for so many samples after `mark`, and gives them.
    pub(crate) fn next(&self, mark: Mark, kind: &str, count: usize) -> Vec<Value> {
        let mut samples = Vec::new();
        self.0.find(mark, &format!("{count} samples of {kind}"), |(_, line)| {
            samples.extend(is_sample(line, kind).then(|| line.clone()));
            (samples.len() == count).then_some(())
        });
        samples
    }

    /// Waits until all diagnostics have been refreshed so often, which takes half a second each; gives the
    /// refreshes.
    pub(crate) fn refreshes(&self, mark: Mark, count: usize) -> Vec<Value> {
        let mut refreshes = Vec::new();
        self.0.find(mark, &format!("{count} refreshes of diagnostics"), |(_, line)| {
            let is_it = line["data"]["status"].as_array().is_some_and(|statuses| statuses.len() > 2);
            refreshes.extend(is_it.then(|| line.clone()));
            (refreshes.len() == count).then_some(())
        });
        refreshes
    }

    /// Once what is on its way has arrived, nothing more of `kinds` comes; gives the beginning of the
    /// silence.
    pub(crate) fn expect_silence(&self, kinds: &[&str]) -> Mark {
        self.refreshes(self.mark(), 1);
        let mark = self.mark();
        self.refreshes(mark, 2);
        for kind in kinds {
            assert_eq!(self.samples(mark, kind), Vec::<Value>::new());
        }
        mark
    }
}

/// The stamp of a report, nanoseconds.
pub(crate) fn stamp(line: &Value) -> i64 {
    nanos(&line["data"]["stamp"])
}

/// A time of ROS, nanoseconds.
pub(crate) fn nanos(time: &Value) -> i64 {
    let part = |name: &str| time[name].as_i64().unwrap();
    part("sec") * 1_000_000_000 + part("nanosec")
}

fn is_sample(line: &Value, kind: &str) -> bool {
    line["event"] == "sample" && line["kind"] == kind
}
