//! Finds the running gateway that a command asks.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::arguments::{ConfigArgs, settings};
use super::exit_code::{UNREACHABLE, USAGE};
use super::failure::Failure;
use super::messages;
use crate::io::snapshots::client::{ClientError, StatusClient};
use crate::io::snapshots::places::{SERVICE_SOCKET, absolute_text, instance_name, sockets};
use crate::process_status::snapshot::ProcessSnapshot;
use crate::report::gateway_view::age_text;

/// The gateway to ask; by default the only one that runs.
#[derive(Debug, Args)]
pub(super) struct RunningArgs {
    /// Status socket of the gateway
    #[arg(long, value_name = "PATH", conflicts_with = "config")]
    socket: Option<PathBuf>,
    /// Configuration of the gateway, of several that run
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
}

/// A gateway that runs on this computer.
pub(super) struct RunningGateway {
    pub(super) socket: PathBuf,
    /// Its process; `None` if its state cannot be read, as from another version.
    process: Option<ProcessSnapshot>,
}

/// A socket to ask, or the exit code of a command that has none and has said why.
pub(super) type Asked = Result<PathBuf, ExitCode>;

impl RunningArgs {
    /// Finds the socket to ask. `command` is the name of the subcommand, for messages.
    pub(super) fn find(&self, command: &str) -> Result<Asked, Failure> {
        match (&self.socket, &self.config) {
            (Some(socket), _) => Ok(Ok(socket.clone())),
            (None, Some(config)) => with_configuration(config, command),
            (None, None) => Ok(only(&gateways(), command)),
        }
    }

    /// Returns true if the command line chooses a gateway.
    pub(super) fn is_given(&self) -> bool {
        self.socket.is_some() || self.config.is_some()
    }
}

impl RunningGateway {
    /// Returns true for the gateway with this process id.
    pub(super) fn has_pid(&self, pid: u32) -> bool {
        self.process.as_ref().is_some_and(|process| process.pid == pid)
    }

    fn has_configuration(&self, path: &str) -> bool {
        self.process.as_ref().is_some_and(|process| process.configuration_file.as_deref() == Some(path))
    }

    /// Describes the gateway in two lines: what runs since when, and the command that asks it.
    fn text(&self, command: &str) -> String {
        let running = self.process.as_ref().map_or_else(
            || "cannot be read: another version".to_owned(),
            |process| {
                let file = process.configuration_file.as_deref().unwrap_or("no configuration file");
                let time = age_text(process.uptime_ms);
                format!("{file}, {}, for {time}", process.vehicle)
            },
        );
        let (name, socket) = (instance_name(&self.socket), self.socket.display());
        format!("  {name}: {running}\n    signal-gateway {command} --socket {socket}")
    }
}

/// Returns the gateways that run here and that this user may ask.
pub(super) fn gateways() -> Vec<RunningGateway> {
    let ask = |socket: PathBuf| {
        let received = StatusClient::connect(&socket).and_then(|mut client| client.receive());
        let process = match received {
            Ok((snapshot, _)) => snapshot.process,
            Err(ClientError::Socket(_)) => return None,
            Err(ClientError::Busy | ClientError::NoHistory | ClientError::Unreadable(_)) => None,
        };
        Some(RunningGateway { socket, process })
    };
    sockets().into_iter().filter_map(ask).collect()
}

fn with_configuration(config: &Path, command: &str) -> Result<Asked, Failure> {
    let path = absolute_text(config);
    let mut running = gateways();
    if running.iter().any(|gateway| gateway.has_configuration(&path)) {
        running.retain(|gateway| gateway.has_configuration(&path));
        return Ok(only(&running, command));
    }
    let args = ConfigArgs { config: Some(config.to_owned()), profile: None };
    if let Some(socket) = settings(&args)?.status.socket {
        return Ok(Ok(socket));
    }
    messages::error(&format!("no gateway runs with {path}"), "start it, or choose another");
    list(&running, command);
    Ok(Err(ExitCode::from(UNREACHABLE)))
}

/// Returns the socket of the only gateway; of the service if none runs, whose error says why.
fn only(running: &[RunningGateway], command: &str) -> Asked {
    match running {
        [] => Ok(PathBuf::from(SERVICE_SOCKET)),
        [gateway] => Ok(gateway.socket.clone()),
        several => {
            messages::error(&format!("{} gateways run here", several.len()), "choose one");
            list(several, command);
            Err(ExitCode::from(USAGE))
        }
    }
}

/// Lists gateways, each with the command that asks it.
fn list(running: &[RunningGateway], command: &str) {
    for gateway in running {
        messages::say(&gateway.text(command));
    }
}

/// Finds the socket of the gateway that runs with a configuration, else of the only gateway, else of the
/// service.
pub(super) fn likely_socket(config: &Path) -> PathBuf {
    let (path, mut running) = (absolute_text(config), gateways());
    let position = running.iter().position(|gateway| gateway.has_configuration(&path));
    match (position, running.len()) {
        (Some(position), _) => running.swap_remove(position).socket,
        (None, 1) => running.swap_remove(0).socket,
        (None, _) => PathBuf::from(SERVICE_SOCKET),
    }
}
