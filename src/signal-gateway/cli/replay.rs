//! `replay`: runs the gateway over a recording.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::arguments::{
    RecordingArgs, ShowProgress, draw, expect_folder_of, file_name, open, page_path, recording, settings,
    speed, svg_path,
};
use super::csv_output::{CsvArgs, CsvFile};
use super::failure::Failure;
use super::live::IsolationArgs;
use super::mcap_export::McapExport;
use super::messages;
use super::recordings::{Batch, SeveralArgs, Tabulated, Wanted};
use super::unreadable::expect_recording;
use super::view::ViewArgs;
use super::web::WebArgs;
use crate::check::table::ReportValues;
use crate::check::timeline::TimelineCollector;
use crate::check::{recording_faults, sample_faults};
use crate::config::Settings;
use crate::config::gateway::Stamps;
use crate::daemon::publisher::{subscriptions, topics};
use crate::daemon::recording::encoder;
use crate::daemon::{Playback, PlayedRecording, play};
use crate::io::new_files::write_new;
use crate::io::process_log::LogForm;
use crate::io::sample_log::{LoggedSample, SampleKind, SampleLog};
use crate::replay::{Departures, NoRun, RecordedInput, RecordedRun, Recording, Replay, Routes, RunSink};
use crate::report::gateway::{Changes, JsonTimeline};
use crate::report::output_budget::OutputBudget;
use crate::report::view::{Destination, View, time_text};
use can_log::file_budget::FileBudget;
use can_log::{Log, no_frame};
use can_signal::can::CanInput;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::call::TimedCall;
use gateway_core::gateway::event::Output;

pub(super) const REPLAY_HELP: &str = "\
Examples:
  signal-gateway replay --config config/demo.toml --json
  signal-gateway replay drive.log.gz --profile hyundai_kia
  signal-gateway replay drive.log -c gateway.toml --mcap drive.mcap --report drive.html
  signal-gateway replay drive.log -c gateway.toml --open
  signal-gateway replay drive.log -c gateway.toml --csv drive.csv --rate 10
  signal-gateway replay archive/ -c gateway.toml --csv tables/ --json > results.jsonl
  signal-gateway replay drive.log --config gateway.toml --map can1=body \\
    --speed 1 --ros
  signal-gateway replay bags/gateway_000001_20261122T230000Z -c gateway.toml --mcap drive

