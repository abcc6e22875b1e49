//! The command line: one definition makes help, man page and completions.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use crate::check;
use crate::config::files::{DEMO_CONFIG, Disk, Embedded, Files};
use crate::config::problem::Refused;
use crate::config::{Overrides, Settings, load, load_profile};
use crate::core::event::BusIndex;
use crate::core::time::MonoTime;
use crate::daemon::{self, DaemonError, Playback};
use crate::decode::Decoder;
use crate::io::can::log::Log;
use crate::publisher::{PublisherError, topics};
use crate::replay::{Replay, Routes};
use crate::timeline::{Changes, JsonTimeline};
use crate::view::{Style, View, time_text};

/// Vehicle-signal gateway for Autoware: turn-signal and hazard frames from CAN become status
/// reports and diagnostics on ROS 2
#[derive(Debug, Parser)]
#[command(name = "signal-gateway", version, max_term_width = 100, disable_help_subcommand = true, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  failed while running
  2  wrong usage
  3  the configuration, its vehicle profile or its DBC was refused
  4  check found something to look at

Start with: signal-gateway demo";

const RUN_HELP: &str = "\
Examples:
  signal-gateway run --config /etc/signal-gateway/gateway.toml
  RUST_LOG=debug signal-gateway run --config config/gateway.toml

On a terminal the last line shows the live state; elsewhere each event is one log record.
SIGTERM and SIGINT end it.";

const DEMO_HELP: &str = "\
Examples:
  signal-gateway demo                   45 s of an invented sedan, published on ROS 2
  signal-gateway demo --repeat
  signal-gateway demo --no-ros          the view alone";

const REPLAY_HELP: &str = "\
Examples:
  signal-gateway replay --config config/demo.toml --json
  signal-gateway replay drive.log.gz --profile config/vehicles/hyundai_kia.toml
  signal-gateway replay drive.log --config gateway.toml --map can1=body --speed 1 --ros

With --json every published message is one line
  {\"t\": seconds, \"topic\": name, \"data\": {message fields}}
and /diagnostics is a line whenever a status changes, holding the statuses that changed.
t is virtual time since the first frame of the recording; stamps are those of the recording
(with --ros, as [recording] stamps says).";

const CHECK_HELP: &str = "\
Examples:
  signal-gateway check --config gateway.toml
  signal-gateway check drive.log.gz --profile config/vehicles/ford_falcon_fg.toml";

const DECODE_HELP: &str = "\
Examples:
  signal-gateway decode drive.log.gz --profile config/vehicles/j1939_truck.toml --changes
  signal-gateway decode --live --config gateway.toml";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the gateway: the daemon that systemd starts
    #[command(after_help = RUN_HELP)]
    Run(ConfigArgs),
    /// Play the built-in recording in real time, publish it on ROS 2 and show it live
    #[command(after_help = DEMO_HELP)]
    Demo(DemoArgs),
    /// Run the gateway over a recording on virtual time and print what it publishes
    #[command(after_help = REPLAY_HELP)]
    Replay(ReplayArgs),
    /// Say before the drive what is bound, what is missing, and what a recording would have given
    #[command(after_help = CHECK_HELP)]
    Check(CheckArgs),
    /// Print the bound signals by name with their meaning, from a recording or live
    #[command(after_help = DECODE_HELP)]
    Decode(DecodeArgs),
    /// Print shell completions
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// Print the man page (roff), or one for each command into a folder
    Man {
        /// Folder to write signal-gateway.1, signal-gateway-run.1 … to
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
    },
}

#[derive(Debug, Args)]
struct ConfigArgs {
    /// Configuration file; config/gateway.toml in the sources explains every key
    #[arg(short, long, value_name = "FILE", default_value = DEFAULT_CONFIG)]
    config: PathBuf,
    /// Vehicle profile to use instead of the configured one; without --config, buses are
    /// can0, can1 … in the order of their names
    #[arg(short, long, value_name = "FILE")]
    profile: Option<PathBuf>,
}

const DEFAULT_CONFIG: &str = "/etc/signal-gateway/gateway.toml";

