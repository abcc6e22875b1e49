//! The gateway's side of a test: its session, in a process of its own.
//!
//! The session runs in this test's own executable, started again with an environment variable, so that it
//! can be put into a network namespace.

mod autoware_topics;
mod lights;
mod process;

use std::cell::RefCell;
use std::fmt;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

pub(crate) use autoware_topics::KINDS;

use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::inside;
use crate::support::processor::waited;
use crate::support::waiting::{Bystander, Lateness, let_pass, wait_for};

/// The environment variable that makes [`process::session_process`] a session, with a [`Role`].
const ROLE: &str = "SIGNAL_GATEWAY_TEST_SESSION";

/// Arguments of a session.
#[derive(Debug, Clone)]
pub(crate) struct Role {
    settings: Value,
    namespace: Option<String>,
}

impl Role {
    /// Transient-local reports in this domain, on every network.
    pub(crate) fn new(domain: u16) -> Self {
        Self { settings: json!({"domain": domain, "networks": []}), namespace: None }
    }

    fn with(mut self, key: &str, value: Value) -> Self {
        self.settings[key] = value;
        self
    }

    /// Volatile reports.
    pub(crate) fn volatile(self) -> Self {
        self.with("volatile", json!(true))
    }

    /// The topics of [`lights`].
    pub(crate) fn with_lights(self) -> Self {
        self.with("topics", json!("lights"))
    }

    /// The topics of [`autoware_topics`].
    pub(crate) fn with_autoware(self) -> Self {
        self.with("topics", json!("autoware"))
    }

    /// With the topics of velocity and gear.
    pub(crate) fn with_vehicle_status(self) -> Self {
        self.with("topics", json!("vehicle_status"))
    }

    /// With warnings on `/rosout`.
    pub(crate) fn with_rosout(self) -> Self {
        self.with("rosout", json!(true))
    }

    /// With some parameters and the services for them.
    pub(crate) fn with_parameters(self) -> Self {
        self.with("parameters", json!(true))
    }

    /// Over Zenoh with this configuration.
    #[allow(dead_code)] // the tests of DDS do not use it
    pub(crate) fn over_zenoh(self, config: &str) -> Self {
        self.with("zenoh", json!(config))
    }

    /// With keys as in Humble.
    #[allow(dead_code)] // the tests of DDS do not use it
    pub(crate) fn with_keys_of_humble(self) -> Self {
        self.with("humble", json!(true))
    }

    /// The network of this address and no other.
    pub(crate) fn only_on(self, address: &str) -> Self {
        self.with("networks", json!([address]))
    }

    /// With its node left out of the graph.
    pub(crate) fn without_graph(self) -> Self {
        self.with("graph", json!(false))
    }

    /// With its network side in a process.
    pub(crate) fn isolated(self) -> Self {
        self.with("isolated", json!(true))
    }

    /// Looks for lost peers sooner than a gateway does by itself.
    pub(crate) fn alert(self) -> Self {
        self.with("alert", json!(true))
    }

    /// In a network namespace.
    pub(crate) fn inside(mut self, namespace: &str) -> Self {
        self.namespace = Some(namespace.to_owned());
        self
    }

    /// Starts the session and waits until it is there.
    pub(crate) fn start(&self) -> Gateway {
        let mut command = inside(self.namespace.as_deref(), &std::env::current_exe().unwrap());
        let (_, module) = module_path!().split_once("::").unwrap();
        let test = format!("{module}::process::session_process");
        command.args(["--exact", &test, "--nocapture", "--test-threads=1"]);
        command.env(ROLE, self.settings.to_string()).stderr(Stdio::piped());
        let process = JsonProcess::start("the gateway", &mut command);
        // What arrives before that is not passed over.
        process.wait_for(Mark::START, "its start", |line| line["event"] == "ready");
        Gateway(process)
    }
}

/// Time that an orderly end may take.
const STOP_LIMIT: Duration = Duration::from_millis(500);
/// A network side that stood still for so long continues with a new participant, since peers may have given
/// up the old one.
const STANDSTILL: Duration = Duration::from_secs(2);
/// A report is repeated for so long by a writer that is new, for volatile readers that have not met it yet.
const REPEATED: Duration = Duration::from_secs(3);
/// Time after which a report is sent again that was to arrive by itself.
const AGAIN: Duration = Duration::from_secs(30);

