//! `check` and `decode`: inspect a configuration, and signals by name.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::arguments::{
    ConfigArgs, DEFAULT_CONFIG, RecordingArgs, ShowProgress, TimeArgs, open, recording, settings, settings_in,
};
use super::csv_output::CsvArgs;
use super::failure::Failure;
use super::progress::ProgressDisplay;
use super::recordings::{Batch, Checked, SeveralArgs, Wanted};
use super::replay::{has_frames, mention_losses};
use super::running::likely_socket;
use super::unreadable::expect_recording;
use super::view::{self, ViewArgs};
use super::{against_running, messages};
use crate::check::decode::Decoder;
use crate::check::live_messages::LiveMessages;
use crate::check::patch::{Fix, patch, timeouts};
use crate::check::table::SignalValues;
use crate::check::{CheckReport, JsonReport};
use crate::config::files::{Disk, Files as _, ListedDisk};
use crate::config::ros_names::RosOverrides;
use crate::config::{Refused, Settings, SourceLocation};
use crate::io::clock::Clock;
use crate::io::process_log::LogForm;
use crate::io::service_user::{SERVICE_USER, unreadable_for_service};
use crate::replay::{RecordedInput, Replay};
use crate::report::schema::schema;
use crate::{check, daemon};
use can_signal::can::CanInput;
use vehicle_bringup::plausibility::finding::Severity;

pub(super) const CHECK_HELP: &str = "\
Examples:
  signal-gateway check --config gateway.toml
  signal-gateway check drive.log.gz --profile ford_falcon_fg
  signal-gateway check drive.log --config gateway.toml --fix
  signal-gateway check archive/ --config gateway.toml --json > results.jsonl
  signal-gateway check lanelet2_map.osm

Findings are errors (the profile belongs to another vehicle, or cannot work), warnings, and notes,
which need no action. With an error or a warning the exit code is 4, and each has a remedy;
docs/ci.md describes all kinds of findings, and `check` in a pipeline.

A lanelet2 map (.osm, or a folder with lanelet2_map.osm) is checked by itself: tags that
decide about turn signals, held against the geometry of their lanelets.

  signal-gateway check --against-running && systemctl reload signal-gateway

With --against-running nothing but the two configurations is compared; the exit code is 9 where a
restart is needed, and 8 where no gateway can be reached. As JSON it is
  {\"reload\": [{\"part\", \"before\", \"after\"}], \"restart\": [...]}

With --json one object is printed; --schema prints its JSON Schema:
  {\"errors\": 0, \"warnings\": 1, \"notes\": 0, \"findings\": [{\"kind\": \"message_missing\",
   \"severity\": \"warning\", \"text\": TEXT, \"remedy\": TEXT or null,
   \"fix\": {\"section\": \"message.NAME\", \"line\": TOML} or null}], \"facts\": [{\"about\", \"text\"}]}";

pub(super) const DECODE_HELP: &str = "\
Examples:
  signal-gateway decode drive.log.gz --profile j1939_truck --changes
  signal-gateway decode drive.log --profile hyundai_kia --csv signals.csv
  signal-gateway decode --live --config gateway.toml
  signal-gateway decode --live --plain --changes | grep TURN

On a terminal --live shows a table: for each identifier the last frame with what changed in it, its
rate and its signals, also of frames that the profile does not bind. ? shows its keys.
Elsewhere, with --plain and with --changes it prints a line for each bound signal.

With --csv the columns are time_s (virtual time), unix_time_s (the recording's clock), and the bound
signals: states in words, measured values in the unit of the DBC, as in SPEED.ENCODER [km per h].
A cell is empty while the gateway would not use the value: before the first frame, after a timeout,
or when the frame fails a check.";

#[derive(Debug, Args)]
#[allow(clippy::struct_excessive_bools)] // options
pub(super) struct CheckArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    #[command(flatten)]
    several: SeveralArgs,
    /// Exit with 4 for notes as well, not only from warnings up
    #[arg(long)]
    strict: bool,
    /// Print lines for the profile, as TOML, that mend what the recording can mend
    #[arg(long)]
    fix: bool,
    /// Print one JSON object, for CI
    #[arg(long, conflicts_with = "fix")]
    json: bool,
    /// Print the JSON Schema of --json, and check nothing
    #[arg(long, conflicts_with_all = ["log", "fix", "json", "against_running"])]
    schema: bool,
    /// Compare with the configuration of the running gateway instead: what a reload would change, and what
    /// needs a restart
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, require_equals = true,
          conflicts_with_all = ["log", "map", "fix", "strict"])]
    #[allow(clippy::option_option)] // clap's form of an option whose value may be left out
    against_running: Option<Option<PathBuf>>,
}

#[derive(Debug, Args)]
pub(super) struct DecodeArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// From the configured interfaces instead of a recording
    #[arg(long, conflicts_with_all = ["log", "map", "time_unit", "csv"])]
    live: bool,
    /// A signal only when its value changes
    #[arg(long)]
    changes: bool,
    #[command(flatten)]
    csv: CsvArgs,
    #[command(flatten)]
    view: ViewArgs,
}

pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, Failure> {
    messages::start_log("error", LogForm::Messages)?;
    if args.schema {
        writeln!(io::stdout().lock(), "{:#}", schema::<JsonReport<'_>>())?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(socket) = &args.against_running {
        let settings = settings(&args.recording.config)?;
        let likely = || likely_socket(&settings.file);
        let socket = socket.clone().or_else(|| settings.status.socket.clone()).unwrap_or_else(likely);
        return against_running::run(&settings, &socket, args.json);
    }
    let recordings = args.several.all(args.recording.log.as_deref())?;
    match recordings.filter(|recordings| !matches!(recordings.as_slice(), [only] if is_map(only))) {
        Some(recordings) => judge_each(args, recordings),
        None => judge(args),
    }
}

/// Checks several recordings, after the configuration that they have in common.
fn judge_each(args: &CheckArgs, recordings: Vec<PathBuf>) -> Result<ExitCode, Failure> {
    if args.fix {
        return Err(Failure::Usage("--fix mends by one recording: give it alone".to_owned()));
    }
    let settings = settings(&args.recording.config)?;
    let (car, read) = (Some(settings.vehicle.as_str()), Checked::read);
    let batch = Batch { wanted: Wanted::Frames, car, tables: None, as_json: args.json, read };
    args.several.run(recordings, &batch)
}

fn judge(args: &CheckArgs) -> Result<ExitCode, Failure> {
    let recorded = &args.recording;
    match recorded.log.as_deref() {
        Some(path) if is_map(path) => {
            let _progress = ProgressDisplay::spinner("reading the map");
            let remedy = "give a lanelet2 map, or a folder with lanelet2_map.osm";
            let report =
                check::map(&Disk, path).map_err(|problem| Refused::from(problem.or_remedy(remedy)))?;
            return print(args, &report, None);
        }
        Some(path) => expect_recording(path)?,
        None => {}
    }
    let files = ListedDisk::default();
    let settings = match settings_in(&files, &recorded.config, &RosOverrides::default()) {
        Err(Failure::Refused(refused)) if args.fix => {
            return mend(refused, recorded.log.as_deref(), recorded.time);
        }
        settings => settings?,
    };
    let mut report = check::binding(&settings);
    let config = recorded.config.config.as_deref();
    let is_of_service = match config {
        Some(config) => config == Path::new(DEFAULT_CONFIG),
        None => recorded.config.profile.is_none(),
    };
    let read = files.paths();
    if let Some(unreadable) = is_of_service.then(|| unreadable_for_service(&read)).flatten() {
        report.append(check::service_files(&read, SERVICE_USER, &unreadable));
    }
    let (mut outcome, mut judged) = (Ok(()), None);
    if recorded.log.is_some() || settings.recording.is_some() {
        let (path, routes) = recording(recorded, &settings)?;
        judged = Some(path.clone());
        let unreadable = Failure::file(&path);
        let log = open(&path, recorded.time, ShowProgress::Always)?;
        let replay = Replay::surveying(settings.gateway.clone(), log, routes).map_err(&unreadable)?;
        let (surveyed, read) = check::recording(&settings, replay);
        report.append(surveyed);
        outcome = read.map_err(unreadable);
    } else {
        report.append(check::dimensions::missing(&settings));
    }
    let code = print(args, &report, settings.profile.as_ref())?;
    if let Some(path) = judged.filter(|_| report.count(Severity::Error) > 0) {
        let path = path.display();
        messages::note(&format!("the profiles that fit this recording: signal-gateway identify {path}"));
    }
    outcome.map(|()| code)
}

/// Proposes missing timeouts of a refused profile from the recording, and fails with the refusal.
fn mend(refused: Refused, log: Option<&Path>, time: TimeArgs) -> Result<ExitCode, Failure> {
    let missing: Vec<_> = refused.0.iter().filter_map(|problem| problem.missing_timeout.as_deref()).collect();
    let problem = refused.0.iter().find(|problem| problem.missing_timeout.is_some());
    if let (Some(problem), [first, ..], Some(log)) = (problem, missing.as_slice(), log) {
        let fixes =
            timeouts(&mut open(log, time, ShowProgress::Always)?, &missing).map_err(Failure::file(log))?;
        print_patch(&problem.file, &first.profile_key, &fixes.iter().collect::<Vec<_>>())?;
        messages::note("with these lines in the profile, run it again: only then the recording is checked");
    }
    Err(refused.into())
}

fn print_patch(profile: &Path, key: &str, fixes: &[&Fix]) -> Result<(), Failure> {
    let text = Disk.read(profile).unwrap_or_default();
    let text = patch(profile, &String::from_utf8_lossy(&text), key, fixes);
    Ok(io::stdout().lock().write_all(text.as_bytes())?)
}

fn is_map(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "osm") || path.join("lanelet2_map.osm").exists()
}

