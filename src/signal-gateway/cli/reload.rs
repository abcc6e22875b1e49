//! `reload`: makes the running gateway reload its configuration, and waits for the result.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;

use super::exit_code::UNREACHABLE;
use super::failure::Failure;
use super::messages;
use super::running::{Asked, RunningArgs, gateways};
use super::status::{remedy, unreachable};
use crate::io::hangup::{hang_up, refuses_hangup};
use crate::io::snapshots::client::{ClientError, StatusClient};
use crate::io::snapshots::places::SERVICE_SOCKET;
use crate::process_status::configuration::{ConfigurationState, Reload};
use crate::process_status::snapshot::Snapshot;
use crate::report::text::escaped;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway reload                  what `systemctl reload signal-gateway` runs
  signal-gateway check --against-running

A configuration that is refused, or that needs a restart, leaves the one before in effect; the exit
code is 3 then, and 8 where no gateway can be reached.";

/// Maximum wait for the new configuration; reading a large map takes seconds.
const PATIENCE: Duration = Duration::from_secs(60);

#[derive(Debug, Args)]
pub(super) struct ReloadArgs {
    #[command(flatten)]
    running: RunningArgs,
    /// Process of the gateway; without a status socket the request is sent to it nevertheless, and its log
    /// says what becomes of it
    #[arg(long)]
    pid: Option<u32>,
}

pub(super) fn run(args: &ReloadArgs) -> Result<ExitCode, Failure> {
    let socket = match socket(args)? {
        Ok(socket) => socket,
        Err(code) => return Ok(code),
    };
    let connected = StatusClient::connect(&socket).and_then(|mut client| {
        let (snapshot, _) = client.receive()?;
        Ok((client, snapshot))
    });
    let (mut client, before) = match (connected, args.pid) {
        (Ok(connected), _) => connected,
        (Err(_), Some(pid)) => {
            if let Some(reason) = refuses_hangup(pid) {
                messages::error(&format!("process {pid} does not reload: {reason}"), "restart it");
                return Ok(ExitCode::from(UNREACHABLE));
            }
            hang_up(pid)?;
            return Ok(ExitCode::SUCCESS);
        }
        (Err(error), None) => return Ok(unreachable(&socket, &error)),
    };
    let Some((before, pid)) = configuration(&before) else {
        messages::error(
            "this gateway does not reload: it runs on a terminal, plays a recording, or is of another version",
            "restart it",
        );
        return Ok(ExitCode::from(UNREACHABLE));
    };
    hang_up(pid)?;
    match wait(&mut client, ended(before)) {
        Ok(reload) => show(&reload),
        Err(error) => {
            messages::error(&format!("no answer from {}: {error}", socket.display()), remedy(&error));
            Ok(ExitCode::from(UNREACHABLE))
        }
    }
}

/// Finds the socket of the gateway: of the process if only that is given, and it has one.
fn socket(args: &ReloadArgs) -> Result<Asked, Failure> {
    match args.pid {
        Some(pid) if !args.running.is_given() => {
            let own = gateways().into_iter().find(|gateway| gateway.has_pid(pid));
            Ok(Ok(own.map_or_else(|| PathBuf::from(SERVICE_SOCKET), |gateway| gateway.socket)))
        }
        Some(_) | None => args.running.find("reload"),
    }
}

/// Returns the configuration of a gateway that can reload, and its process id.
fn configuration(snapshot: &Snapshot) -> Option<(&ConfigurationState, u32)> {
    let process = snapshot.process.as_ref()?;
    Some((process.configuration.as_ref()?, process.pid))
}

/// Returns the number of completed reloads.
fn ended(configuration: &ConfigurationState) -> u64 {
    configuration.reloads.saturating_add(configuration.refused)
}

/// Waits until more reloads than `before` have been completed; returns the last one.
fn wait(client: &mut StatusClient, before: u64) -> Result<Reload, ClientError> {
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        let (snapshot, _) = client.receive()?;
        if let Some((configuration, _)) = configuration(&snapshot)
            && ended(configuration) > before
            && let Some(reload) = &configuration.last_reload
        {
            return Ok(reload.clone());
        }
    }
    Err(io::Error::new(io::ErrorKind::TimedOut, "the configuration is still being read").into())
}

fn show(reload: &Reload) -> Result<ExitCode, Failure> {
    if let Some(reason) = &reload.reason {
        let lines: Vec<_> = reason.lines().map(escaped).collect();
        messages::error(&format!("the configuration before goes on: {}", lines.join("\n")), "");
        return Ok(ExitCode::from(3));
    }
    let mut out = io::stdout().lock();
    if reload.changes.is_empty() {
        writeln!(out, "reloaded; nothing is different")?;
    } else {
        writeln!(out, "reloaded:")?;
    }
    for change in &reload.changes {
        writeln!(out, "  {}", escaped(&change.to_string()))?;
    }
    Ok(ExitCode::SUCCESS)
}