#[derive(Debug, Args)]
struct DemoArgs {
    /// Start again at the end
    #[arg(long)]
    repeat: bool,
    /// Factor on the original timing
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Show only, do not publish
    #[arg(long)]
    no_ros: bool,
}

#[derive(Debug, Args)]
struct RecordingArgs {
    /// Recording, plain or gzip, - for standard input: candump -L, Vector ASC or BLF, PCAN TRC, SavvyCAN or GVRET
    /// CSV, BUSMASTER; default: the configured recording
    log: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
    /// Take what the log calls INTERFACE as the frames of BUS of the profile; repeatable. Not needed
    /// when both have just one
    #[arg(long, value_name = "INTERFACE=BUS", value_parser = mapping)]
    map: Vec<(String, String)>,
}

#[derive(Debug, Args)]
struct ReplayArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// Play with the original timing times FACTOR; default: as fast as possible
    #[arg(long, value_name = "FACTOR", value_parser = speed)]
    speed: Option<f64>,
    /// Publish on ROS 2 as well, at --speed 1 unless given
    #[arg(long)]
    ros: bool,
}

#[derive(Debug, Args)]
struct CheckArgs {
    #[command(flatten)]
    recording: RecordingArgs,
}

#[derive(Debug, Args)]
struct DecodeArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// From the configured interfaces instead of a recording
    #[arg(long, conflicts_with_all = ["log", "map"])]
    live: bool,
    /// A signal only when its value changes
    #[arg(long)]
    changes: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: Option<f64> = text.parse().ok().filter(|speed| (0.01..=1000.0).contains(speed));
    speed.ok_or_else(|| "give a factor from 0.01 to 1000".to_owned())
}

fn mapping(text: &str) -> Result<(String, String), String> {
    let (interface, bus) = text.split_once('=').ok_or("write INTERFACE=BUS")?;
    Ok((interface.to_owned(), bus.to_owned()))
}

/// What a command can end with, beside success.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error("{0}")]
    Refused(#[from] Refused),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Daemon(#[from] DaemonError),
    #[error("{0}: {1}")]
    File(String, io::Error),
    #[error("{0}")]
    System(#[from] io::Error),
}

/// Runs the command that the arguments ask for; errors go to standard error.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match cli.command {
        Command::Run(args) => run(&args),
        Command::Demo(args) => demo(&args),
        Command::Replay(args) => replay(&args),
        Command::Check(args) => check(&args),
        Command::Decode(args) => decode(&args),
        Command::Completions { shell } => {
            let mut command = Cli::command();
            clap_complete::generate(shell, &mut command, "signal-gateway", &mut io::stdout());
            Ok(ExitCode::SUCCESS)
        }
        Command::Man { out } => man(out.as_deref()),
    };
    match outcome {
        Ok(code) => code,
        // Whoever read our output has had enough: no failure of ours.
        Err(Failure::System(error) | Failure::Daemon(DaemonError::System(error)))
            if error.kind() == io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(failure) => {
            say(&format!("signal-gateway: {failure}"));
            ExitCode::from(match failure {
                // ROS_DOMAIN_ID is a setting too, though it stands in the environment.
                Failure::Refused(_)
                | Failure::Daemon(DaemonError::Publisher(
                    PublisherError::DomainId(_) | PublisherError::NotBuilt,
                )) => 3,
                Failure::Usage(_) => 2,
                Failure::Daemon(_) | Failure::File(..) | Failure::System(_) => 1,
            })
        }
    }
}

#[allow(clippy::print_stderr)] // the one place that speaks to the caller's terminal
fn say(text: &str) {
    eprintln!("{text}");
}

/// Log records on standard error; under systemd without time and colour, which the journal adds.
fn start_log(default_level: &str) {
    // DDS speaks only when RUST_LOG asks for it by name, as in RUST_LOG=debug,rustdds=debug.
    let quiet = "rustdds=off,ros2_client=off,mio_06=off";
    let wanted = std::env::var(EnvFilter::DEFAULT_ENV).unwrap_or_default();
    let filter = EnvFilter::try_new(format!("{default_level},{quiet},{wanted}"))
        .unwrap_or_else(|_| EnvFilter::new(format!("{default_level},{quiet}")));
    let builder =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr).with_target(false);
    let started = if std::env::var_os("JOURNAL_STREAM").is_some() {
        builder.without_time().with_ansi(false).try_init()
    } else {
        builder.with_ansi(io::IsTerminal::is_terminal(&io::stderr())).try_init()
    };
    // Already started: nothing to do.
    drop(started);
}