/// Prints a report in the requested form, and returns the exit code for its findings.
fn print(
    args: &CheckArgs,
    report: &CheckReport,
    profile: Option<&SourceLocation>,
) -> Result<ExitCode, Failure> {
    let report = if messages::options().quiet { &report.without_facts() } else { report };
    if let Some(profile) = profile.filter(|_| args.fix) {
        let fixes = report.fixes();
        print_patch(&profile.file, &profile.key, &fixes)?;
        if fixes.is_empty() {
            let why = match &args.recording.log {
                Some(_) => "the recording shows no line that it lacks",
                None => "give a recording of the vehicle",
            };
            messages::note(&format!("nothing to add to the profile: {why}"));
        }
    } else if !args.fix {
        let text = if args.json { report.json() } else { report.text(messages::layout(&io::stdout())) };
        io::stdout().lock().write_all(text.as_bytes())?;
    }
    let lightest = if args.strict { Severity::Note } else { Severity::Warning };
    let is_sound = report.findings().iter().all(|finding| finding.severity < lightest);
    Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::from(4) })
}

/// Checks new files on a recording, as `check LOG --config CONFIG` does.
pub(super) fn check_files(config: &Path, log: &Path, time: TimeArgs) -> Result<ExitCode, Failure> {
    let config = ConfigArgs { config: Some(config.to_owned()), profile: None };
    let recording = RecordingArgs { log: Some(log.to_owned()), config, map: Vec::new(), time };
    let several = SeveralArgs::default();
    judge(&CheckArgs {
        recording,
        several,
        strict: false,
        fix: false,
        json: false,
        schema: false,
        against_running: None,
    })
}

pub(super) fn decode(args: &DecodeArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    args.recording.log.as_deref().map_or(Ok(()), expect_recording)?;
    let settings = settings(&args.recording.config)?;
    if args.csv.csv.is_some() {
        return decode_to_table(args, settings);
    }
    let mut decoder = Decoder::new(&settings, args.changes);
    if args.live {
        let clock = Clock::start();
        if args.view.is_live() && !args.changes {
            return show_messages(&settings, &clock);
        }
        let mut out = io::stdout().lock();
        let ids = |bus| Some(settings.gateway.relevant_ids(bus));
        daemon::listen(&settings, ids, |inputs| {
            inputs.iter().try_for_each(|input| decoder.print(input, clock.now(), &mut out))
        })?;
        return Ok(ExitCode::SUCCESS);
    }
    let (path, routes) = recording(&args.recording, &settings)?;
    let unreadable = Failure::file(&path);
    let log = open(&path, args.recording.time, ShowProgress::WithoutOutput)?;
    let mut replay = Replay::new(settings.gateway, log, routes).map_err(&unreadable)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let outcome = loop {
        match replay.skim() {
            Ok(Some(RecordedInput::Can(input))) => decoder.print(&input, replay.now(), &mut out)?,
            Ok(Some(RecordedInput::Sample(_))) => {}
            Ok(None) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    out.flush()?;
    mention_losses(&replay);
    outcome.and_then(|code| has_frames(&replay, code, &unreadable))
}

/// Runs the gateway over the recording, so that a value counts for as long as the gateway would use it.
fn decode_to_table(args: &DecodeArgs, settings: Settings) -> Result<ExitCode, Failure> {
    let (path, routes) = recording(&args.recording, &settings)?;
    let unreadable = Failure::file(&path);
    let Some(csv) = args.csv.file(&path)? else { return Ok(ExitCode::SUCCESS) };
    let log = open(&path, args.recording.time, ShowProgress::Always)?;
    let unwritable = |error| csv.failure(error);
    let table = SignalValues::new(&settings, csv.create()?, args.csv.rows());
    let mut table = table.map_err(unwritable)?;
    let mut replay = Replay::new(settings.gateway, log, routes).map_err(&unreadable)?;
    let outcome = loop {
        while replay.poll_output().is_some() {}
        table.take(replay.gateway(), replay.now()).map_err(unwritable)?;
        if replay.upcoming().is_some() {
            table.entry();
        }
        match replay.step() {
            Ok(true) => {}
            Ok(false) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    csv.conclude(table.finish(replay.length()), false)?;
    mention_losses(&replay);
    outcome.and_then(|code| has_frames(&replay, code, &unreadable))
}

fn show_messages(settings: &Settings, clock: &Clock) -> Result<ExitCode, Failure> {
    let mut messages = LiveMessages::new(settings);
    let mut view = view::start_messages(format!("decode · {}", settings.vehicle))?;
    let show = |inputs: &[CanInput]| {
        let now = clock.now();
        for input in inputs {
            messages.take(input, now);
        }
        if view.is_due() {
            view.picture(messages.picture(now.mono));
            view.messages(messages.rows(now.mono));
        }
        Ok(())
    };
    daemon::listen(settings, |_| None, show)?;
    Ok(ExitCode::SUCCESS)
}
