//! Adds a tip to the parser's error for common mistakes in command lines.

use std::ffi::OsString;
use std::fmt::Display;
use std::path::Path;
use std::sync::OnceLock;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error, Parser};

use super::web::with_joined_address;
use crate::config::built_in::BuiltIn;

/// Builds the parser of this process.
static PARSER: OnceLock<fn() -> Command> = OnceLock::new();

/// Returns the parser of this process; `None` before [`parse`].
pub(super) fn parser() -> Option<Command> {
    PARSER.get().map(|build| build())
}

/// Parses the arguments of the process. Ends the process if they are wrong.
pub(super) fn parse<Cli: Parser>() -> Cli {
    let arguments = arguments();
    let build: fn() -> Command = || with_negative_numbers(Cli::command());
    let mut command = PARSER.get_or_init(|| build)();
    let matches = command.try_get_matches_from_mut(&arguments);
    let parsed = matches
        .and_then(|matches| Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command)));
    parsed.unwrap_or_else(|mut error| {
        let words: Vec<_> = arguments.iter().skip(1).map(|word| word.to_string_lossy()).collect();
        let words: Vec<_> = words.iter().map(AsRef::as_ref).collect();
        let is_mistyped = error.get(ContextKind::SuggestedArg).is_some();
        if let Some(tip) = tip(error.kind(), &words).filter(|_| !is_mistyped) {
            let tip = ContextValue::StyledStrs(vec![tip.into()]);
            error.insert(ContextKind::Suggested, tip);
        }
        forget_hidden(&mut error, &Cli::command());
        error.exit()
    })
}

/// Returns the arguments of the process in the form that the parser accepts.
pub(super) fn arguments() -> Vec<OsString> {
    help_as_option(with_joined_address(std::env::args_os()))
}

/// Accepts `-1` as the value of every option. Otherwise it is taken for an unknown option, and the range of
/// the values is not mentioned.
fn with_negative_numbers(command: Command) -> Command {
    command
        .mut_args(|arg| {
            let takes_value = !arg.is_positional() && arg.get_action().takes_values();
            arg.allow_negative_numbers(takes_value)
        })
        .mut_subcommands(with_negative_numbers)
}

/// Turns `help COMMAND` into `COMMAND --help`, and `help` into `--help`.
fn help_as_option(mut arguments: Vec<OsString>) -> Vec<OsString> {
    if arguments.get(1).is_some_and(|word| word == "help") {
        arguments.remove(1);
        arguments.push("--help".into());
    }
    arguments
}

/// Removes hidden commands from the suggested commands.
fn forget_hidden(error: &mut Error, command: &Command) {
    let is_shown = |name: &String| command.find_subcommand(name).is_none_or(|found| !found.is_hide_set());
    let Some(ContextValue::Strings(names)) = error.get(ContextKind::SuggestedSubcommand) else { return };
    let shown: Vec<_> = names.iter().filter(|name| is_shown(name)).cloned().collect();
    error.remove(ContextKind::SuggestedSubcommand);
    if !shown.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(shown));
    }
}

/// Returns how to give a configuration or a profile, which stands in the place of a recording.
pub(super) fn config_tip(path: impl Display) -> String {
    format!("a configuration is given with --config {path}, a profile with --profile {path}")
}

/// Returns what the user probably meant; `None` if the parser's message is sufficient.
#[allow(clippy::wildcard_enum_match_arm)] // most kinds of errors say enough
fn tip(kind: ErrorKind, words: &[&str]) -> Option<String> {
    let command = words.iter().position(|word| !word.starts_with('-'))?;
    let rest = &words[command + 1..];
    let is_recording_command = matches!(words[command], "check" | "decode" | "replay" | "identify");
    let config =
        rest.iter().find(|word| Path::new(word).extension().is_some_and(|extension| extension == "toml"));
    // With or without `=VALUE`.
    let has = |option: &str| rest.iter().any(|word| word.split('=').next() == Some(option));
    match (words[command], kind) {
        ("identify", ErrorKind::MissingRequiredArgument) if rest.is_empty() => {
            Some("give a recording, or listen to a bus: identify --live can0".to_owned())
        }
        ("profiles", ErrorKind::InvalidSubcommand) => {
            let name = rest.iter().find(|word| !word.starts_with('-'))?;
            Some(match BuiltIn::Profile.path(name) {
                Some(_) => format!("to print it: profiles show {name}"),
                None => "profiles list shows the names".to_owned(),
            })
        }
        ("run", ErrorKind::UnknownArgument) if has("--interface") || has("-i") => Some(
            "the configuration names the interfaces; to write one: init --interface can0 --profile NAME"
                .to_owned(),
        ),
        (name, ErrorKind::UnknownArgument) if is_recording_command && has("--log") => {
            Some(format!("the recording stands by itself: {name} drive.log"))
        }
        (_, ErrorKind::UnknownArgument) if is_recording_command => config.map(config_tip),
        _ => None,
    }
}
