//! The state of the packaged service, as systemd reports it.

use std::fs;
use std::io;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

/// Name of the shipped unit.
const UNIT: &str = "signal-gateway.service";
/// File of the unit's environment.
const ENVIRONMENT: &str = "/etc/default/signal-gateway";
const PROPERTIES: &str = "LoadState,UnitFileState,ActiveState,SubState,ExecMainStatus,MainPID,ExecStart";

/// State of the unit.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ServiceState {
    /// True if the unit is installed.
    pub is_installed: bool,
    /// `enabled`, `disabled`, `masked`, …
    pub unit_file_state: String,
    /// `active`, `inactive`, `failed`, `activating`, …
    pub active_state: String,
    /// Exit code of the unit's last process.
    pub exit_code: i32,
    /// Id of its process; `None` while it has none.
    pub pid: Option<u32>,
    /// Configuration named on its command line; `None` if there is none.
    pub configuration: Option<String>,
    /// `ROS_DOMAIN_ID` in its environment file; `None` if it is not set there.
    pub domain_id: Option<String>,
}

/// Reason why systemd could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum SystemctlError {
    /// The program cannot be started.
    #[error("systemctl cannot be run: {0}")]
    NotRun(#[from] io::Error),
    /// The program ended with an error, whose first line this is.
    #[error("systemctl fails: {0}")]
    Failed(String),
}

/// Queries systemd for the state of the unit.
pub fn service_state() -> Result<ServiceState, SystemctlError> {
    let show = ["show", UNIT, "--no-pager", "--property", PROPERTIES];
    let output = Command::new("systemctl").args(show).stdin(Stdio::null()).output()?;
    if !output.status.success() {
        let reason = String::from_utf8_lossy(&output.stderr);
        return Err(SystemctlError::Failed(reason.lines().next().unwrap_or_default().to_owned()));
    }
    let environment = fs::read_to_string(ENVIRONMENT).unwrap_or_default();
    Ok(parsed(&String::from_utf8_lossy(&output.stdout), &environment))
}

/// Parses the properties and the environment file, both with lines of `NAME=value`.
fn parsed(properties: &str, environment: &str) -> ServiceState {
    let value = |text: &str, name: &str| {
        let mut values = text.lines().filter_map(|line| line.trim().split_once('='));
        values.rfind(|(key, _)| *key == name).map(|(_, value)| value.trim_matches('"').to_owned())
    };
    let property = |name| value(properties, name).unwrap_or_default();
    ServiceState {
        is_installed: property("LoadState") == "loaded",
        unit_file_state: property("UnitFileState"),
        active_state: property("ActiveState"),
        exit_code: property("ExecMainStatus").parse().unwrap_or_default(),
        pid: property("MainPID").parse().ok().filter(|pid| *pid > 0),
        configuration: configuration(&property("ExecStart")),
        domain_id: value(environment, "ROS_DOMAIN_ID"),
    }
}

/// Returns the configuration named in a command line, in the form that systemd shows: `{ path=… ; argv[]=…
/// run --config FILE ; … }`.
fn configuration(command: &str) -> Option<String> {
    let mut words = command.split_whitespace();
    while let Some(word) = words.next() {
        match word.split_once('=') {
            Some(("--config", file)) => return Some(file.to_owned()),
            None if word == "--config" || word == "-c" => return words.next().map(str::to_owned),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Output of systemd 252.
    const SHOWN: &str = "ExecMainStatus=3\nExecStart={ path=/usr/local/bin/signal-gateway ; \
        argv[]=/usr/local/bin/signal-gateway run --config /etc/signal-gateway/gateway.toml ; ignore_errors=no ; \
        start_time=[n/a] ; stop_time=[n/a] ; pid=0 ; code=(null) ; status=0/0 }\nMainPID=0\nLoadState=loaded\n\
        ActiveState=failed\nSubState=failed\nUnitFileState=disabled\n";

    #[test]
    fn unit_is_read_with_its_command_line_and_its_environment() {
        let environment = "# ROS_DOMAIN_ID=1\nROS_DOMAIN_ID=2\n ROS_DOMAIN_ID=\"42\"\n";
        let expected = ServiceState {
            is_installed: true,
            unit_file_state: "disabled".to_owned(),
            active_state: "failed".to_owned(),
            exit_code: 3,
            pid: None,
            configuration: Some("/etc/signal-gateway/gateway.toml".to_owned()),
            domain_id: Some("42".to_owned()),
        };
        assert_eq!(parsed(SHOWN, environment), expected);
        let absent = parsed("LoadState=not-found\nActiveState=inactive\nUnitFileState=\nMainPID=0\n", "");
        assert!(!absent.is_installed && absent.configuration.is_none() && absent.domain_id.is_none());
        assert_eq!(configuration("gateway run --config=a.toml").as_deref(), Some("a.toml"));
        assert_eq!(configuration("gateway run -c"), None);
    }
}