fn settings(args: &ConfigArgs) -> Result<Settings, Failure> {
    let default = Path::new(DEFAULT_CONFIG);
    let settings = match &args.profile {
        Some(profile) if args.config == default && !default.exists() => load_profile(&Disk, profile)?,
        profile => load(&Disk, &args.config, &Overrides { profile: profile.clone() })?,
    };
    for dbc in settings.dbcs.iter().filter(|dbc| dbc.database.rejected() > 0) {
        let (path, rejected) = (dbc.path.display(), dbc.database.rejected());
        tracing::warn!("{path}: {rejected} statements rejected; signal-gateway check lists them");
    }
    for note in check::notes(&settings) {
        tracing::warn!("{note}");
    }
    Ok(settings)
}

fn run(args: &ConfigArgs) -> Result<ExitCode, Failure> {
    start_log("info");
    let settings = settings(args)?;
    let view = View::new(Style::choose(Style::StatusLine, Style::Journal), settings.vehicle.clone());
    daemon::run(settings, view)?;
    Ok(ExitCode::SUCCESS)
}

fn demo(args: &DemoArgs) -> Result<ExitCode, Failure> {
    start_log("warn");
    let mut settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default())?;
    settings.ros.enabled &= !args.no_ros;
    let (file, stamps) = match &settings.recording {
        Some(recording) => (recording.file.clone(), recording.stamps),
        None => return Err(DaemonError::NoRecording.into()),
    };
    let title = format!("{}, built-in recording, Ctrl-C ends", settings.vehicle);
    let view = View::new(Style::choose(Style::Panel, Style::Lines), title);
    let reopen = || Log::new(Box::new(io::Cursor::new(Embedded.read(&file)?)));
    let routes = Routes::by_interface(&settings.gateway);
    let playback = Playback { speed: args.speed, repeat: args.repeat, stamps, stay: false };
    daemon::play(settings, view, None, ("the built-in recording", &reopen, routes), playback)?;
    Ok(ExitCode::SUCCESS)
}

