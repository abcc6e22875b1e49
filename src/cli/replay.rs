//! `replay`: runs the gateway over a recording.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::arguments::{
    RecordingArgs, ShowProgress, draw, file_name, open, recording, settings, speed, svg_path,
};
use super::failure::Failure;
use super::live::IsolationArgs;
use super::mcap_export::McapExport;
use super::messages;
use super::unreadable::expect_recording;
use super::view::ViewArgs;
use super::web::WebArgs;
use crate::check::recording_faults;
use crate::check::timeline::TimelineCollector;
use crate::config::Settings;
use crate::config::gateway::Stamps;
use crate::core::gateway::event::Output;
use crate::core::time::{MonoTime, Now};
use crate::daemon::publisher::topics;
use crate::daemon::recording::encoder;
use crate::daemon::{self, Playback};
use crate::io::can::log::{Log, no_frame};
use crate::io::new_files::write_new;
use crate::io::process_log::LogForm;
use crate::replay::{Replay, Routes};
use crate::report::gateway::{Changes, JsonTimeline};
use crate::report::view::{View, time_text};

pub(super) const REPLAY_HELP: &str = "\
Examples:
  signal-gateway replay --config config/demo.toml --json
  signal-gateway replay drive.log.gz --profile hyundai_kia
  signal-gateway replay drive.log -c gateway.toml --mcap drive.mcap --report drive.html
  signal-gateway replay drive.log -c gateway.toml --open
  signal-gateway replay drive.log --config gateway.toml --map can1=body \\
    --speed 1 --ros

With --json every published message is one line
  {\"t\": seconds, \"topic\": name, \"data\": {message fields}}
and /diagnostics is a line whenever a status changes, holding the statuses that changed.
t is virtual time since the first frame of the recording; stamps come from the recording
(with --ros the present, unless [recording] stamps = \"recorded\").";

#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// Write frames and messages to an MCAP file as well, or without `.mcap` to the folder of a rosbag2 bag
    #[arg(long, value_name = "FILE.mcap|DIR", conflicts_with_all = ["speed", "ros", "web", "open"])]
    mcap: Option<PathBuf>,
    /// Write a page with the timeline as well: states, and the frame behind each
    #[arg(long, value_name = "FILE.html", conflicts_with_all = ["speed", "ros", "web", "open"])]
    report: Option<PathBuf>,
    /// Draw the timeline as well
    #[arg(long, value_name = "FILE.svg", value_parser = svg_path, conflicts_with_all = ["speed", "ros", "web", "open"])]
    picture: Option<PathBuf>,
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
    args.recording.log.as_deref().map_or(Ok(()), expect_recording)?;
    let settings = settings(&args.recording.config)?;
    let (path, routes) = recording(&args.recording, &settings)?;
    let json = args.json.then(|| JsonTimeline {
        topics: topics(&settings),
        hardware_id: settings.hardware_id.clone(),
        buses: settings.gateway.buses.iter().map(|bus| bus.name.clone()).collect(),
    });
    if args.ros || args.speed.is_some() || args.web.is_on() {
        return replay_in_time(args, settings, &path, routes, json);
    }
    let log = open(&path, args.recording.time, ShowProgress::WithoutOutput)?;
    let unreadable = Failure::file(&path);
    let mut mcap =
        args.mcap.as_deref().map(|path| McapExport::create(path, encoder(&settings))).transpose()?;
    let mut timeline =
        (args.report.is_some() || args.picture.is_some()).then(|| TimelineCollector::new(&settings));
    let vehicle = settings.vehicle.clone();
    let mut replay = Replay::new(settings.gateway, log, routes).map_err(&unreadable)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut changes = Changes::default();
    let outcome = loop {
        let now = replay.now();
        while let Some(output) = replay.poll_output() {
            write_output(&mut out, json.as_ref(), &mut changes, &output, now.mono)?;
            mcap.iter_mut().try_for_each(|mcap| mcap.given_out(&output, now.wall))?;
            if let Some(timeline) = &mut timeline {
                timeline.given_out(&output, now.mono);
            }
        }
        if let Some((input, at)) = replay.upcoming() {
            let at = Now { mono: at, wall: now.wall.after(at.since(now.mono)) };
            mcap.iter_mut().try_for_each(|mcap| mcap.received(input, at.wall))?;
            if let Some(timeline) = &mut timeline {
                timeline.received(input, at);
            }
        }
        match replay.step() {
            Ok(true) => {}
            Ok(false) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    out.flush()?;
    mcap.map_or(Ok(()), McapExport::finish)?;
    if let Some(timeline) = timeline {
        let timeline = timeline.finish(file_name(&path), vehicle, replay.length());
        if let Some(path) = &args.report {
            write_new(path, &timeline.to_html(), true).map_err(Failure::written(path))?;
        }
        args.picture.as_ref().map_or(Ok(()), |path| draw(path, &timeline.chart()))?;
    }
    mention_losses(&replay);
    outcome.and_then(|code| has_frames(&replay, code, &unreadable))
}

/// Returns `code`, or an error if the recording has no frame.
pub(super) fn has_frames(
    replay: &Replay,
    code: ExitCode,
    unreadable: impl Fn(io::Error) -> Failure,
) -> Result<ExitCode, Failure> {
    if replay.counts().records == 0 { Err(unreadable(no_frame())) } else { Ok(code) }
}

fn write_output(
    out: &mut impl Write,
    json: Option<&JsonTimeline>,
    changes: &mut Changes,
    output: &Output,
    at: MonoTime,
) -> io::Result<()> {
    match json {
        Some(json) => json.line(output, at).map_or(Ok(()), |line| writeln!(out, "{line}")),
        None => changes.of(output).iter().try_for_each(|event| writeln!(out, "{} {event}", time_text(at))),
    }
}

/// Warns about faults of the replayed log.
pub(super) fn mention_losses(replay: &Replay) {
    let (log, counts) = (replay.log(), replay.counts());
    for text in recording_faults(replay) {
        messages::warn(&text);
    }
    if counts.records > 0 && counts.foreign == counts.records {
        let names = log.interfaces().join(", ");
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
    args.web.apply(&mut settings.http);
    let configured = settings.recording.as_ref().map(|recording| recording.stamps);
    let stamps = if args.ros { configured.unwrap_or_default() } else { Stamps::Recorded };
    let playback = Playback { speed: args.speed.unwrap_or(1.0), repeat: false, stamps, stay: false };
    let title = format!("replay · {}, {}", settings.vehicle, file_name(path));
    let url = settings.http.url();
    let view = if json.is_some() { View::lines()? } else { args.view.open(title, url, View::lines)? };
    let reopen = || args.recording.time.apply(Log::open(path)?);
    daemon::play(settings, view, json, (&path.display().to_string(), &reopen, routes), playback)?;
    Ok(ExitCode::SUCCESS)
}
