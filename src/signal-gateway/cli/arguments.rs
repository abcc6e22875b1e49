//! Arguments of several commands: a configuration, a recording, a file for a chart.

use std::fs::Metadata;
use std::io::{self, IsTerminal as _};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::progress::ProgressDisplay;
use super::unreadable::with_neighbours;
use crate::check;
use crate::config::files::{Disk, Files};
use crate::config::ros_names::RosOverrides;
use crate::config::{Overrides, Settings, load, load_profile_for_node};
use crate::io::folder_access::check_writable;
use crate::io::new_files::write_new;
use crate::replay::Routes;
use crate::report::chart::Chart;
use crate::report::text::{counted, escaped, plain_path};
use can_log::{Log, standard_input};
use can_signal::can::BusIndex;

#[derive(Debug, Clone, Args)]
pub(super) struct ConfigArgs {
    #[arg(short, long, value_name = "FILE", help = config_help())]
    pub(super) config: Option<PathBuf>,
    /// Vehicle profile to use instead of the configured one, by name (`profiles list`) or path; without
    /// --config, no configuration is read, and buses are can0, can1 … in the order of their names
    #[arg(short, long, value_name = "NAME|FILE")]
    pub(super) profile: Option<PathBuf>,
}

/// Path of the configuration that the service reads.
pub(super) const DEFAULT_CONFIG: &str = "/etc/signal-gateway/gateway.toml";

#[derive(Debug, Args)]
pub(super) struct RecordingArgs {
    #[arg(help = log_help())]
    pub(super) log: Option<PathBuf>,
    #[command(flatten)]
    pub(super) config: ConfigArgs,
    /// Read the frames of INTERFACE in the log as frames of BUS in the profile; repeatable. Not needed
    /// when both have only one
    #[arg(long, value_name = "INTERFACE=BUS", value_parser = |text: &str| pair::<String>(text, "write INTERFACE=BUS"))]
    pub(super) map: Vec<(String, String)>,
    #[command(flatten)]
    pub(super) time: TimeArgs,
}

#[derive(Debug, Clone, Copy, Default, Args)]
pub(super) struct TimeArgs {
    /// Unit of the stamps in the recording, if its writer used another one than is usual in its format
    #[arg(long, value_name = "UNIT", value_parser = named_value(&TIME_UNITS))]
    time_unit: Option<i64>,
}

/// Units of the stamps in a recording, nanoseconds.
static TIME_UNITS: [NamedValue<i64>; 4] = [
    (1_000_000_000, "s", "Seconds"),
    (1_000_000, "ms", "Milliseconds"),
    (1_000, "us", "Microseconds"),
    (1, "ns", "Nanoseconds"),
];

impl TimeArgs {
    pub(super) fn apply(self, log: Log) -> io::Result<Log> {
        match self.time_unit {
            None => Ok(log),
            Some(unit_ns) => log.in_time_unit(unit_ns),
        }
    }
}

/// When a command on virtual time prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Every {
    /// On every change
    #[default]
    Change,
    /// At every cycle or frame, and on every change
    #[value(aliases = ["cycle", "frame"])]
    Step,
}

fn config_help() -> String {
    format!(
        "Configuration file; config/gateway.toml, in /usr/share/signal-gateway or the sources, explains every key; default: {DEFAULT_CONFIG}"
    )
}

fn log_help() -> String {
    let formats = can_log::names().join(", ");
    format!(
        "Recording, plain or as gzip, bzip2, xz, zstd or lz4, - for standard input: {formats}; default: the configured recording"
    )
}

/// A value of an argument, with its name and meaning.
pub(super) type NamedValue<T> = (T, &'static str, &'static str);

/// Parses names of values that are defined outside of the command line.
pub(super) fn named_value<T>(values: &'static [NamedValue<T>]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    let names = values.iter().map(|(_, name, meaning)| PossibleValue::new(*name).help(*meaning));
    PossibleValuesParser::new(names).try_map(move |given| {
        let row = values.iter().find(|(_, name, _)| *name == given);
        row.map(|(value, ..)| *value).ok_or("expected one of the names")
    })
}

pub(super) fn number(text: &str, what: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("give {what} from {} to {}", range.start(), range.end()))
}

pub(super) fn speed(text: &str) -> Result<f64, String> {
    number(text, "a factor", 0.01..=1000.0)
}

pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    number(text, "seconds", 0.001..=86_400.0).map(Duration::from_secs_f64)
}

/// Loads the configuration and logs its warnings.
pub(super) fn settings(args: &ConfigArgs) -> Result<Settings, Failure> {
    settings_in(&Disk, args, &RosOverrides::default())
}

