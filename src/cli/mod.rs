//! The command line: one definition makes help, man page and completions.

mod against_running;
mod arguments;
mod decide;
mod demo;
mod discover;
mod identify;
mod init;
mod inspect;
mod lights;
mod live;
mod manual;
mod mcap_export;
mod messages;
mod misuse;
mod profiles;
mod progress;
mod questions;
mod reload;
mod replay;
mod ros_arguments;
mod status;
mod survey;
mod unreadable;
mod unusable;
mod vehicle;
mod view;
mod web;

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, Subcommand};

use crate::config::Refused;
use crate::daemon::DaemonError;
use crate::daemon::publisher::PublisherError;
use crate::io::process_log;
use decide::DecideArgs;
use demo::DemoArgs;
use discover::DiscoverArgs;
use identify::IdentifyArgs;
use init::InitArgs;
use inspect::{CheckArgs, DecodeArgs};
use lights::LightsArgs;
#[cfg(feature = "ros")]
use live::NetworkArgs;
use live::RunArgs;
use manual::{CompletionsArgs, ManArgs};
use messages::MessageArgs;
use profiles::ProfilesArgs;
use reload::ReloadArgs;
use replay::ReplayArgs;
use status::StatusArgs;
use vehicle::VehicleArgs;

/// Vehicle-signal gateway for Autoware: turn-signal and hazard frames from CAN become status
/// reports and diagnostics on ROS 2
#[derive(Debug, Parser)]
#[command(
    name = "signal-gateway",
    version = env!("SIGNAL_GATEWAY_VERSION"),
    max_term_width = 100,
    disable_help_subcommand = true,
    after_help = format!("Exit codes:\n{EXIT_CODES}\n\n{MORE}")
)]
pub struct Cli {
    #[command(flatten)]
    messages: MessageArgs,
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "  0  done
  1  failed while running
  2  wrong usage
  3  the configuration, its vehicle profile, its DBC, a scenario or a map was refused
  4  check or status found warnings, or discover is not sure
  5  the scenario of lights ended in failure, or an expectation of decide was not met
  6  the verdict of a scenario of lights is not known
  7  status found errors
  8  status, reload or check --against-running reaches no gateway
  9  check --against-running: the configuration needs a restart";

const MORE: &str = "\
Start with: signal-gateway demo
Documents: man signal-gateway, and /usr/share/doc/signal-gateway, in the sources README.md and docs.
Examples of all files: /usr/share/signal-gateway, in the sources config and dbc.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the gateway: the daemon that systemd starts
    #[command(after_help = live::RUN_HELP)]
    Run(RunArgs),
    /// Play the built-in recording or a simulation in real time, publish it on ROS 2 and show it live
    #[command(after_help = demo::HELP)]
    Demo(DemoArgs),
    /// Run the gateway over a recording on virtual time and print what it publishes
    #[command(after_help = replay::REPLAY_HELP)]
    Replay(ReplayArgs),
    /// Check a configuration before the drive: bindings, warnings, and the result of a recording
    #[command(after_help = inspect::CHECK_HELP)]
    Check(CheckArgs),
    /// Find the built-in profiles that fit a recording
    #[command(after_help = identify::HELP)]
    Identify(IdentifyArgs),
    /// Print the bound signals by name with their meaning, from a recording or live
    #[command(after_help = inspect::DECODE_HELP)]
    Decode(DecodeArgs),
    /// Find the indicators of an unknown vehicle: ask the driver for actions, or read a marked recording
    #[command(after_help = discover::HELP)]
    Discover(DiscoverArgs),
    /// Write a commented configuration; asks for values that are not given
    #[command(after_help = init::HELP)]
    Init(InitArgs),
    /// List or print the vehicle profiles in the binary
    #[command(after_help = profiles::HELP)]
    Profiles(ProfilesArgs),
    /// Run a scenario of traffic lights on virtual time and print its timeline, or draw it
    #[command(after_help = lights::HELP)]
    Lights(LightsArgs),
    /// Run a drive scenario of the turn signal decider on virtual time and explain each decision
    #[command(after_help = decide::HELP)]
    Decide(DecideArgs),
    /// Simulate a vehicle on a virtual bus: lamps that flash, commands obeyed, faults on request
    #[command(after_help = vehicle::HELP)]
    Vehicle(VehicleArgs),
    /// Show the current state of a running gateway
    #[command(after_help = status::HELP)]
    Status(StatusArgs),
    /// Reload the configuration of a running gateway, and print the result
    #[command(after_help = reload::HELP)]
    Reload(ReloadArgs),
    /// Serve a gateway that has started this process as its network side
    #[cfg(feature = "ros")]
    #[command(hide = true)]
    Network(NetworkArgs),
    /// Start and watch the network side of a gateway of another user, which has connected with standard input
    #[cfg(feature = "ros")]
    #[command(hide = true)]
    NetworkSupervisor,
    /// Print shell completions
    Completions(CompletionsArgs),
    /// Print the man page (roff), or one for each command into a folder
    Man(ManArgs),
}

