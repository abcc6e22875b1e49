//! The command line for one of several recordings: this process's options, and the recording.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::Command;

use clap::ArgAction;
use clap::parser::ValueSource;

use crate::cli::csv_output::path_in;
use crate::cli::failure::Failure;
use crate::cli::misuse;

/// Options of the whole, which one recording must not have, and those that are added.
const LEFT_OUT: [&str; 4] = ["jobs", "csv", "json", "message_format"];

/// The arguments that all recordings have in common.
pub(super) struct Arguments(Vec<OsString>);

impl Arguments {
    /// Returns the options of this process's command line, without its recordings.
    pub(super) fn of_process() -> Result<Self, Failure> {
        let parser = misuse::parser().unwrap_or_default();
        Self::of(parser, misuse::arguments()).map_err(|error| Failure::Usage(error.to_string()))
    }

    /// The parser knows which arguments are options, and which are recordings.
    fn of(mut command: clap::Command, arguments: Vec<OsString>) -> Result<Self, clap::Error> {
        let matches = command.try_get_matches_from_mut(arguments)?;
        let Some((name, matches)) = matches.subcommand() else { return Ok(Self(Vec::new())) };
        let mut common = vec![OsString::from(name)];
        for argument in command.find_subcommand(name).into_iter().flat_map(clap::Command::get_arguments) {
            let id = argument.get_id().as_str();
            let is_given = matches.try_contains_id(id).unwrap_or(false)
                && matches.value_source(id) == Some(ValueSource::CommandLine);
            let Some(long) = argument.get_long().filter(|_| is_given && !LEFT_OUT.contains(&id)) else {
                continue;
            };
            let option = format!("--{long}");
            if matches!(argument.get_action(), ArgAction::SetTrue) {
                common.push(option.into());
            } else {
                for value in matches.get_raw(id).into_iter().flatten() {
                    common.push(joined(&option, value));
                }
            }
        }
        common.extend(["--json", "--message-format", "json"].map(OsString::from));
        Ok(Self(common))
    }

    /// Returns the command for one recording; its table goes into the folder `tables`, if there is one.
    pub(super) fn for_recording(&self, recording: &Path, tables: Option<&Path>) -> Command {
        let mut command = Command::new("/proc/self/exe");
        command.args(&self.0);
        command.args(tables.map(|folder| joined("--csv", path_in(folder, recording).as_os_str())));
        command.arg("--").arg(recording);
        command
    }
}

fn joined(option: &str, value: &OsStr) -> OsString {
    let mut joined = OsString::from(option);
    joined.push("=");
    joined.push(value);
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_options_but_those_of_the_whole_reach_each_recording() {
        let line = [
            "signal-gateway",
            "replay",
            "-q",
            "--map",
            "can0=body",
            "archive",
            "-p=demo_vehicle",
            "--map=can1=chassis",
            "--csv",
            "out",
            "--rate",
            "10",
            "more.log",
            "--jobs",
            "3",
            "--json",
        ];
        let parser = <crate::cli::Cli as clap::CommandFactory>::command();
        let Arguments(common) = Arguments::of(parser, line.map(OsString::from).to_vec()).unwrap();
        let mut common: Vec<_> = common.iter().map(|argument| argument.to_str().unwrap()).collect();
        let expected = ["replay", "--json", "--message-format", "json"];
        assert_eq!(common.remove(0), expected[0]);
        let options =
            ["--map=can0=body", "--map=can1=chassis", "--profile=demo_vehicle", "--rate=10", "--quiet"];
        for option in options {
            assert!(common.contains(&option), "{option}: {common:?}");
        }
        assert_eq!(common.len(), options.len() + 3, "{common:?}");
    }
}
