//! The gateway's side of a test: its session, in a process of its own.
//!
//! The session runs in this test's own executable, started again with an environment variable, so that it
//! can be put into a network namespace.

mod autoware_topics;
mod lights;
mod process;

use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

pub(crate) use autoware_topics::KINDS;

use crate::support::json_process::{JsonProcess, Mark, PATIENCE};
use crate::support::peer::inside;

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
        command.env(ROLE, self.settings.to_string());
        let process = JsonProcess::start("the gateway", &mut command);
        // What arrives before that is not passed over.
        process.wait_for(Mark::START, "its start", |line| line["event"] == "ready");
        Gateway(process)
    }
}

/// A running session, which takes the commands of [`process::session_process`].
pub(crate) struct Gateway(JsonProcess);

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

    /// The lines of that time.
    pub(crate) fn next_during(&self, time: Duration) -> Vec<Value> {
        self.0.next_during(time)
    }

    /// Its present status.
    pub(crate) fn status(&self) -> Value {
        self.send("status");
        self.0.next("its status", |line| line["event"] == "status")
    }

    /// Waits until its status is as required.
    pub(crate) fn wait_until(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.wait_while_doing(what, is_it, || thread::sleep(Duration::from_millis(20)))
    }

    /// Likewise, and does something between two looks.
    pub(crate) fn wait_while_doing(
        &self,
        what: &str,
        is_it: impl Fn(&Value) -> bool,
        mut meanwhile: impl FnMut(),
    ) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = self.status();
            if is_it(&status) {
                return status;
            }
            assert!(Instant::now() < deadline, "the gateway: waited for {what}: {status}");
            meanwhile();
        }
    }

    /// Stops the process for a while, as a debugger or a machine that sleeps does.
    pub(crate) fn stand_still(&self, pause: Duration) {
        let signal = |name: &str| {
            let process = self.0.id().to_string();
            assert!(Command::new("kill").args([name, &process]).status().unwrap().success());
        };
        signal("-STOP");
        thread::sleep(pause);
        signal("-CONT");
    }

    /// Ends it in order; returns how long `RosSession::stop` took.
    pub(crate) fn stop(self) -> Duration {
        self.send("stop");
        let line = self.0.next("its end", |line| line["event"] == "stopped");
        Duration::from_millis(line["millis"].as_u64().unwrap())
    }
}
