//! `status`: the present state of a running gateway.

use std::io::{self, IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::{Failure, messages};
use crate::core::diagnostics::Level;
use crate::io::snapshots::client::{ClientError, StatusClient};
use crate::report::status::text;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway status                  the present state of the service, as text
  signal-gateway status --watch
  signal-gateway status --json | jq .buses
  signal-gateway status --quiet || echo \"look at the vehicle\"

The socket belongs to the user and the group of the service: sudo usermod -aG signal-gateway $USER
docs/status.md describes the JSON.

Exit codes:
  0  everything is OK
  4  warnings
  7  errors
  8  no gateway can be reached";

const UNREACHABLE: u8 = 8;

#[derive(Debug, Args)]
pub(super) struct StatusArgs {
    /// Socket of the gateway
    #[arg(long, value_name = "PATH", default_value = "/run/signal-gateway/status.sock")]
    socket: PathBuf,
    /// Print a line of JSON
    #[arg(long)]
    json: bool,
    /// Go on, twice a second, until Ctrl-C or until the gateway ends
    #[arg(long)]
    watch: bool,
}

pub(super) fn run(args: &StatusArgs) -> Result<ExitCode, Failure> {
    let unreachable = |error: ClientError| {
        messages::error(&format!("no status from {}: {error}", args.socket.display()), remedy(&error));
        Ok(ExitCode::from(UNREACHABLE))
    };
    let mut client = match StatusClient::connect(&args.socket) {
        Ok(client) => client,
        Err(error) => return unreachable(error),
    };
    loop {
        let (snapshot, line) = match client.receive() {
            Ok(received) => received,
            Err(error) => return unreachable(error),
        };
        if !messages::options().quiet {
            print(&if args.json { line } else { text(&snapshot) }, args)?;
        }
        if !args.watch {
            return Ok(ExitCode::from(match snapshot.level {
                Level::Ok => 0,
                Level::Warn | Level::Stale => 4,
                Level::Error => 7,
            }));
        }
    }
}

/// Prints a state; one that is watched on a terminal in place of the one before.
fn print(text: &str, args: &StatusArgs) -> io::Result<()> {
    let mut out = io::stdout().lock();
    if args.watch && !args.json {
        let before = if out.is_terminal() { "\x1b[H\x1b[2J" } else { "" };
        let after = if out.is_terminal() { "" } else { "\n" };
        write!(out, "{before}{text}{after}")?;
    } else {
        write!(out, "{text}")?;
    }
    out.flush()
}

fn remedy(error: &ClientError) -> &'static str {
    let ClientError::Socket(error) = error else { return "" };
    let kind = error.kind();
    if [io::ErrorKind::NotFound, io::ErrorKind::ConnectionRefused].contains(&kind) {
        "start the service, or give the path of another socket with --socket"
    } else if kind == io::ErrorKind::PermissionDenied {
        "join the group of the service: sudo usermod -aG signal-gateway $USER"
    } else {
        ""
    }
}
