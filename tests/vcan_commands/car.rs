//! The vehicle on the bus: `signal-gateway vehicle` in a process of its own, which obeys, has a driver,
//! and says what its lights do.

use std::io::Write as _;
use std::process::{Child, ChildStdin, Command, Stdio};

use serde_json::Value;

use crate::lines::{Lines, listen};
use crate::process::{DEADLINE, Folder};

/// A running vehicle, and every line it has said.
pub(crate) struct Car {
    child: Child,
    input: ChildStdin,
    lines: Lines,
}

/// Lights and who wants them: `left`, `command`.
pub(crate) type Lights = (String, String);

impl Car {
    /// With the folder's profile, on an interface.
    pub(crate) fn start(folder: &Folder, interface: &str, options: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.args(["vehicle", "--json", "--interface", interface, "--profile"]);
        command.arg(folder.path().join("profile.toml")).args(options).current_dir(folder.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let lines = listen(&mut child);
        let input = child.stdin.take().unwrap();
        Self { child, input, lines }
    }

    /// Asks for something, in the words of its standard input.
    pub(crate) fn ask(&self, request: &str) {
        (&self.input).write_all(format!("{request}\n").as_bytes()).unwrap();
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> usize {
        self.lines.0.lock().unwrap().len()
    }

    /// Waits until its lights do this, and gives all they have done since `mark`.
    pub(crate) fn wait_for_lights(&self, mark: usize, lights: &str, who: &str) -> Vec<Lights> {
        let wanted = (lights.to_owned(), who.to_owned());
        let seen =
            |lines: &[Value]| -> Vec<Lights> { lines.iter().skip(mark).filter_map(lights_of).collect() };
        let lacks = |lines: &mut Vec<Value>| seen(lines).last() != Some(&wanted);
        let lines = self.lines.0.lock().unwrap();
        let (lines, timeout) = self.lines.1.wait_timeout_while(lines, DEADLINE, lacks).unwrap();
        let seen = seen(&lines);
        drop(lines);
        assert!(!timeout.timed_out(), "lights {lights} ({who}) never came: {seen:?}");
        seen
    }

    /// What its lights have done since `mark`.
    pub(crate) fn lights_since(&self, mark: usize) -> Vec<Lights> {
        self.lines.0.lock().unwrap().iter().skip(mark).filter_map(lights_of).collect()
    }

    /// When that was, in seconds of its own.
    pub(crate) fn seconds_of_lights(&self, mark: usize) -> Vec<f64> {
        let lines = self.lines.0.lock().unwrap();
        let lights = lines.iter().skip(mark).filter(|line| lights_of(line).is_some());
        lights.filter_map(|line| line["t"].as_f64()).collect()
    }

    /// Whether it has said since `mark` that it has dropped a command that came no more.
    pub(crate) fn has_dropped_a_command(&self, mark: usize) -> bool {
        let lines = self.lines.0.lock().unwrap();
        lines.iter().skip(mark).any(|line| line["what"] == "command_timed_out")
    }
}

fn lights_of(line: &Value) -> Option<Lights> {
    let word = |key: &str| line[key].as_str().map(str::to_owned);
    (line["what"] == "lights").then(|| Some((word("lights")?, word("who")?)))?
}

impl Drop for Car {
    fn drop(&mut self) {
        let _ended = (self.child.kill(), self.child.wait());
    }
}