/// A running session, which takes the commands of [`process::session_process`].
pub(crate) struct Gateway(JsonProcess);

/// A test that fails shows what its gateway has logged.
impl Drop for Gateway {
    fn drop(&mut self) {
        if std::thread::panicking() {
            for (_, line) in self.0.lines(Mark::START).iter().filter(|(_, line)| line["event"] == "log") {
                println!("the gateway: {}", line["text"].as_str().unwrap_or_default());
            }
        }
    }
}

/// What a wait is for, and the status that was seen last.
struct Awaited<'a>(&'a str, RefCell<Value>);

impl fmt::Display for Awaited<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of the gateway, whose status was {}", self.0, self.1.borrow())
    }
}

impl Gateway {
    /// The id of its process.
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// Sends a command.
    pub(crate) fn send(&self, command: &str) {
        self.0.send(command);
    }

    /// Waits for the next line that `is_it`.
    pub(crate) fn next(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.0.next(what, is_it)
    }

    /// Waits for the first line after `mark` that `is_it`.
    pub(crate) fn wait_for(&self, mark: Mark, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.0.wait_for(mark, what, is_it).1
    }

    /// Waits for a line that `is_it`, and meanwhile has something sent ten times a second.
    pub(crate) fn wait_while_sending(
        &self,
        what: &str,
        send: impl FnMut(),
        is_it: impl Fn(&Value) -> bool,
    ) -> Value {
        self.0.wait_while_doing(Mark::START, what, Duration::from_millis(100), send, is_it).1
    }

    /// All lines so far.
    #[allow(dead_code)] // the tests of Zenoh do not use it
    pub(crate) fn lines(&self) -> Vec<Value> {
        self.0.lines(Mark::START).into_iter().map(|(_, line)| line).collect()
    }

    /// The lines of that time.
    pub(crate) fn next_during(&self, time: Duration) -> Vec<Value> {
        self.0.next_during(time)
    }

    /// True once it has sent a whole stream.
    pub(crate) fn has_sent(&self) -> bool {
        self.0.lines(Mark::START).iter().any(|(_, line)| line["event"] == "sent")
    }

    /// Its present status.
    pub(crate) fn status(&self) -> Value {
        self.send("status");
        self.0.next("its status", |line| line["event"] == "status")
    }

    /// Waits until its status is as required.
    pub(crate) fn wait_until(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let look = || let_pass(Duration::from_millis(20), "between two looks at a status");
        self.wait_while_doing(what, is_it, look)
    }

    /// Likewise, and does something between two looks.
    pub(crate) fn wait_while_doing(
        &self,
        what: &str,
        is_it: impl Fn(&Value) -> bool,
        mut meanwhile: impl FnMut(),
    ) -> Value {
        let (awaited, mut is_first) = (Awaited(what, RefCell::default()), true);
        wait_for(&awaited, || {
            if !std::mem::take(&mut is_first) {
                meanwhile();
            }
            let status = self.status();
            awaited.1.replace(status.clone());
            is_it(&status).then_some(status)
        })
    }

    /// Waits until so many participants have been replaced; gives the status. Those that stood still do not
    /// count: peers may have given them up, and their successors meet everybody anew, also those that were
    /// missing. In a session without a process of its own for the network, a thread that only sleeps must
    /// then have been late as well.
    pub(crate) fn expect_rebuilds(&self, count: u64) -> Value {
        let is_it = |status: &Value| {
            let (rebuilds, standstills) = (status["rebuilds"].as_u64().unwrap(), self.standstills());
            let least = if standstills > 0 { standstills } else { count };
            status["restarts"] != 0 || (least..=count + standstills).contains(&rebuilds)
        };
        let status = self.wait_until(&format!("{count} participants that were replaced"), is_it);
        assert_no_restart(&status);
        if self.standstills() > 0 && status["isolated"] == false {
            assert_gap(&status, "a round of the network side", STANDSTILL);
        }
        status
    }

    /// Number of participants that were replaced because the machine let the network side stand still, as its
    /// log has it.
    pub(crate) fn standstills(&self) -> u64 {
        let lines = self.0.lines(Mark::START).into_iter();
        let is_it = |line: &Value| line["text"].as_str().is_some_and(|text| text.contains("StoodStill"));
        lines.filter(|(_, line)| line["event"] == "log" && is_it(line)).count().try_into().unwrap()
    }

