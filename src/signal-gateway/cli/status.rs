//! `status`: prints the current state of a running gateway.

use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::exit_code::UNREACHABLE;
use super::failure::Failure;
use super::messages;
use super::running::RunningArgs;
use crate::io::snapshots::client::{ClientError, StatusClient};
use crate::process_status::snapshot::Snapshot;
use crate::report::gateway_view::GatewayView;
use crate::report::history::entry_text;
use crate::report::schema::schema;
use crate::report::status::text;
use gateway_base::diagnostics::Level;
use gateway_base::names::variant;
use gateway_core::gateway::history::{HistoryEntry, HistoryRequest};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway status                  the present state of the only gateway, as text
  signal-gateway status -c kona.toml     of several, the one with this configuration
  signal-gateway status --watch
  signal-gateway status --json | jq .buses
  signal-gateway status --quiet || echo \"look at the vehicle\"
  signal-gateway status --history | less +G
  signal-gateway status --history=ERROR --watch    errors so far, and from now on

Several gateways are listed, each with the command that asks it (exit code 2). The user and the
group of the service may ask it: sudo usermod -aG signal-gateway $USER
docs/status.md describes the JSON, and --schema prints its JSON Schema.

Exit codes:
  0  everything is OK
  4  warnings
  7  errors
  8  no gateway can be reached";

const RECONNECT_INTERVAL: Duration = Duration::from_millis(500);

#[derive(Debug, Args)]
pub(super) struct StatusArgs {
    #[command(flatten)]
    running: RunningArgs,
    /// Print a line of JSON
    #[arg(long)]
    json: bool,
    /// Print the JSON Schema of that line; no gateway is needed
    #[arg(long, conflicts_with_all = ["json", "watch"])]
    schema: bool,
    /// Print what has changed in the last hours, oldest first; with a LEVEL, changes of this level or worse
    #[arg(long, value_name = "LEVEL", num_args = 0..=1, require_equals = true, default_missing_value = "OK", value_parser = level())]
    history: Option<Level>,
    /// Print twice a second until Ctrl-C, and wait for a gateway that has ended
    #[arg(long)]
    watch: bool,
}

fn level() -> impl TypedValueParser<Value = Level> {
    PossibleValuesParser::new(["OK", "WARN", "ERROR"]).try_map(|name| variant(&name).ok_or("not a level"))
}

pub(super) fn run(args: &StatusArgs) -> Result<ExitCode, Failure> {
    if args.schema {
        let schema = if args.history.is_some() { schema::<HistoryEntry>() } else { schema::<Snapshot>() };
        print(&format!("{schema:#}\n"), args)?;
        return Ok(ExitCode::SUCCESS);
    }
    let socket = match args.running.find("status")? {
        Ok(socket) => socket,
        Err(code) => return Ok(code),
    };
    if let Some(level) = args.history {
        return history(args, &socket, level);
    }
    let mut client = match StatusClient::connect(&socket) {
        Ok(client) => client,
        Err(error) => return Ok(unreachable(&socket, &error)),
    };
    loop {
        let (snapshot, line) = match client.receive() {
            Ok(received) => received,
            Err(error) if args.watch => {
                client = reconnect(args, &socket, &error)?;
                continue;
            }
            Err(error) => return Ok(unreachable(&socket, &error)),
        };
        if !messages::options().quiet {
            let width = messages::layout(&io::stdout()).width;
            let shown = if args.json { line } else { text(&GatewayView::of(&snapshot), width) };
            print(&shown, args)?;
        }
        if !args.watch {
            return Ok(exit_code(snapshot.level));
        }
    }
}

/// Returns the exit code for the worst level that was found.
pub(super) fn exit_code(level: Level) -> ExitCode {
    ExitCode::from(match level {
        Level::Ok => 0,
        Level::Warn | Level::Stale => 4,
        Level::Error => 7,
    })
}

fn history(args: &StatusArgs, socket: &Path, level: Level) -> Result<ExitCode, Failure> {
    let (mut after, mut is_connected) = (0, false);
    loop {
        let request = HistoryRequest { after: Some(after), level, ..HistoryRequest::default() };
        // Each time a new connection, since snapshots would pile up on one while printing blocks.
        let page = match StatusClient::connect(socket).and_then(|mut client| client.history(request)) {
            Ok(page) => page,
            Err(error) if args.watch && after > 0 && !matches!(error, ClientError::NoHistory) => {
                if is_connected {
                    let socket = socket.display();
                    messages::warn(&format!("no history from {socket}: {error}; waiting for it"));
                }
                is_connected = false;
                sleep(RECONNECT_INTERVAL);
                continue;
            }
            Err(error) => return Ok(unreachable(socket, &error)),
        };
        is_connected = true;
        let mut out = io::stdout().lock();
        for entry in &page.entries {
            if args.json {
                writeln!(out, "{}", serde_json::to_string(entry).map_err(io::Error::from)?)?;
            } else {
                write!(out, "{}", entry_text(entry))?;
            }
        }
        out.flush()?;
        drop(out);
        // After a clock that was set back, a gateway without a history file begins at lower numbers.
        let last = page.entries.last().map_or(after, |entry| entry.number);
        after = if page.next_number <= last { 0 } else { last };
        if !page.has_more {
            if !args.watch {
                return Ok(ExitCode::SUCCESS);
            }
            sleep(RECONNECT_INTERVAL);
        }
    }
}

/// Writes the reason why the gateway cannot be reached, and returns the exit code.
pub(super) fn unreachable(socket: &Path, error: &ClientError) -> ExitCode {
    messages::error(&format!("no status from {}: {error}", socket.display()), remedy(error));
    ExitCode::from(UNREACHABLE)
}

fn reconnect(args: &StatusArgs, socket: &Path, error: &ClientError) -> io::Result<StatusClient> {
    let lost = format!("no status from {}: {error}; waiting for it", socket.display());
    if !args.json && io::stdout().is_terminal() {
        // The state on the screen is out of date.
        print(&format!("{lost}\n"), args)?;
    } else {
        messages::warn(&lost);
    }
    loop {
        sleep(RECONNECT_INTERVAL);
        // The first snapshot would be shown twice, since the next one comes half a second later.
        if let Ok(mut client) = StatusClient::connect(socket)
            && client.receive().is_ok()
        {
            return Ok(client);
        }
    }
}

/// Prints a state. With `--watch` on a terminal it replaces the previous one.
fn print(text: &str, args: &StatusArgs) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match (args.watch && !args.json, out.is_terminal()) {
        (true, true) => write!(out, "\x1b[H\x1b[2J{text}")?,
        (true, false) => writeln!(out, "{text}")?,
        (false, _) => write!(out, "{text}")?,
    }
    out.flush()
}

pub(super) fn remedy(error: &ClientError) -> &'static str {
    let ClientError::Socket(error) = error else { return "" };
    #[allow(clippy::wildcard_enum_match_arm)] // there are forty kinds
    match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused => {
            "start the service, or a gateway as this user; that of a configuration with [status] socket: give it by --config"
        }
        io::ErrorKind::PermissionDenied => {
            "join the group of the service: sudo usermod -aG signal-gateway $USER"
        }
        _ => "",
    }
}
