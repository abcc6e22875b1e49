//! The other side: Cyclone DDS in processes of its own, which say in lines of JSON what they see.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;

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
            println!(
                "skipped: {test}: SIGNAL_GATEWAY_PEER_PYTHON is not set (a Python with cyclonedds==11.0.1)"
            );
        }
        python.map(|python| Self(python.into()))
    }

    /// Runs a script to its end; gives the line it says.
    pub(crate) fn run(&self, name: &str, domain: u32, args: &[String]) -> Value {
        let output = self.command(name, domain, args).stderr(Stdio::inherit()).output().unwrap();
        assert!(output.status.success(), "{name}: {}", output.status);
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn command(&self, name: &str, domain: u32, args: &[String]) -> Command {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds_peer").join(name);
        let mut command = Command::new(&self.0);
        command.arg(script).arg(domain.to_string()).args(args).env("CYCLONEDDS_URI", CYCLONE);
        // A busy machine delays the script by more than ten samples.
        command.env("SIGNAL_GATEWAY_PEER_DEPTH", "1000");
        command
    }
}

/// A topic to read: kind of `tests/dds_peer/messages.py`, name for the test, topic.
pub(crate) type Wanted<'a> = (&'a str, &'a str, &'a str);

pub(crate) const GROUND_TRUTH: Wanted<'_> = ("array_v1", "truth", "simulation/traffic_lights");
pub(crate) const CAMERA: Wanted<'_> =
    ("groups", "camera", "perception/traffic_light_recognition/internal/traffic_signals");
pub(crate) const V2I: Wanted<'_> =
    ("groups", "v2i", "perception/traffic_light_recognition/external/traffic_signals");
pub(crate) const LEGACY: Wanted<'_> = ("groups", "legacy", "v2x/traffic_signals");
pub(crate) const ARBITER: Wanted<'_> =
    ("groups", "arbiter", "perception/traffic_light_recognition/traffic_signals");
pub(crate) const MARKERS: Wanted<'_> = ("markers", "markers", "traffic_light/marker");
pub(crate) const DIAGNOSTICS: Wanted<'_> = ("diagnostics", "diagnostics", "diagnostics");
/// All writers of the domain.
pub(crate) const ENDPOINTS: Wanted<'_> = ("endpoints", "endpoints", "");

type Lines = Vec<Value>;

/// A running script, and every line it has said.
struct Script {
    child: Child,
    lines: Arc<(Mutex<Lines>, Condvar)>,
}

impl Script {
    fn start(python: &Python, name: &str, domain: u32, args: &[String]) -> Self {
        let mut command = python.command(name, domain, args);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let lines = Arc::<(Mutex<Lines>, Condvar)>::default();
        let heard = Arc::clone(&lines);
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                heard.0.lock().unwrap().push(serde_json::from_str(&line).unwrap());
                heard.1.notify_all();
            }
        });
        Self { child, lines }
    }

    /// Waits until `find` finds something in what was said from line `from` on.
    fn wait<T>(&self, from: usize, what: &str, mut find: impl FnMut(&[Value]) -> Option<T>) -> T {
        let mut found = None;
        let lines = self.lines.0.lock().unwrap();
        let lacks = |lines: &mut Lines| {
            found = find(lines.get(from..).unwrap_or_default());
            found.is_none()
        };
        let (lines, _) = self.lines.1.wait_timeout_while(lines, DEADLINE, lacks).unwrap();
        found.unwrap_or_else(|| {
            let last: Vec<_> = lines.iter().rev().take(8).map(Value::to_string).collect();
            panic!("waited for {what}; the last lines, newest first:\n{}", last.join("\n"))
        })
    }
}

