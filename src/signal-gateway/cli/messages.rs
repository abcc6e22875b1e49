//! Writes errors, warnings and notes of commands to standard error, with options for their number and form.

use std::ffi::OsString;
use std::io;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use annotate_snippets::Level;
use anstream::{AutoStream, ColorChoice};
use clap::{Args, ValueEnum};
use serde_json::json;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

use super::failure::Failure;
use crate::config::Refused;
use crate::config::built_in::display;
use crate::config::files::Disk;
use crate::io::process_log::{self, LogForm};
use crate::report::refusal::{plain, refusals};
use crate::report::text::{Layout, escaped};

/// How much a command writes to standard error, and in which colours.
#[derive(Debug, Clone, Copy, Default, Args)]
#[command(next_help_heading = "Messages")]
pub(super) struct MessageArgs {
    /// Print only errors; for `check` and `doctor`, only findings. JSON is printed all the same
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// Print more messages, and every problem of a file; for `decide`, all reasons and distances
    #[arg(short, long, global = true)]
    pub(super) verbose: bool,
    /// Colours; auto: on a terminal, unless `NO_COLOR` is set, or with `CLICOLOR_FORCE`
    #[arg(long, value_name = "WHEN", global = true, value_enum, default_value_t)]
    color: When,
    /// How messages are written on standard error
    #[arg(long, value_name = "FORMAT", global = true, value_enum, default_value_t, hide = true)]
    message_format: MessageFormat,
}

/// Form of the messages on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum MessageFormat {
    #[default]
    Text,
    /// An object per line, for the process that has started this one.
    Json,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum When {
    #[default]
    Auto,
    Always,
    Never,
}

static OPTIONS: OnceLock<MessageArgs> = OnceLock::new();

const MAX_PROBLEMS: usize = 10;

/// Applies `--color` before the arguments are parsed, so that it also applies to errors of parsing.
pub(super) fn choose_colors(arguments: impl IntoIterator<Item = OsString>) {
    let mut arguments = arguments.into_iter().map(|argument| argument.to_string_lossy().into_owned());
    while let Some(argument) = arguments.next() {
        let value = match argument.split_once('=') {
            Some(("--color", value)) => Some(value.to_owned()),
            None if argument == "--color" => arguments.next(),
            _ => continue,
        };
        let choice = match value.and_then(|value| When::from_str(&value, false).ok()) {
            Some(When::Always) => ColorChoice::Always,
            Some(When::Never) => ColorChoice::Never,
            Some(When::Auto) => ColorChoice::Auto,
            None => continue,
        };
        choice.write_global();
    }
}

/// Sets the options of this process. Only `main` calls it, once.
pub(super) fn set_options(options: MessageArgs) {
    let _is_first = OPTIONS.set(options);
}

pub(super) fn options() -> MessageArgs {
    OPTIONS.get().copied().unwrap_or_default()
}

/// Returns the layout for a stream: whether to use colours, and the width of a terminal.
pub(super) fn layout<S: anstream::stream::RawStream>(stream: &S) -> Layout {
    let has_color = AutoStream::choice(stream) != ColorChoice::Never;
    let size = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    Layout { has_color, width: stream.is_terminal().then(size).flatten() }
}

/// Returns standard output for the lines of a result, buffered. With `--quiet`, lines for people are dropped.
pub(super) fn result_lines(is_json: bool) -> io::BufWriter<Box<dyn io::Write>> {
    let is_dropped = options().quiet && !is_json;
    io::BufWriter::new(if is_dropped { Box::new(io::sink()) } else { Box::new(io::stdout().lock()) })
}

/// Writes an error; `remedy` may be empty.
pub(super) fn error(text: &str, remedy: &str) {
    message((tracing::Level::ERROR, Level::ERROR), text, remedy);
}

/// Writes an error of a file, whose name the reader of an object per line already knows.
pub(super) fn file_error(path: &Path, text: &str, remedy: &str) {
    let is_text = options().message_format == MessageFormat::Text;
    error(&if is_text { format!("{}: {text}", display(path)) } else { text.to_owned() }, remedy);
}

pub(super) fn warn(text: &str) {
    if !options().quiet {
        message((tracing::Level::WARN, Level::WARNING), text, "");
    }
}

pub(super) fn note(text: &str) {
    if !options().quiet {
        message((tracing::Level::INFO, Level::NOTE), text, "");
    }
}

