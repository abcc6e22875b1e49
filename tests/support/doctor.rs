//! `doctor --json`, run to its end.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::waiting::{described, wait_for};

/// What `doctor` has found.
#[derive(Debug)]
pub(crate) struct Diagnosis {
    pub(crate) code: i32,
    pub(crate) whole: Value,
}

impl Diagnosis {
    /// Runs a command of `doctor` with `--json`.
    pub(crate) fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let error = || String::from_utf8_lossy(&output.stderr).into_owned();
        let whole = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", error()));
        Self { code: output.status.code().unwrap(), whole }
    }

    fn outcomes(&self) -> impl Iterator<Item = &Value> {
        let checks = self.whole["checks"].as_array().unwrap().iter();
        checks.flat_map(|check| check["outcomes"].as_array().unwrap())
    }

    /// The remedy of a finding; `None` if it was not found.
    pub(crate) fn remedy(&self, finding: &str) -> Option<&str> {
        self.outcomes()
            .find(|outcome| outcome["finding"] == finding)
            .map(|found| found["remedy"].as_str().unwrap())
    }

    /// Asserts that this was found, with a remedy that contains `remedy`, and that the exit code tells of it.
    pub(crate) fn assert_found(&self, finding: &str, remedy: &str) {
        let found =
            self.remedy(finding).unwrap_or_else(|| panic!("no {finding} in {:#}", self.whole["checks"]));
        assert!(found.contains(remedy), "{remedy:?} is not in {found:?}");
        assert_eq!(self.code, if self.whole["level"] == "ERROR" { 7 } else { 4 });
    }

    /// Asserts that this is not found any more.
    pub(crate) fn assert_mended(&self, finding: &str) {
        assert_eq!(self.remedy(finding), None, "{:#}", self.whole["checks"]);
    }
}

/// A command of `doctor` for the configuration in a folder, without variables of ROS 2.
pub(crate) fn doctor(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(folder).args(["doctor", "--json"]).args(args);
    for variable in [
        "RUST_LOG",
        "ROS_DOMAIN_ID",
        "ROS_AUTOMATIC_DISCOVERY_RANGE",
        "ROS_LOCALHOST_ONLY",
        "ROS_STATIC_PEERS",
        "RMW_IMPLEMENTATION",
    ] {
        command.env_remove(variable);
    }
    command
}

/// Examines `gateway.toml` of a folder, listening for a second.
pub(crate) fn examine(folder: &Path) -> Diagnosis {
    Diagnosis::of(&mut doctor(folder, &["--config", "gateway.toml", "--seconds", "1"]))
}

/// Examines with `run` until a finding is there, or is not there any more.
#[allow(dead_code)] // for what others announce, which takes its time
pub(crate) fn wait_until_found(finding: &str, is_found: bool, run: impl Fn() -> Diagnosis) -> Diagnosis {
    let what = described(|| format!("{finding}: {is_found}"));
    wait_for(what, || Some(run()).filter(|diagnosis| diagnosis.remedy(finding).is_some() == is_found))
}