impl Drop for Script {
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

/// A reader of some topics.
pub(crate) struct Reader(Script);

/// How many lines there were at some moment.
#[derive(Clone, Copy)]
pub(crate) struct Mark(usize);

impl Mark {
    /// Before everything.
    pub(crate) const START: Self = Self(0);
}

impl Reader {
    /// Starts it and waits until it reads. All ask for reliable and transient local, the diagnostics for
    /// volatile.
    pub(crate) fn start(python: &Python, domain: u32, wanted: &[Wanted<'_>]) -> Self {
        let durability = |kind| if kind == "diagnostics" { "volatile" } else { "transient_local" };
        let args = wanted.iter().flat_map(|(kind, name, topic)| {
            [format!("{kind}={name}"), format!("rt/{topic}"), durability(*kind).to_owned()]
        });
        let script = Script::start(python, "reader.py", domain, &args.collect::<Vec<_>>());
        script.wait(0, "its start", |lines| (!lines.is_empty()).then_some(()));
        Self(script)
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> Mark {
        Mark(self.0.lines.0.lock().unwrap().len())
    }

    /// The samples of `name` after `mark`, as they arrived: `sent` in nanoseconds, and `data`.
    pub(crate) fn samples(&self, Mark(mark): Mark, name: &str) -> Vec<Value> {
        let lines = self.0.lines.0.lock().unwrap();
        lines.iter().skip(mark).filter(|line| is_sample(line, name)).cloned().collect()
    }

    /// Waits for the first sample of `name` after `mark` of which `find` finds something.
    pub(crate) fn wait<T>(
        &self,
        mark: Mark,
        name: &str,
        what: &str,
        mut find: impl FnMut(&Value) -> Option<T>,
    ) -> T {
        let mut looked_at = 0;
        self.0.wait(mark.0, &format!("{what} on {name}"), |lines| {
            let new = lines.get(looked_at..).unwrap_or_default();
            looked_at = lines.len();
            new.iter().filter(|line| is_sample(line, name)).find_map(|line| find(&line["data"]))
        })
    }

    /// Waits until a sample after `mark` says `state`, in the words of [`crate::words`].
    pub(crate) fn wait_for_state(&self, mark: Mark, name: &str, state: &str) {
        let mut last = String::new();
        self.wait(mark, name, state, |data| {
            let now = crate::words::of(data);
            if now != last {
                println!("{name}: {now}");
                last.clone_from(&now);
            }
            (now == state).then_some(())
        });
    }

    /// Waits until a writer of `name` is there; gives its quality of service.
    pub(crate) fn matched(&self, name: &str) -> String {
        self.0.wait(0, &format!("a writer of {name}"), |lines| {
            let line = lines.iter().find(|line| line["event"] == "matched" && line["kind"] == name)?;
            Some(line["qos"].as_str().unwrap().to_owned())
        })
    }

    /// Waits until diagnostics after `mark` say this of a task; gives the value of `key` then.
    pub(crate) fn status(
        &self,
        mark: Mark,
        task: &str,
        key: &str,
        is_it: impl Fn(&str, u8) -> bool,
    ) -> Value {
        let name = format!("signal_gateway: {task}");
        self.wait(mark, "diagnostics", &format!("{key} of {task}"), |data| {
            let status = data["status"].as_array()?.iter().find(|status| status["name"] == name.as_str())?;
            let value = status["values"].as_array()?.iter().find(|value| value["key"] == key)?;
            let level = u8::try_from(status["level"].as_u64()?).ok()?;
            is_it(value["value"].as_str()?, level).then(|| status.clone())
        })
    }
}

fn is_sample(line: &Value, name: &str) -> bool {
    line["event"] == "sample" && line["kind"] == name
}

/// A writer of some topics, by their positions.
pub(crate) struct Writer {
    script: Script,
    topics: usize,
}

impl Writer {
    /// Starts it and waits until every topic is read: kind and topic of each.
    pub(crate) fn start(python: &Python, domain: u32, topics: &[(&str, &str)]) -> Self {
        let args = topics.iter().flat_map(|(kind, topic)| {
            [(*kind).to_owned(), format!("rt/{topic}"), "reliable".to_owned(), "volatile".to_owned()]
        });
        let script = Script::start(python, "writer.py", domain, &args.collect::<Vec<_>>());
        script.wait(0, "a reader of every topic", |lines| {
            let matched = lines.iter().filter(|line| line["event"] == "matched").count();
            (matched == topics.len()).then_some(())
        });
        Self { script, topics: topics.len() }
    }

    /// Sends a message, in the words of `tests/dds_peer/writer.py`.
    pub(crate) fn send(&mut self, topic: usize, text: &str) {
        let number = if self.topics == 1 { String::new() } else { format!("{topic} ") };
        writeln!(self.script.child.stdin.as_mut().unwrap(), "{number}{text}").unwrap();
    }
}