fn message((level, title): (tracing::Level, Level<'static>), text: &str, remedy: &str) {
    match options().message_format {
        MessageFormat::Text => {
            process_log::lines(level, &plain(title, text, remedy, layout(&io::stderr())));
        }
        MessageFormat::Json => {
            let level_name = level.as_str().to_lowercase();
            process_log::lines(
                level,
                &json!({ "level": level_name, "text": text, "remedy": remedy }).to_string(),
            );
        }
    }
}

pub(super) fn refused(Refused(problems): &Refused) {
    if options().message_format == MessageFormat::Json {
        return problems.iter().for_each(|problem| error(&problem.to_string(), ""));
    }
    let most = if options().verbose { usize::MAX } else { MAX_PROBLEMS };
    process_log::lines(tracing::Level::ERROR, &refusals(&Disk, problems, most, layout(&io::stderr())));
}

pub(super) fn say(text: &str) {
    let lines: Vec<_> = text.split('\n').map(escaped).collect();
    process_log::lines(tracing::Level::INFO, &lines.join("\n"));
}

/// Starts the log at `level`, unless `--quiet`, `--verbose` or `RUST_LOG` (which may be invalid) change it.
pub(super) fn start_log(level: &str, form: LogForm) -> Result<(), Failure> {
    let level = match (options(), level) {
        (MessageArgs { quiet: true, .. }, _) => "error",
        (MessageArgs { verbose: true, .. }, "error" | "warn") => "info",
        (MessageArgs { verbose: true, .. }, "info") => "debug",
        (_, level) => level,
    };
    // DDS logs only if RUST_LOG names it, as in RUST_LOG=debug,rustdds=debug. Zenoh would warn of each link
    // that ends while reporting its links to others.
    let quiet = "rustdds=off,ros2_client=off,zenoh::api::admin=error";
    let requested = std::env::var(EnvFilter::DEFAULT_ENV).unwrap_or_default();
    let refused = |directive: &str| {
        let expected =
            "expected error, warn, info, debug, trace or off, or MODULE=LEVEL, with commas between them";
        Failure::Environment(format!("RUST_LOG: cannot read {directive:?}; {expected}"))
    };
    for directive in requested.split(',').map(str::trim).filter(|directive| !directive.is_empty()) {
        let level = directive.rsplit_once('=').map_or(directive, |(_, level)| level);
        level.parse::<LevelFilter>().map_err(|_| refused(directive))?;
    }
    let filter = EnvFilter::try_new(format!("{level},{quiet},{}", for_our_crates(&requested)));
    let filter = filter.map_err(|_| refused(&requested))?;
    let has_color = layout(&io::stderr()).has_color;
    if let Err(failed) = process_log::start(filter, form, has_color) {
        error(&format!("no log: {failed}"), "");
    }
    Ok(())
}

/// Makes `signal_gateway=LEVEL` the level of each of our crates that no directive names.
fn for_our_crates(directives: &str) -> String {
    let of_program = |directive: &str| {
        directive.trim().strip_prefix(env!("CARGO_CRATE_NAME"))?.strip_prefix('=').map(str::to_owned)
    };
    let levels = directives.split(',').filter_map(of_program);
    let added = levels.flat_map(|level| process_log::LOGGING_CRATES.map(|name| format!("{name}={level},")));
    added.chain([directives.to_owned()]).collect()
}

/// Maximum time to wait for the reader of standard error, or on a busy computer for the writing thread.
const LAST_LINES: Duration = Duration::from_secs(2);

/// Waits until the messages so far are written, at most for [`LAST_LINES`].
pub(super) fn flush() {
    process_log::flush(LAST_LINES);
}

#[cfg(test)]
mod tests {
    use super::for_our_crates;

    #[test]
    fn a_level_of_the_program_is_one_of_all_its_crates_unless_they_have_their_own() {
        for (requested, expected) in [
            ("", ""),
            ("debug", "debug"),
            ("signal_gateway::daemon=debug", "signal_gateway::daemon=debug"),
            ("warn, signal_gateway=debug", "ros_transport=debug,warn, signal_gateway=debug"),
            // The last level for a target applies.
            (
                "signal_gateway=info,ros_transport=off",
                "ros_transport=info,signal_gateway=info,ros_transport=off",
            ),
        ] {
            assert_eq!(for_our_crates(requested), expected);
        }
    }
}