/// Like [`settings`], but reads from `files`, and ROS 2 arguments replace keys of the file.
pub(super) fn settings_in(
    files: &dyn Files,
    args: &ConfigArgs,
    ros: &RosOverrides,
) -> Result<Settings, Failure> {
    let _progress = ProgressDisplay::spinner("reading the configuration");
    let settings = match (&args.config, &args.profile) {
        (None, Some(profile)) => load_profile_for_node(files, profile, ros),
        (config, profile) => {
            let config = config.as_deref().unwrap_or(Path::new(DEFAULT_CONFIG));
            load(files, config, &Overrides { profile: profile.clone(), ros: ros.clone() })
        }
    };
    let is_given = args.config.is_some() || args.profile.is_some();
    let with_hints = |refused| with_neighbours(refused, args.profile.as_deref());
    let settings = settings.map_err(|refused| if is_given { with_hints(refused) } else { refused })?;
    for dbc in settings.dbcs.iter().filter(|dbc| dbc.database.rejected() > 0) {
        let path = escaped(&plain_path(&dbc.path)).to_string();
        let rejected = counted(dbc.database.rejected().try_into().unwrap_or(u64::MAX), "statement");
        tracing::warn!(log.subject = path, "{path}: {rejected} rejected; signal-gateway check lists them");
    }
    for note in check::notes(&settings) {
        tracing::warn!(log.subject = note, "{note}");
    }
    Ok(settings)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShowProgress {
    /// Always: the command prints nothing until the end.
    Always,
    /// Only while standard output is not the same terminal, since the command prints lines meanwhile.
    WithoutOutput,
}

/// Opens a recording or the folder of a bag; `-` is standard input. Its progress is shown until it is closed.
pub(super) fn open(path: &Path, time: TimeArgs, shown: ShowProgress) -> Result<Log, Failure> {
    if path.is_dir() || shown == ShowProgress::WithoutOutput && io::stdout().is_terminal() {
        return Log::open(path).and_then(|log| time.apply(log)).map_err(Failure::file(path));
    }
    let open = || {
        if standard_input::is_named(path) {
            let input = standard_input::stream()?;
            return Log::new(Box::new(ProgressDisplay::reading(input, None, "standard input".to_owned())));
        }
        Log::of_file(path, |file| {
            // A pipe has no length.
            let length = file.metadata().ok().filter(Metadata::is_file).map(|metadata| metadata.len());
            Box::new(ProgressDisplay::reading(file, length, file_name(path)))
        })
    };
    open().and_then(|log| time.apply(log)).map_err(Failure::file(path))
}

/// Reads the path of a picture.
pub(super) fn svg_path(text: &str) -> Result<PathBuf, String> {
    path_ending_in(text, &["svg"], |svg| format!("draw {svg} and convert it, e.g. with rsvg-convert"))
}

/// Reads the path of a page.
pub(super) fn page_path(text: &str) -> Result<PathBuf, String> {
    path_ending_in(text, &["html", "htm"], |html| format!("write {html}, which a browser can print as PDF"))
}

/// Reads the path of an output file of one format; `conversion` is the remedy for another format.
fn path_ending_in(
    text: &str,
    extensions: &[&str],
    conversion: impl FnOnce(&str) -> String,
) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    let expected = format!("expected a name that ends in .{}", extensions.join(" or ."));
    match (extension.as_deref(), extensions) {
        (Some(given), _) if extensions.contains(&given) => Ok(path),
        (Some(given), [first, ..]) => {
            let right = path.with_extension(first).display().to_string();
            Err(format!("{expected}, found .{given}; {}", conversion(&right)))
        }
        (Some(_) | None, _) => Err(expected),
    }
}

/// Fails if no file can be written at this path because of its folder, so that this is known before the work.
pub(super) fn expect_folder_of(path: &Path) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let unwritable = Failure::written(path);
    if !folder.is_dir() {
        return Err(unwritable(io::ErrorKind::NotFound.into()));
    }
    // A file or a terminal that exists is replaced or written by itself.
    if path.is_dir() {
        return Err(unwritable(io::ErrorKind::IsADirectory.into()));
    }
    if path.exists() { Ok(()) } else { check_writable(folder).map_err(unwritable) }
}

pub(super) fn draw(path: &Path, chart: &Chart) -> Result<(), Failure> {
    write_new(path, &chart.to_svg(), true).map_err(Failure::written(path))
}

/// Returns the title of a chart without its own title.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

pub(super) fn recording(args: &RecordingArgs, settings: &Settings) -> Result<(PathBuf, Routes), Failure> {
    let configured = || settings.recording.as_ref().map(|recording| recording.file.clone());
    let path = args.log.clone().or_else(configured).ok_or_else(|| {
        Failure::Usage("no recording: give a LOG, or name one in [recording] of the configuration".to_owned())
    })?;
    let mut routes = Routes::by_interface(&settings.gateway);
    if args.map.is_empty() {
        routes.adopt_only_interface(&path);
        return Ok((path, routes));
    }
    routes.0.clear();
    for (interface, bus) in &args.map {
        let names = settings.gateway.buses.iter().map(|known| known.name.as_str());
        let Some((index, _)) = (0..=u8::MAX).zip(names.clone()).find(|(_, name)| name == bus) else {
            let known = names.collect::<Vec<_>>().join(", ");
            return Err(Failure::Usage(format!(
                "--map {interface}={bus}: the profile has no bus {bus}; write INTERFACE=BUS, it has {known}"
            )));
        };
        routes.0.push((interface.clone(), BusIndex(index)));
    }
    Ok((path, routes))
}

/// Splits an argument at `=`; `missing` is the error without one.
pub(super) fn pair<T: From<String>>(text: &str, missing: &str) -> Result<(String, T), String> {
    let (name, value) = text.split_once('=').ok_or(missing)?;
    Ok((name.to_owned(), value.to_owned().into()))
}
