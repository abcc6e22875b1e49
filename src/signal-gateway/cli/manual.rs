//! `man` and `completions`: print the texts that packages ship with the binary.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::failure::Failure;

pub(super) const EXIT_CODES: &str = "  0  done
  1  failed while running
  2  wrong usage
  3  a configuration, vehicle profile, DBC, scenario or map was refused
  4  check found warnings or errors; doctor or status found warnings;
     discover is not sure; no profile fits (identify, profiles find);
     replay received no frame on a configured interface
  5  the scenario of lights failed, or an expectation of decide was not met
  6  the scenario of lights ended without a verdict
  7  status or doctor found errors
  8  status, reload or check --against-running cannot reach a gateway
  9  check --against-running: the change needs a restart";

/// Environment variables for the pages of `run` and the whole program.
const ENVIRONMENT: [(&str, &str); 8] = [
    ("ROS_DOMAIN_ID", "the domain, unless [ros] domain_id gives it"),
    (
        "ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE",
        "1 and LOCALHOST: the loopback alone, unless [ros] only_networks names networks; OFF is refused",
    ),
    (
        "RUST_LOG",
        "level of the log: error, warn, info, debug, trace or off, or MODULE=LEVEL, with commas between them; it \
         comes before --log-level of --ros-args",
    ),
    ("NO_COLOR, CLICOLOR_FORCE", "no colours, and colours without a terminal; --color comes first"),
    (
        "STATE_DIRECTORY, RUNTIME_DIRECTORY",
        "set by systemd: where the black box and the socket for status are, unless the configuration says so",
    ),
    ("XDG_RUNTIME_DIR", "where the socket for status of a gateway without systemd is, in signal-gateway"),
    (
        "SIGNAL_GATEWAY_SUPERVISOR",
        "set by the unit: the socket at which systemd starts the network process as a user of its own",
    ),
    ("NOTIFY_SOCKET, WATCHDOG_USEC, JOURNAL_STREAM", "set by systemd: readiness, watchdog, journal"),
];

const FILES: [(&str, &str); 7] = [
    ("/etc/signal-gateway/gateway.toml", "the configuration, where --config names no other"),
    ("/etc/default/signal-gateway", "variables for the service, such as ROS_DOMAIN_ID=42"),
    (
        "/usr/share/signal-gateway/config/gateway.toml",
        "every key of the configuration, with unit, range and default",
    ),
    ("/usr/share/signal-gateway", "vehicle profiles, DBC files, maps, drives and scenarios"),
    ("/usr/share/doc/signal-gateway", "the documents; docs/troubleshooting.md is by symptom"),
    (
        "/run/signal-gateway/status.sock",
        "the service's socket for status, reload and check --against-running",
    ),
    ("/var/lib/signal-gateway/black-box", "recordings around faults"),
];

#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// Name of the shell
    shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Folder to write signal-gateway.1, signal-gateway-run.1 … to
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

pub(super) fn completions(args: &CompletionsArgs, mut command: Command) -> Result<ExitCode, Failure> {
    // The generator panics if a writer fails; a buffer does not fail.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "signal-gateway", &mut script);
    io::stdout().write_all(&script)?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn man(args: &ManArgs, mut command: Command) -> Result<ExitCode, Failure> {
    command.build();
    let Some(folder) = &args.out else {
        io::stdout().write_all(&page(command, EXIT_CODES)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    std::fs::create_dir_all(folder)?;
    let own = |command: &Command| {
        let name = command.get_display_name().unwrap_or(command.get_name());
        let exit_codes = exit_codes(command);
        std::fs::write(folder.join(format!("{name}.1")), page(command.clone(), &exit_codes)?)
    };
    command.get_subcommands().filter(|command| !command.is_hide_set()).try_for_each(own)?;
    std::fs::write(folder.join("signal-gateway.1"), page(command, EXIT_CODES)?)?;
    Ok(ExitCode::SUCCESS)
}

/// Renders the page of a command: clap's part, its help as sections, then environment and files.
fn page(command: Command, exit_codes: &str) -> io::Result<Vec<u8>> {
    let is_main = command.get_name() == "signal-gateway";
    let has_surroundings = is_main || command.get_name() == "run";
    let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let version = env!("SIGNAL_GATEWAY_VERSION");
    let mut page = Vec::new();
    Man::new(command.after_help(None::<&str>))
        .source(format!("signal-gateway {version}"))
        .render(&mut page)?;
    let mut roff = Roff::new();
    roff.control("SH", ["EXIT STATUS"]);
    for (code, meaning) in exit_codes.lines().filter_map(|line| line.trim().split_once("  ")) {
        entry(&mut roff, code, meaning);
    }
    if has_surroundings {
        roff.control("SH", ["ENVIRONMENT"]);
        for (name, text) in ENVIRONMENT {
            entry(&mut roff, name, text);
        }
        roff.control("SH", ["FILES"]);
        for (path, text) in FILES {
            entry(&mut roff, path, text);
        }
    }
    let is_note = |block: &&str| !block.starts_with("Examples:") && !block.starts_with("Exit codes:");
    let notes: Vec<_> = help.split("\n\n").filter(is_note).collect();
    if !notes.is_empty() {
        roff.control("SH", ["NOTES"]);
        as_it_is(&mut roff, &notes.join("\n\n"));
    }
    if let Some(examples) = help.split("\n\n").find_map(|block| block.strip_prefix("Examples:\n")) {
        roff.control("SH", ["EXAMPLES"]);
        as_it_is(&mut roff, examples);
    }
    roff.control("SH", ["SEE ALSO"]);
    let main = if is_main { "" } else { "signal-gateway(1), " };
    roff.text([roman(format!("{main}candump(1), journalctl(1), systemctl(1), systemd.network(5)"))]);
    roff.to_writer(&mut page)?;
    Ok(page)
}

/// Returns the exit codes of a command: its own list, or its lines of the common list.
fn exit_codes(command: &Command) -> String {
    let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    if let Some((_, own)) = help.split_once("Exit codes:\n") {
        let mut codes: Vec<_> = own.lines().chain(["  2  wrong usage"]).collect();
        codes.sort_unstable();
        return codes.join("\n");
    }
    let is_own = |line: &&str| {
        let is_common = line.trim().starts_with(['0', '1', '2', '3']);
        is_common || line.split([' ', ',', ':', ';', '(', ')']).any(|word| word == command.get_name())
    };
    // A line with deeper indentation continues the previous one.
    let codes = EXIT_CODES.replace("\n     ", " ");
    codes.lines().filter(is_own).collect::<Vec<_>>().join("\n")
}

fn entry(roff: &mut Roff, term: &str, text: &str) {
    roff.control("TP", []).text([bold(term)]).text([roman(text.trim())]);
}

/// Adds a text, which may be a table, with its line breaks.
fn as_it_is(roff: &mut Roff, text: &str) {
    roff.control("nf", []);
    for line in text.lines() {
        roff.text([roman(line)]);
    }
    roff.control("fi", []);
}
