//! The built binary, run to its end.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// What a process has printed, and its exit code.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) error: String,
}

/// The binary in a folder, without a log level from the environment.
pub(crate) fn program(folder: impl AsRef<Path>, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(folder).env_remove("RUST_LOG").env("COLUMNS", "100").args(args);
    command
}

pub(crate) fn run(folder: impl AsRef<Path>, args: &[&str]) -> Ran {
    program(folder, args).output().unwrap().into()
}

impl From<Output> for Ran {
    fn from(Output { status, stdout, stderr }: Output) -> Self {
        let [out, error] = [stdout, stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        Self { code: status.code().unwrap_or(-1), out, error }
    }
}

impl Ran {
    /// Standard output and standard error.
    pub(crate) fn text(&self) -> String {
        format!("{}{}", self.out, self.error)
    }

    /// Asserts the exit code, and a part of what was printed.
    pub(crate) fn assert(&self, code: i32, part: &str) {
        assert_eq!(self.code, code, "{}", self.text());
        assert!(self.text().contains(part), "{part:?} is not in\n{}", self.text());
    }

    /// The standard output of a success.
    pub(crate) fn succeeded(self) -> String {
        self.assert(0, "");
        self.out
    }

    /// Its lines of JSON.
    pub(crate) fn json(&self) -> Vec<Value> {
        self.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}