With --json every published message is one line
  {\"t\": seconds, \"topic\": name, \"data\": {message fields}}
and /diagnostics is a line whenever a status changes, holding the statuses that changed.
t is virtual time since the first frame of the recording, with a bag of run --record since the start
of the gateway, whose run is repeated to the byte; stamps come from the recording
(with --ros the present, unless [recording] stamps = \"recorded\").

With --csv the columns are time_s (virtual time), unix_time_s (the recording's clock), and what is
published: turn_indicators, velocity_mps … The first row is the beginning of the recording, the
last one its end. Its size is printed, with --json as one object:
  {\"csv\": FILE, \"rows\": 446, \"seconds\": 45.0, \"known_s\": {\"turn_indicators\": 37.5, …}}";

#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    #[command(flatten)]
    several: SeveralArgs,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// Write frames and messages to an MCAP file as well, or without `.mcap` to the folder of a rosbag2 bag
    #[arg(long, value_name = "FILE.mcap|DIR", conflicts_with_all = ["speed", "ros", "web", "open"])]
    mcap: Option<PathBuf>,
    /// Write a page with the timeline as well: states, and the frame behind each
    #[arg(long, value_name = "FILE.html", value_parser = page_path, conflicts_with_all = ["speed", "ros", "web", "open"])]
    report: Option<PathBuf>,
    /// Draw the timeline as well
    #[arg(long, value_name = "FILE.svg", value_parser = svg_path, conflicts_with_all = ["speed", "ros", "web", "open"])]
    picture: Option<PathBuf>,
    #[command(flatten)]
    csv: CsvArgs,
    /// Play with the original timing times FACTOR; default: as fast as possible, with --web 1
    #[arg(long, value_name = "FACTOR", value_parser = speed)]
    speed: Option<f64>,
    /// Publish on ROS 2 as well, at --speed 1 unless given
    #[arg(long)]
    ros: bool,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    web: WebArgs,
    #[command(flatten)]
    isolation: IsolationArgs,
}

pub(super) fn replay(args: &ReplayArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    if let Some(recordings) = args.several.all(args.recording.log.as_deref())? {
        return tabulate_each(args, recordings);
    }
    args.recording.log.as_deref().map_or(Ok(()), expect_recording)?;
    [&args.report, &args.picture].into_iter().flatten().try_for_each(|path| expect_folder_of(path))?;
    let settings = settings(&args.recording.config)?;
    let (path, routes) = recording(&args.recording, &settings)?;
    let json = args.json.then(|| JsonTimeline {
        topics: topics(&settings),
        hardware_id: settings.hardware_id.clone(),
        buses: settings.gateway.buses.iter().map(|bus| bus.name.clone()).collect(),
    });
    if args.ros || args.speed.is_some() || args.web.is_on() {
        if args.csv.csv.is_some() {
            let reason = "--csv is written as fast as possible: leave out --speed, --ros, --web and --open";
            return Err(Failure::Usage(reason.to_owned()));
        }
        return replay_in_time(args, settings, &path, routes, json);
    }
    let mut results = Results {
        out: messages::result_lines(args.json),
        json,
        changes: Changes::default(),
        mcap: args.mcap.as_deref().map(|path| McapExport::create(path, encoder(&settings))).transpose()?,
        timeline: (args.report.is_some() || args.picture.is_some())
            .then(|| TimelineCollector::new(&settings)),
        table: None,
        printed: OutputBudget::default(),
        failed: Ok(()),
    };
    if let Some(csv) = args.csv.file(&path)? {
        let table = ReportValues::new(&settings, csv.create()?, args.csv.rows());
        results.table = Some((table.map_err(|error| csv.failure(error))?, csv));
    }
    let unreadable = Failure::file(&path);
    let is_bag = SampleLog::is_for(&path).map_err(&unreadable)?;
    let run = if is_bag && args.recording.map.is_empty() {
        let log = SampleLog::open(&path, inputs(&settings), FileBudget::default()).map_err(&unreadable)?;
        RecordedRun::begin(settings.gateway.clone(), log, &mut results).map_err(&unreadable)?
    } else {
        Err(NoRun::NoCalls)
    };
    if let Err(reason @ (NoRun::NoStart | NoRun::OtherBuses | NoRun::OtherOrder)) = &run {
        messages::warn(&format!("the recorded run is replayed by stamps and not call by call: {reason}"));
    }
    let vehicle = settings.vehicle.clone();
    let (length, outcome) = match run {
        Ok(mut run) => {
            let outcome = call_by_call(&mut run, &mut results, &unreadable);
            (run.now().mono, outcome.map(|()| ExitCode::SUCCESS))
        }
        Err(_) => {
            let log = open(&path, args.recording.time, ShowProgress::WithoutOutput)?;
            let recording = with_samples(log, &path, &inputs(&settings)).map_err(&unreadable)?;
            let mut replay = Replay::new(settings.gateway, recording, routes).map_err(&unreadable)?;
            let outcome = by_stamps(&mut replay, &mut results, &unreadable);
            mention_losses(&replay);
            let code = if is_all_foreign(&replay) { ExitCode::from(4) } else { ExitCode::SUCCESS };
            (replay.length(), outcome.and_then(|()| has_frames(&replay, code, &unreadable)))
        }
    };
    results.finish(args, (&path, vehicle, length))?;
    outcome
}

/// Writes a table for each of several recordings.
fn tabulate_each(args: &ReplayArgs, recordings: Vec<PathBuf>) -> Result<ExitCode, Failure> {
    let outputs = [&args.mcap, &args.report, &args.picture];
    let Some(tables) = args.csv.folder().filter(|_| outputs.iter().all(|output| output.is_none())) else {
        let reason = "several recordings: give --csv FOLDER for their tables, and no other output";
        return Err(Failure::Usage(reason.to_owned()));
    };
    let settings = settings(&args.recording.config)?;
    let (car, read) = (Some(settings.vehicle.as_str()), Tabulated::read);
    let batch = Batch { wanted: Wanted::Frames, car, tables: Some(tables), as_json: args.json, read };
    args.several.run(recordings, &batch)
}

/// Returns the topics of all inputs in a recording of the gateway itself, first those of its subscriptions.
fn inputs(settings: &Settings) -> Vec<(String, SampleKind)> {
    encoder(settings).inputs(&subscriptions(settings))
}

/// Adds the ROS 2 samples to the frames of a recording, if it is a bag and contains any of `inputs`.
fn with_samples(log: Log, path: &Path, inputs: &[(String, SampleKind)]) -> io::Result<Recording> {
    let is_used = inputs.iter().any(|(_, kind)| matches!(kind, SampleKind::Input(_)));
    if !is_used || !SampleLog::is_for(path)? {
        return Ok(log.into());
    }
    let is_sample = |(_, kind): &&(String, SampleKind)| !matches!(kind, SampleKind::Frames { .. });
    let topics = inputs.iter().filter(is_sample).cloned().collect();
    let samples = SampleLog::open(path, topics, log.budget().clone())?;
    Ok(Recording { log, samples: Some(samples) })
}

/// Makes the calls of a recorded run, and warns of departures.
fn call_by_call(
    run: &mut RecordedRun,
    results: &mut Results,
    unreadable: impl Fn(io::Error) -> Failure,
) -> Result<(), Failure> {
    let outcome = loop {
        match run.step(results) {
            Ok(true) => std::mem::replace(&mut results.failed, Ok(()))?,
            Ok(false) => break Ok(()),
            Err(error) => break Err(unreadable(error)),
        }
    };
    for text in sample_faults(run.log()).chain(run.departures().map(Departures::to_string)) {
        messages::warn(&text);
    }
    outcome
}

fn by_stamps(
    replay: &mut Replay,
    results: &mut Results,
    unreadable: impl Fn(io::Error) -> Failure,
) -> Result<(), Failure> {
    loop {
        let now = replay.now();
        results.set_clock(now);
        while let Some(output) = replay.poll_output() {
            results.decided(&output, now.mono);
            results.published(&output, now.wall);
        }
        if let Some((input, at)) = replay.upcoming() {
            match input {
                RecordedInput::Can(input) => {
                    let at = Now { mono: at, wall: now.wall.after(at.since(now.mono)) };
                    results.received(input, at);
                    results.handles(input, at);
                }
                RecordedInput::Sample(sample) => results.sample(sample),
            }
        }
        std::mem::replace(&mut results.failed, Ok(()))?;
        if !replay.step().map_err(&unreadable)? {
            return Ok(());
        }
    }
}

/// Destinations of a replay on virtual time.
struct Results {
    out: io::BufWriter<Box<dyn Write>>,
    json: Option<JsonTimeline>,
    changes: Changes,
    mcap: Option<McapExport>,
    timeline: Option<TimelineCollector>,
    /// Takes the place of the printed lines.
    table: Option<(ReportValues<Box<dyn Write>>, CsvFile)>,
    printed: OutputBudget,
    failed: Result<(), Failure>,
}

impl Results {
    /// Calls `write` with the export file, unless an earlier call failed.
    fn export(&mut self, write: impl FnOnce(&mut McapExport) -> Result<(), Failure>) {
        if let (Some(mcap), Ok(())) = (&mut self.mcap, &self.failed) {
            self.failed = write(mcap);
        }
    }

    /// Sets the recording's clock for the table.
    fn set_clock(&mut self, now: Now) {
        if let Some((table, _)) = &mut self.table {
            table.set_clock(now);
        }
    }

    /// Counts an entry of the recording.
    fn entry(&mut self) {
        self.printed.entry();
        if let Some((table, _)) = &mut self.table {
            table.entry();
        }
    }

    fn finish(
        mut self,
        args: &ReplayArgs,
        (path, vehicle, length): (&Path, String, MonoTime),
    ) -> Result<(), Failure> {
        self.out.flush()?;
        let exported = self.mcap.map_or(Ok(()), McapExport::finish);
        if let Some(timeline) = self.timeline {
            let timeline = timeline.finish(file_name(path), vehicle, length);
            if let Some(path) = &args.report {
                write_new(path, &timeline.to_html(None), true).map_err(Failure::written(path))?;
            }
            args.picture.as_ref().map_or(Ok(()), |path| draw(path, &timeline.chart()))?;
        }
        exported?;
        if let Some((table, csv)) = self.table {
            csv.conclude(table.finish(length), args.json)?;
        }
        self.printed.outcome().map_err(Failure::written(Path::new("standard output")))
    }
}

impl RunSink for Results {
    fn call(&mut self, call: &TimedCall) {
        self.entry();
        self.set_clock(call.at);
        self.export(|mcap| mcap.call(call));
    }

    fn received(&mut self, input: &CanInput, at: Now) {
        self.entry();
        if let Some(mcap) = &mut self.mcap {
            mcap.advance(at.mono);
        }
        self.export(|mcap| mcap.received(input, at.wall));
    }

    fn handles(&mut self, input: &CanInput, at: Now) {
        if let Some(timeline) = &mut self.timeline {
            timeline.received(input, at);
        }
    }

    fn sample(&mut self, sample: &LoggedSample) {
        self.entry();
        // The subscriptions come first among the topics.
        self.export(|mcap| mcap.sample(sample));
    }

    fn decided(&mut self, output: &Output, at: MonoTime) {
        if let Some(mcap) = &mut self.mcap {
            mcap.advance(at);
        }
        let Self { out, json, changes, printed, table, .. } = self;
        let mut print =
            |line: &str| if printed.take(line.len() + 1, at) { writeln!(out, "{line}") } else { Ok(()) };
        let written = match (table, json) {
            (Some((table, csv)), _) => table.given_out(output, at).map_err(|error| csv.failure(error)),
            (None, Some(json)) => {
                json.line(output, at).map_or(Ok(()), |line| print(&line)).map_err(Failure::from)
            }
            (None, None) => {
                let changes = changes.of(output);
                let print = |event| print(&format!("{} {event}", time_text(at)));
                changes.iter().try_for_each(print).map_err(Failure::from)
            }
        };
        if let (Err(failure), Ok(())) = (written, &self.failed) {
            self.failed = Err(failure);
        }
        if let Some(timeline) = &mut self.timeline {
            timeline.given_out(output, at);
        }
    }

    fn published(&mut self, output: &Output, at: WallStamp) {
        self.export(|mcap| mcap.given_out(output, at));
    }
}

/// Returns `code`, or an error if the recording has no frame.
pub(super) fn has_frames(
    replay: &Replay,
    code: ExitCode,
    unreadable: impl Fn(io::Error) -> Failure,
) -> Result<ExitCode, Failure> {
    if replay.counts().is_empty() { Err(unreadable(no_frame())) } else { Ok(code) }
}

/// Returns true if there are frames, but none was received on a configured interface.
fn is_all_foreign(replay: &Replay) -> bool {
    let counts = replay.counts();
    counts.records > 0 && counts.foreign == counts.records
}

pub(super) fn mention_losses(replay: &Replay) {
    for text in recording_faults(replay) {
        messages::warn(&text);
    }
    if is_all_foreign(replay) {
        let names = replay.log().interfaces().join(", ");
        messages::warn(&format!(
            "no frame was received on a configured interface; the log has {names}: use --map INTERFACE=BUS"
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
    settings.ros.isolated = !args.isolation.no_isolation;
    args.web.apply(&mut settings.http)?;
    let configured = settings.recording.as_ref().map(|recording| recording.stamps);
    let stamps = if args.ros { configured.unwrap_or_default() } else { Stamps::Recorded };
    let playback = Playback { speed: args.speed.unwrap_or(1.0), repeat: false, stamps, stay: false };
    let title = format!("replay · {}, {}", settings.vehicle, file_name(path));
    let url = settings.http.url();
    let view = match json {
        Some(timeline) => View::new(Destination::Json(Box::new(timeline))),
        None if messages::options().quiet => View::new(Destination::Silent),
        None => args.view.open(title, url, View::lines)?,
    };
    // With ROS 2, the inputs come from ROS 2.
    let inputs = if args.ros { Vec::new() } else { inputs(&settings) };
    let reopen = || with_samples(args.recording.time.apply(Log::open(path)?)?, path, &inputs);
    let recording = PlayedRecording { name: &path.display().to_string(), reopen: &reopen, routes };
    play(settings, view, None, recording, playback)?;
    Ok(ExitCode::SUCCESS)
}