/// Longest time that the end waits for a reader of standard error, or on a busy computer for the thread that writes.
const LAST_LINES: Duration = Duration::from_secs(2);

/// Runs the command of the arguments; errors go to standard error.
pub fn main() -> ExitCode {
    messages::choose_colors(std::env::args_os().skip(1));
    let cli = misuse::parse();
    messages::set_options(cli.messages);
    let outcome = match cli.command {
        Command::Run(args) => live::run(args),
        Command::Demo(args) => demo::demo(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Check(args) => inspect::check(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Decode(args) => inspect::decode(&args),
        Command::Discover(args) => discover::run(&args),
        Command::Init(args) => init::run(&args),
        Command::Profiles(args) => profiles::run(&args),
        Command::Lights(args) => lights::run(&args),
        Command::Decide(args) => decide::run(&args),
        Command::Vehicle(args) => vehicle::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Reload(args) => reload::run(&args),
        #[cfg(feature = "ros")]
        Command::Network(args) => live::network(&args),
        #[cfg(feature = "ros")]
        Command::NetworkSupervisor => live::network_supervisor(),
        Command::Completions(args) => manual::completions(&args),
        Command::Man(args) => manual::man(&args),
    };
    let code = match outcome {
        Ok(code) => code,
        // The reader of our output has closed it, which is not a failure.
        Err(Failure::System(error) | Failure::Daemon(DaemonError::System(error)))
            if error.kind() == io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(failure) => {
            failure.show();
            ExitCode::from(match failure {
                // Variables of ROS 2 are settings too, though they are in the environment.
                Failure::Refused(_)
                | Failure::Environment(_)
                | Failure::Daemon(DaemonError::Publisher(
                    PublisherError::Environment(_) | PublisherError::Loop(_) | PublisherError::NotBuilt,
                )) => 3,
                Failure::Usage(_) => 2,
                Failure::Daemon(_) | Failure::File(..) | Failure::Written(..) | Failure::System(_) => 1,
            })
        }
    };
    process_log::flush(LAST_LINES);
    code
}

/// The reason for which a command failed.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error("{0}")]
    Refused(#[from] Refused),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Daemon(#[from] DaemonError),
    /// A variable of the environment.
    #[error("{0}")]
    Environment(String),
    #[error("{}: {_1}", _0.display())]
    File(PathBuf, io::Error),
    /// A file that cannot be written.
    #[error("{}: {_1}", _0.display())]
    Written(PathBuf, io::Error),
    #[error("{0}")]
    System(#[from] io::Error),
}

impl Failure {
    /// Makes the failure of an error of this file.
    fn file(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::File(path.to_owned(), error)
    }

    /// Makes the failure of an error of this file, which is being written.
    fn written(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::Written(path.to_owned(), error)
    }

    /// Writes the reason, with what to do about it as far as that is known.
    fn show(&self) {
        match self {
            Self::Refused(refused) => messages::refused(refused),
            Self::File(path, error) => unreadable::show(path, error),
            Self::Written(path, error) => unreadable::show_unwritable(path, error),
            Self::Daemon(DaemonError::NoLink { interface, state }) => unusable::show(interface, *state),
            Self::Daemon(DaemonError::Recording { file, error }) => unreadable::show(Path::new(file), error),
            Self::Usage(_) | Self::Environment(_) | Self::Daemon(_) | Self::System(_) => {
                messages::error(&self.to_string(), "");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    /// Wider lines are broken once more by clap, which leaves single words behind.
    #[test]
    fn no_line_of_help_is_wider_than_the_terminal_that_clap_wraps_for() {
        for command in Cli::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let wide: Vec<_> = help.lines().filter(|line| line.chars().count() > 100).collect();
            assert!(wide.is_empty(), "{}: {wide:#?}", command.get_name());
        }
    }
}
