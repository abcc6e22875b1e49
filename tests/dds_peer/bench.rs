//! The two sides of a test: the gateway's session, and a reader that is not ours; each in a process
//! of its own.
//!
//! The session runs in this test's own executable, started again with an environment variable, so
//! that it can be put into a network namespace. Both sides are told what to do over standard
//! input, answer in lines of JSON, and end when their input does.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

/// How long a test waits for what must come; our own lease of 50 s is the longest wait.
pub(crate) const PATIENCE: Duration = Duration::from_secs(70);

/// A domain no other test of this run uses, with ports below the ephemeral range.
pub(crate) fn domain() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = u16::try_from(std::process::id() % 60).unwrap();
    20 + first + NEXT.fetch_add(1, Ordering::Relaxed)
}

/// A process that speaks lines of JSON.
pub(crate) struct Side {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<Value>,
    name: String,
}

impl Side {
    /// Starts it; `name` is for messages.
    pub(crate) fn start(name: &str, mut command: Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{name} does not start: {error}"));
        let output = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                // The test harness of the gateway's process says things of its own.
                if let Ok(value) = serde_json::from_str(&line)
                    && sender.send(value).is_err()
                {
                    return;
                }
            }
        });
        Self { input: child.stdin.take(), child, lines, name: name.to_owned() }
    }

    /// Tells it something.
    pub(crate) fn tell(&mut self, line: &str) {
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    /// Waits for a line that `is_it`; others are passed over.
    pub(crate) fn wait_for(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            match self.lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) if is_it(&line) => return line,
                Ok(_) => {}
                Err(error) => panic!("{}: waited for {what}: {error}", self.name),
            }
        }
    }

    /// What came during a while.
    pub(crate) fn during(&self, while_: Duration) -> Vec<Value> {
        let deadline = Instant::now() + while_;
        let mut seen = vec![];
        loop {
            match self.lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) => seen.push(line),
                Err(RecvTimeoutError::Timeout) => return seen,
                Err(RecvTimeoutError::Disconnected) => panic!("{} ended", self.name),
            }
        }
    }

    /// Kills the process without a chance to say goodbye.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
    }
}

impl Drop for Side {
    fn drop(&mut self) {
        drop(self.input.take());
        let deadline = Instant::now() + Duration::from_secs(5);
        while Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            thread::sleep(Duration::from_millis(5));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A session in a process of its own.
pub(crate) struct Gateway(Side);

impl Gateway {
    /// Starts it with a durability, or a durability and the addresses of the only networks; see
    /// [`super::session::session_process`] for the commands.
    pub(crate) fn start(namespace: Option<&str>, domain: u16, role: &str) -> Self {
        Self::start_as(namespace, domain, role, "")
    }

    /// Likewise, with the topics of [`super::lights`].
    pub(crate) fn start_with_lights(namespace: Option<&str>, domain: u16) -> Self {
        Self::start_as(namespace, domain, "transient_local", "lights")
    }

    /// Likewise, with the topics of [`super::autoware_topics`].
    pub(crate) fn start_with_autoware(domain: u16) -> Self {
        Self::start_as(None, domain, "transient_local", "autoware")
    }

    fn start_as(namespace: Option<&str>, domain: u16, role: &str, topics: &str) -> Self {
        let mut command = inside(namespace, &std::env::current_exe().unwrap());
        command.args(["--exact", "session::session_process", "--nocapture", "--test-threads=1"]);
        command.env("SIGNAL_GATEWAY_TEST_SESSION", format!("{domain} {role}"));
        command.env("SIGNAL_GATEWAY_TEST_TOPICS", topics);
        let side = Side::start("the gateway", command);
        side.wait_for("its start", |line| line["event"] == "ready");
        Self(side)
    }

    /// Tells it something.
    pub(crate) fn tell(&mut self, command: &str) {
        self.0.tell(command);
    }

    /// Waits for a line that `is_it`; others are passed over.
    pub(crate) fn wait_for(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.0.wait_for(what, is_it)
    }

    /// What it said during a while.
    pub(crate) fn during(&self, while_: Duration) -> Vec<Value> {
        self.0.during(while_)
    }

    /// What it says of itself.
    pub(crate) fn status(&mut self) -> Value {
        self.tell("status");
        self.0.wait_for("its status", |line| line["event"] == "status")
    }

    /// Waits until its status is as wanted.
    pub(crate) fn wait_until(&mut self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = self.status();
            if is_it(&status) {
                return status;
            }
            assert!(Instant::now() < deadline, "the gateway: waited for {what}: {status}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Stops the process for a while, as a debugger or a machine that sleeps does.
    pub(crate) fn stand_still(&self, pause: Duration) {
        let signal = |name: &str| {
            let process = self.0.child.id().to_string();
            assert!(Command::new("kill").args([name, &process]).status().unwrap().success());
        };
        signal("-STOP");
        thread::sleep(pause);
        signal("-CONT");
    }

    /// Ends it in order; says how long `RosSession::stop` took.
    pub(crate) fn stop(mut self) -> Duration {
        self.tell("stop");
        let line = self.0.wait_for("its end", |line| line["event"] == "stopped");
        Duration::from_millis(line["millis"].as_u64().unwrap())
    }
}

/// A program to be run in a network namespace, or here.
pub(crate) fn inside(namespace: Option<&str>, program: &Path) -> Command {
    let Some(namespace) = namespace else { return Command::new(program) };
    let mut command = Command::new("ip");
    command.args(["netns", "exec", namespace]).arg(program);
    command
}
