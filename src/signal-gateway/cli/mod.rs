//! The command line: one definition for help, man page and completions.

mod against_running;
mod arguments;
mod black_box_report;
mod csv_output;
mod decide;
mod demo;
mod discover;
mod doctor;
mod exit_code;
mod failure;
mod failure_message;
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
mod recorded_drive;
mod recordings;
mod reload;
mod replay;
mod ros_arguments;
mod running;
mod status;
mod survey;
mod unreadable;
mod vehicle;
mod view;
mod web;

use std::io;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};

use crate::daemon::DaemonError;
use crate::daemon::publisher::PublisherError;
use exit_code::USAGE;
use failure::Failure;
use manual::EXIT_CODES;

/// Vehicle-signal gateway for Autoware: velocity, steering, gear, control mode, doors and lights of
/// the vehicle, from CAN to ROS 2, with diagnostics; commands for the lights, from ROS 2 to CAN
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
    messages: messages::MessageArgs,
    #[command(subcommand)]
    command: GatewayCommand,
}

const MORE: &str = "\
Start with: signal-gateway demo
Documents: man signal-gateway, and /usr/share/doc/signal-gateway, in the sources README.md and docs.
Examples of all files: /usr/share/signal-gateway, in the sources config and dbc.";

#[derive(Debug, Subcommand)]
enum GatewayCommand {
    /// Run the gateway: the daemon that systemd starts
    #[command(after_help = live::RUN_HELP)]
    Run(live::RunArgs),
    /// Play the built-in recording or a simulation in real time, publish it on ROS 2 and show it live
    #[command(after_help = demo::HELP)]
    Demo(demo::DemoArgs),
    /// Run the gateway over a recording on virtual time and print what it publishes
    #[command(after_help = replay::REPLAY_HELP)]
    Replay(replay::ReplayArgs),
    /// Check a configuration before the drive: bindings, warnings, and the result of a recording
    #[command(after_help = inspect::CHECK_HELP)]
    Check(inspect::CheckArgs),
    /// Examine a set-up: interfaces, bit rate, ROS 2, service, permissions; each finding with its remedy
    #[command(after_help = doctor::HELP)]
    Doctor(doctor::DoctorArgs),
    /// Find the built-in profiles that fit a recording
    #[command(after_help = identify::HELP)]
    Identify(identify::IdentifyArgs),
    /// Print the bound signals by name with their meaning, from a recording or live
    #[command(after_help = inspect::DECODE_HELP)]
    Decode(inspect::DecodeArgs),
    /// Find the indicators of an unknown vehicle: ask the driver for actions, or read a marked recording
    #[command(after_help = discover::HELP)]
    Discover(discover::DiscoverArgs),
    /// Write a commented configuration; asks for values that are not given
    #[command(after_help = init::HELP)]
    Init(init::InitArgs),
    /// List or print the vehicle profiles in the binary
    #[command(after_help = profiles::HELP)]
    Profiles(profiles::ProfilesArgs),
    /// Run a scenario of traffic lights on virtual time and print its timeline, or draw it
    #[command(after_help = lights::HELP)]
    Lights(lights::LightsArgs),
    /// Run a drive scenario of the turn signal decider on virtual time and explain each decision
    #[command(after_help = decide::HELP)]
    Decide(decide::DecideArgs),
    /// Simulate a vehicle on a virtual bus: lamps that flash, commands obeyed, faults on request
    #[command(after_help = vehicle::HELP)]
    Vehicle(vehicle::VehicleArgs),
    /// Show the current state of a running gateway
    #[command(after_help = status::HELP)]
    Status(status::StatusArgs),
    /// Reload the configuration of a running gateway, and print the result
    #[command(after_help = reload::HELP)]
    Reload(reload::ReloadArgs),
    /// Write the page of a black box for the live page
    #[command(hide = true)]
    BlackBoxReport(black_box_report::BlackBoxReportArgs),
    /// Serve a gateway that has started this process as its network side
    #[command(hide = true)]
    Network(live::NetworkArgs),
    /// Start and watch the network side of a gateway of another user, which has connected with standard input
    #[command(hide = true)]
    NetworkSupervisor,
    /// Print shell completions
    Completions(manual::CompletionsArgs),
    /// Print the man page (roff), or one for each command into a folder
    Man(manual::ManArgs),
}

/// Runs the command of the arguments; errors go to standard error.
pub fn main() -> ExitCode {
    messages::choose_colors(std::env::args_os().skip(1));
    let cli = misuse::parse::<Cli>();
    messages::set_options(cli.messages);
    let outcome = match cli.command {
        GatewayCommand::Run(args) => live::run(args),
        GatewayCommand::Demo(args) => demo::demo(&args),
        GatewayCommand::Replay(args) => replay::replay(&args),
        GatewayCommand::Check(args) => inspect::check(&args),
        GatewayCommand::Doctor(args) => doctor::run(&args),
        GatewayCommand::Identify(args) => identify::run(&args),
        GatewayCommand::Decode(args) => inspect::decode(&args),
        GatewayCommand::Discover(args) => discover::run(&args),
        GatewayCommand::Init(args) => init::run(&args),
        GatewayCommand::Profiles(args) => profiles::run(&args),
        GatewayCommand::Lights(args) => lights::run(&args),
        GatewayCommand::Decide(args) => decide::run(&args),
        GatewayCommand::Vehicle(args) => vehicle::run(&args),
        GatewayCommand::Status(args) => status::run(&args),
        GatewayCommand::Reload(args) => reload::run(&args),
        GatewayCommand::BlackBoxReport(args) => black_box_report::run(&args),
        GatewayCommand::Network(args) => live::network(&args),
        GatewayCommand::NetworkSupervisor => live::network_supervisor(),
        GatewayCommand::Completions(args) => manual::completions(&args, Cli::command()),
        GatewayCommand::Man(args) => manual::man(&args, Cli::command()),
    };
    let code = match outcome {
        Ok(code) => code,
        // The reader of our output has closed the pipe, which is not a failure.
        Err(Failure::System(error) | Failure::Daemon(DaemonError::System(error)))
            if error.kind() == io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(failure) => {
            failure_message::show(&failure);
            ExitCode::from(match failure {
                // ROS 2 environment variables count as settings too.
                Failure::Refused(_)
                | Failure::Environment(_)
                | Failure::Daemon(DaemonError::Publisher(
                    PublisherError::Environment(_) | PublisherError::Loop(_) | PublisherError::NotBuilt,
                )) => 3,
                Failure::Usage(_) => USAGE,
                Failure::Daemon(_)
                | Failure::File(..)
                | Failure::Written(..)
                | Failure::PageAddress(..)
                | Failure::System(_) => 1,
            })
        }
    };
    messages::flush();
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    /// clap wraps wider lines again, leaving single words on a line.
    #[test]
    fn no_line_of_help_is_wider_than_the_terminal_that_clap_wraps_for() {
        for command in Cli::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let wide: Vec<_> = help.lines().filter(|line| line.chars().count() > 100).collect();
            assert!(wide.is_empty(), "{}: {wide:#?}", command.get_name());
        }
    }
}