fn replay(args: &ReplayArgs) -> Result<ExitCode, Failure> {
    start_log("warn");
    let settings = settings(&args.recording.config)?;
    let (path, routes) = recording(&args.recording, &settings)?;
    let json = args
        .json
        .then(|| JsonTimeline { topics: topics(&settings), hardware_id: settings.hardware_id.clone() });
    if args.ros || args.speed.is_some() {
        return replay_in_time(args, settings, &path, routes, json);
    }
    let log = open(&path)?;
    let unreadable = |error| Failure::File(path.display().to_string(), error);
    let mut replay = Replay::new(settings.gateway, log, routes).map_err(unreadable)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut changes = Changes::default();
    let outcome = loop {
        let at = replay.now().mono;
        while let Some(output) = replay.poll_output() {
            write_output(&mut out, json.as_ref(), &mut changes, &output, at)?;
        }
        match replay.step() {
            Ok(true) => {}
            Ok(false) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    out.flush()?;
    mention_losses(&replay);
    outcome
}

fn write_output(
    out: &mut impl Write,
    json: Option<&JsonTimeline>,
    changes: &mut Changes,
    output: &crate::core::event::Output,
    at: MonoTime,
) -> io::Result<()> {
    match json {
        Some(json) => json.line(output, at).map_or(Ok(()), |line| writeln!(out, "{line}")),
        None => changes.of(output).iter().try_for_each(|event| writeln!(out, "{} {event}", time_text(at))),
    }
}

/// What a replay of a log with faults should not keep to itself.
fn mention_losses(replay: &Replay) {
    let (log, counts) = (replay.log(), replay.counts());
    if counts.records == 0 {
        say("no frame was found in the recording");
    }
    if let Some((line, reason)) = log.first_bad() {
        say(&format!("{} lines could not be read; the first is line {line}: {reason}", log.bad_lines()));
    }
    if counts.jumps > 0 {
        say(&format!("the recorder's clock jumped {} times", counts.jumps));
    }
    if counts.records > 0 && counts.foreign == counts.records {
        let names = log.interfaces().join(", ");
        say(&format!(
            "no frame came on a configured interface; the log has {names}: use --map INTERFACE=BUS"
        ));
    }
}

fn replay_in_time(
    args: &ReplayArgs,
    mut settings: Settings,
    path: &Path,
    routes: Routes,
    json: Option<JsonTimeline>,
) -> Result<ExitCode, Failure> {
    settings.ros.enabled = args.ros;
    let configured = settings.recording.as_ref().filter(|_| args.ros);
    let stamps = configured.map(|recording| recording.stamps).unwrap_or_default();
    let playback = Playback { speed: args.speed.unwrap_or(1.0), repeat: false, stamps, stay: false };
    let view = View::new(Style::choose(Style::StatusLine, Style::Lines), settings.vehicle.clone());
    let reopen = || Log::open(path);
    daemon::play(settings, view, json, (&path.display().to_string(), &reopen, routes), playback)?;
    Ok(ExitCode::SUCCESS)
}

fn check(args: &CheckArgs) -> Result<ExitCode, Failure> {
    start_log("error");
    let args = &args.recording;
    let settings = settings(&args.config)?;
    let bound = check::binding(&settings);
    let mut out = io::stdout().lock();
    out.write_all(bound.text.as_bytes())?;
    let mut concerns = bound.concerns;
    if args.log.is_some() || settings.recording.is_some() {
        let (path, routes) = recording(args, &settings)?;
        let unreadable = |error| Failure::File(path.display().to_string(), error);
        let replay = Replay::new(settings.gateway.clone(), open(&path)?, routes).map_err(unreadable)?;
        let (report, outcome) = check::recording(&settings, replay);
        out.write_all(report.text.as_bytes())?;
        concerns += report.concerns;
        outcome.map_err(unreadable)?;
    }
    writeln!(out, "{concerns} things to look at")?;
    Ok(if concerns == 0 { ExitCode::SUCCESS } else { ExitCode::from(4) })
}

fn decode(args: &DecodeArgs) -> Result<ExitCode, Failure> {
    start_log("warn");
    let settings = settings(&args.recording.config)?;
    let mut decoder = Decoder::new(&settings, args.changes);
    if args.live {
        let mut out = io::stdout().lock();
        daemon::listen(&settings, |input| decoder.print(&input, &mut out))?;
        return Ok(ExitCode::SUCCESS);
    }
    let (path, routes) = recording(&args.recording, &settings)?;
    let unreadable = |error| Failure::File(path.display().to_string(), error);
    let mut replay = Replay::new(settings.gateway, open(&path)?, routes).map_err(unreadable)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let outcome = loop {
        match replay.skim() {
            Ok(Some(input)) => decoder.print(&input, &mut out)?,
            Ok(None) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    out.flush()?;
    mention_losses(&replay);
    outcome
}

fn man(folder: Option<&Path>) -> Result<ExitCode, Failure> {
    let command = Cli::command();
    match folder {
        None => clap_mangen::Man::new(command).render(&mut io::stdout())?,
        Some(folder) => {
            std::fs::create_dir_all(folder)?;
            clap_mangen::generate_to(command, folder)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn open(path: &Path) -> Result<Log, Failure> {
    Log::open(path).map_err(|error| Failure::File(path.display().to_string(), error))
}

/// The recording to read, and which of its interfaces are which bus.
fn recording(args: &RecordingArgs, settings: &Settings) -> Result<(PathBuf, Routes), Failure> {
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
            return Err(Failure::Usage(format!("--map: the profile has no bus {bus}; it has {known}")));
        };
        routes.0.push((interface.clone(), BusIndex(index)));
    }
    Ok((path, routes))
}