    /// True if its log has a line with this text.
    #[allow(dead_code)] // the tests of DDS do not use it
    pub(crate) fn has_logged(&self, text: &str) -> bool {
        let lines = self.0.lines(Mark::START).into_iter();
        lines
            .filter(|(_, line)| line["event"] == "log")
            .any(|(_, line)| line["text"].as_str().is_some_and(|line| line.contains(text)))
    }

    /// True if it still has its first participant. One that the machine held up continues with another one,
    /// which does everything once more; [`expect_rebuilds`](Self::expect_rebuilds) sees to it that nothing
    /// else makes it do so.
    pub(crate) fn is_undisturbed(&self) -> bool {
        let status = self.status();
        let is_undisturbed = status["rebuilds"] == 0 && status["restarts"] == 0;
        if !is_undisturbed {
            println!("the machine held up the gateway: {status}");
        }
        is_undisturbed
    }

    /// Asserts what holds unless something that RustDDS does every 6 s is a second late; a thread that only
    /// sleeps must then have been late as well.
    pub(crate) fn assert_brief(&self, what: &str, holds: bool) {
        if !holds {
            assert_gap(&self.status(), what, Duration::from_secs(1));
        }
    }

    /// Sends a report, and waits until a volatile reader has it, see
    /// [`expect_by_itself`](Self::expect_by_itself).
    pub(crate) fn expect_at(&self, reader: &JsonProcess, command: &str, is_it: impl Fn(&Value) -> bool) {
        let beside = Bystander::start();
        self.send(command);
        self.expect_by_itself(reader, command, beside, is_it);
    }

    /// Waits until a volatile reader has a report that was sent. A reader that the machine keeps from meeting
    /// a new writer for longer than that repeats its report misses it: then it is sent again, and a thread
    /// that only sleeps must have been late as well.
    pub(crate) fn expect_by_itself(
        &self,
        reader: &JsonProcess,
        command: &str,
        beside: Bystander,
        is_it: impl Fn(&Value) -> bool,
    ) {
        let is_there = reader.next_within(AGAIN, &is_it).is_some();
        let lateness = beside.finish();
        if !is_there {
            self.send(command);
            reader.next(command, is_it);
            let waited = waited(reader.id()).max(waited(self.id()));
            lateness.assert_gap("meeting a new writer", REPEATED, REPEATED * 2 / 3 + waited);
        }
    }

    /// Stops the process for a while, as a debugger or a machine that sleeps does.
    pub(crate) fn stand_still(&self, pause: Duration) {
        let signal = |name: &str| {
            let process = self.0.id().to_string();
            assert!(Command::new("kill").args([name, &process]).status().unwrap().success());
        };
        signal("-STOP");
        let_pass(pause, "in which the process stands still");
        signal("-CONT");
    }

    /// Ends it in order; returns how long `RosSession::stop` took.
    pub(crate) fn stop(self) -> Duration {
        self.send("stop");
        let line = self.0.next("its end", |line| line["event"] == "stopped");
        let took = Duration::from_millis(line["millis"].as_u64().unwrap());
        let Measured { lateness, waited } = Measured::of(&line);
        lateness.assert_span("the end of the session", took, STOP_LIMIT + waited);
        took
    }
}

/// Asserts that a gateway's network process was not replaced; one that the machine lets wait for 5 s may be.
pub(crate) fn assert_no_restart(status: &Value) {
    if status["restarts"] != 0 {
        assert_eq!(status["failure"], "no answer", "{status}");
        assert_gap(status, "an answer of the network process", Duration::from_secs(5));
    }
}

/// Asserts that a process of a gateway may have been held up for so long: a thread that only sleeps was late
/// as well, or another one has waited for a processor for half of it.
fn assert_gap(status: &Value, what: &str, gap: Duration) {
    let Measured { lateness, waited } = Measured::of(status);
    lateness.assert_gap(what, gap, gap / 2 + waited);
}

/// What the machine took from the process of a gateway.
struct Measured {
    /// How late a thread was that only slept.
    lateness: Lateness,
    /// The longest time that a thread has waited for a processor.
    waited: Duration,
}

impl Measured {
    /// Reads what a line of it says.
    fn of(line: &Value) -> Self {
        let time = |key: &str| Duration::from_micros(line[key].as_u64().unwrap());
        let lateness = Lateness { worst: time("worst_us"), total: time("total_us") };
        Self { lateness, waited: time("waited_us") }
    }
}
