//! The vehicle on the bus: `signal-gateway vehicle` in a process of its own, which follows commands, has a
//! driver, and reports its lights.

use std::process::Command;

use crate::support::json_process::{JsonProcess, Line, Mark};
use crate::support::process::Folder;

/// A running vehicle.
pub(crate) struct Car(JsonProcess);

/// Lights and whoever has set them: `left`, `command`.
pub(crate) type Lights = (String, String);

impl Car {
    /// With the folder's `car.toml`, on an interface.
    pub(crate) fn start(folder: &Folder, interface: &str, options: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.args(["vehicle", "--json", "--interface", interface, "--profile"]);
        command.arg(folder.path().join("car.toml")).args(options).current_dir(folder.path());
        Self(JsonProcess::start("the vehicle", &mut command).killed_in_the_end())
    }

    /// Sends a request to its standard input.
    pub(crate) fn request(&self, request: &str) {
        self.0.send(request);
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// Waits until its lights do this, and gives all they have done since `mark`.
    pub(crate) fn wait_for_lights(&self, mark: Mark, lights: &str, who: &str) -> Vec<Lights> {
        let mut states = Vec::new();
        self.0.find(mark, &format!("lights {lights} ({who})"), |line| {
            states.push(lights_of(line)?);
            (states.last()? == &(lights.to_owned(), who.to_owned())).then_some(())
        });
        states
    }

    /// What its lights have done since `mark`.
    pub(crate) fn lights_since(&self, mark: Mark) -> Vec<Lights> {
        self.0.lines(mark).iter().filter_map(lights_of).collect()
    }

    /// When that was, in seconds of its own.
    pub(crate) fn seconds_of_lights(&self, mark: Mark) -> Vec<f64> {
        let lines = self.0.lines(mark);
        let lights = lines.iter().filter(|line| lights_of(line).is_some());
        lights.filter_map(|(_, line)| line["t"].as_f64()).collect()
    }

    /// True if it has dropped a command since `mark` that was no longer received.
    pub(crate) fn has_dropped_a_command(&self, mark: Mark) -> bool {
        self.0.lines(mark).iter().any(|(_, line)| line["what"] == "command_timed_out")
    }
}

fn lights_of((_, line): &Line) -> Option<Lights> {
    let text = |key: &str| line[key].as_str().map(str::to_owned);
    (line["what"] == "lights").then(|| Some((text("lights")?, text("who")?)))?
}
