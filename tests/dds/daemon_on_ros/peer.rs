//! The other side: readers and writers of Cyclone DDS on the loopback.

use std::time::Duration;

use serde_json::Value;

use crate::support::json_process::{JsonProcess, Line, Mark};
use crate::support::peer::{Cyclone, Reading, Writing};

/// A topic to read: kind of `tests/peer/messages.py`, name for the test, topic.
pub(crate) type TopicToRead<'a> = (&'a str, &'a str, &'a str);

pub(crate) const GROUND_TRUTH: TopicToRead<'_> = ("array_v1", "truth", "simulation/traffic_lights");
pub(crate) const CAMERA: TopicToRead<'_> =
    ("groups", "camera", "perception/traffic_light_recognition/internal/traffic_signals");
pub(crate) const V2I: TopicToRead<'_> =
    ("groups", "v2i", "perception/traffic_light_recognition/external/traffic_signals");
pub(crate) const LEGACY: TopicToRead<'_> = ("groups", "legacy", "v2x/traffic_signals");
pub(crate) const ARBITER: TopicToRead<'_> =
    ("groups", "arbiter", "perception/traffic_light_recognition/traffic_signals");
pub(crate) const MARKERS: TopicToRead<'_> = ("markers", "markers", "traffic_light/marker");
pub(crate) const CLOCK: TopicToRead<'_> = ("clock", "clock", "clock");
pub(crate) const DIAGNOSTICS: TopicToRead<'_> = ("diagnostics", "diagnostics", "diagnostics");
pub(crate) const SECTIONS: TopicToRead<'_> = ("sections", "sections", "debug/sections");
pub(crate) const FACTORS: TopicToRead<'_> = ("factors", "factors", "debug/factors");
pub(crate) const ROSOUT: TopicToRead<'_> = ("log", "rosout", "rosout");
/// All writers of the domain.
pub(crate) const ENDPOINTS: TopicToRead<'_> = ("endpoints", "endpoints", "");

/// A reader of some topics.
pub(crate) struct Reader(JsonProcess);

impl Reader {
    /// Starts it and waits until it reads. All request reliable and transient local, the diagnostics,
    /// measurements and what the decider sends volatile.
    pub(crate) fn start(cyclone: &Cyclone, domain: u16, topics_to_read: &[TopicToRead<'_>]) -> Self {
        let names: Vec<_> = topics_to_read
            .iter()
            .map(|(kind, name, topic)| (format!("{kind}={name}"), format!("rt/{topic}")))
            .collect();
        let topics = topics_to_read.iter().zip(&names).map(|((kind, ..), (kind_and_name, topic))| Reading {
            kind: kind_and_name,
            topic,
            durability: match *kind {
                "diagnostics" | "sections" | "factors" | "velocity" | "steering" => "volatile",
                _ => "transient_local",
            },
        });
        Self(cyclone.reader(domain, &topics.collect::<Vec<_>>()))
    }

    /// The present end of its output, to search from there on.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// The samples of `name` after `mark`, as they arrived: `sent` in nanoseconds, and `data`.
    pub(crate) fn samples(&self, mark: Mark, name: &str) -> Vec<Value> {
        let lines = self.0.lines(mark).into_iter().map(|(_, line)| line);
        lines.filter(|line| is_sample(line, name)).collect()
    }

    /// True if there is a sample of `name` after `mark` that `is_it`.
    pub(crate) fn has(&self, mark: Mark, name: &str, is_it: impl Fn(&Value) -> bool) -> bool {
        self.samples(mark, name).iter().any(|line| is_it(&line["data"]))
    }

    /// True if a sample of `name` after `mark` that `is_it` comes in time, so that the caller need not try
    /// once more.
    pub(crate) fn comes(&self, mark: Mark, name: &str, is_it: impl Fn(&Value) -> bool) -> bool {
        const PATIENCE: Duration = Duration::from_secs(10);
        let find = |(_, line): &Line| (is_sample(line, name) && is_it(&line["data"])).then_some(());
        self.0.find_within(PATIENCE, mark, find).is_some()
    }

    /// Waits for the first sample of `name` after `mark` for which `find` returns a value.
    pub(crate) fn wait<T>(
        &self,
        mark: Mark,
        name: &str,
        what: &str,
        mut find: impl FnMut(&Value) -> Option<T>,
    ) -> T {
        self.0.find(mark, &format!("{what} on {name}"), |(_, line)| {
            is_sample(line, name).then(|| find(&line["data"])).flatten()
        })
    }

    /// Waits until a sample after `mark` has `state`, as text of [`crate::dds::daemon_on_ros::light_text`].
    pub(crate) fn wait_for_state(&self, mark: Mark, name: &str, state: &str) {
        let mut last = String::new();
        self.wait(mark, name, state, |data| {
            let now = crate::dds::daemon_on_ros::light_text::of(data);
            if now != last {
                println!("{name}: {now}");
                last.clone_from(&now);
            }
            (now == state).then_some(())
        });
    }

    /// Waits until a writer of `name` is there; returns its quality of service.
    pub(crate) fn matched(&self, name: &str) -> String {
        let is_match = |line: &Value| line["event"] == "matched" && line["kind"] == name;
        let (_, line) = self.0.wait_for(Mark::START, &format!("a writer of {name}"), is_match);
        line["qos"].as_str().unwrap().to_owned()
    }

    /// Waits until diagnostics after `mark` have a value and level of a task that satisfy `accept`; returns
    /// the status.
    pub(crate) fn status(
        &self,
        mark: Mark,
        task: &str,
        key: &str,
        accept: impl Fn(&str, u8) -> bool,
    ) -> Value {
        let find = |data: &Value| status_in(data, task, key, &accept);
        self.wait(mark, "diagnostics", &format!("{key} of {task}"), find)
    }
}

/// The status of a task in a message of the diagnostics, if its level and a value of it satisfy `accept`.
pub(crate) fn status_in(
    data: &Value,
    task: &str,
    key: &str,
    accept: impl Fn(&str, u8) -> bool,
) -> Option<Value> {
    let name = format!("signal_gateway: {task}");
    let status = data["status"].as_array()?.iter().find(|status| status["name"] == name.as_str())?;
    let value = status["values"].as_array()?.iter().find(|value| value["key"] == key)?;
    let level = u8::try_from(status["level"].as_u64()?).ok()?;
    accept(value["value"].as_str()?, level).then(|| status.clone())
}

fn is_sample(line: &Value, name: &str) -> bool {
    line["event"] == "sample" && line["kind"] == name
}

/// A writer of some topics, by their positions.
pub(crate) struct Writer {
    process: JsonProcess,
    topics: usize,
}

impl Writer {
    /// Starts it and waits until every topic is read: kind and topic of each. A clock is best effort, as
    /// nodes of ROS publish it, the others are reliable.
    pub(crate) fn start(cyclone: &Cyclone, domain: u16, topics: &[(&str, &str)]) -> Self {
        let names: Vec<_> = topics.iter().map(|(_, topic)| format!("rt/{topic}")).collect();
        let written = topics.iter().zip(&names).map(|((kind, _), topic)| Writing {
            kind,
            topic,
            reliability: if *kind == "clock" { "best_effort" } else { "reliable" },
            durability: "volatile",
        });
        let process = cyclone.writer(domain, &written.collect::<Vec<_>>());
        Self { process, topics: topics.len() }
    }

    /// Sends a message, in the notation of `tests/peer/writer.py`.
    pub(crate) fn send(&self, topic: usize, text: &str) {
        let number = if self.topics == 1 { String::new() } else { format!("{topic} ") };
        self.process.send(&format!("{number}{text}"));
    }
}
