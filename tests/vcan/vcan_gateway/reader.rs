//! The reader: Cyclone DDS in a process of its own, which writes samples as lines of JSON.

use serde_json::Value;

use crate::support::json_process::{JsonProcess, Line, Mark};
use crate::support::peer::{Cyclone, Reading};

const DIAGNOSTICS: Reading<'_> =
    Reading { kind: "diagnostics", topic: "rt/diagnostics", durability: "volatile" };

/// A running reader of both reports and the diagnostics.
pub(crate) struct Reader(JsonProcess);

impl Reader {
    pub(crate) fn start(cyclone: &Cyclone, domain: u16) -> Self {
        let (turn, hazard) =
            ("rt/vehicle/status/turn_indicators_status", "rt/vehicle/status/hazard_lights_status");
        let report = |kind, topic| Reading { kind, topic, durability: "transient_local" };
        Self(cyclone.reader(domain, &[report("turn", turn), report("hazard", hazard), DIAGNOSTICS]))
    }

    /// A reader of the diagnostics alone.
    pub(crate) fn of_diagnostics(cyclone: &Cyclone, domain: u16) -> Self {
        Self(cyclone.reader(domain, &[DIAGNOSTICS]))
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

    /// Waits until the diagnostics after `mark` show the turn report as published, and once more. What they
    /// show was sent before them, on the same way to the network.
    pub(crate) fn published(&self, mark: Mark, report: &str) {
        let mut seen = 0;
        self.0.find(mark, &format!("{report} in the diagnostics"), |(_, line)| {
            let is_turn = |status: &&Value| status["name"] == "signal_gateway: turn_indicators";
            let status = line["data"]["status"].as_array()?.iter().find(is_turn)?;
            let values = status["values"].as_array()?.iter();
            seen += values.filter(|value| value["key"] == "report" && value["value"] == report).count();
            (seen >= 2).then_some(())
        });
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

    /// From the next refresh of the diagnostics on, by the times at which they were sent, nothing more of
    /// `kinds` comes; gives the beginning of the silence.
    pub(crate) fn expect_silence(&self, kinds: &[&str]) -> Mark {
        let before = self.mark();
        let from = sent(&self.refreshes(before, 1)[0]);
        let mark = self.mark();
        self.refreshes(mark, 2);
        for kind in kinds {
            let mut samples = self.samples(before, kind);
            samples.retain(|sample| sent(sample) > from);
            assert_eq!(samples, Vec::<Value>::new());
        }
        mark
    }
}

/// The time at which a sample was sent, nanoseconds.
fn sent(line: &Value) -> i64 {
    line["sent"].as_i64().unwrap()
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
