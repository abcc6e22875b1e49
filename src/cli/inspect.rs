//! `check` and `decode`: bindings, and signals by name.

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::Args;

use super::arguments::{RecordingArgs, open, recording, settings};
use super::replay::{has_frames, mention_losses};
use super::{Failure, start_log};
use crate::check;
use crate::check::decode::Decoder;
use crate::config::files::Disk;
use crate::config::{Problem, Refused};
use crate::daemon;
use crate::io::clock::Clock;
use crate::replay::Replay;
use crate::report::text::counted;

pub(super) const CHECK_HELP: &str = "\
Examples:
  signal-gateway check --config gateway.toml
  signal-gateway check drive.log.gz --profile ford_falcon_fg
  signal-gateway check lanelet2_map.osm

A lanelet2 map (.osm, or a folder with lanelet2_map.osm) is checked by itself: tags that decide about turn
signals, held against the geometry of their lanelets.";

pub(super) const DECODE_HELP: &str = "\
Examples:
  signal-gateway decode drive.log.gz --profile j1939_truck --changes
  signal-gateway decode --live --config gateway.toml";

#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    #[command(flatten)]
    recording: RecordingArgs,
}

#[derive(Debug, Args)]
pub(super) struct DecodeArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// From the configured interfaces instead of a recording
    #[arg(long, conflicts_with_all = ["log", "map"])]
    live: bool,
    /// A signal only when its value changes
    #[arg(long)]
    changes: bool,
}

pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, Failure> {
    start_log("error");
    let args = &args.recording;
    if let Some(path) = args.log.as_deref().filter(|path| is_map(path)) {
        let report = check::map(&Disk, path).map_err(|reason| {
            let remedy = "give a lanelet2 map, or a folder with lanelet2_map.osm";
            Refused(vec![Problem::whole_file(path, reason, remedy)])
        })?;
        return finish(&mut io::stdout().lock(), &report.text, report.concerns);
    }
    let settings = settings(&args.config)?;
    let bound = check::binding(&settings);
    let mut out = io::stdout().lock();
    out.write_all(bound.text.as_bytes())?;
    let mut concerns = bound.concerns;
    if args.log.is_some() || settings.recording.is_some() {
        let (path, routes) = recording(args, &settings)?;
        let unreadable = Failure::file(&path);
        let replay =
            Replay::surveying(settings.gateway.clone(), open(&path)?, routes).map_err(&unreadable)?;
        let (report, outcome) = check::recording(&settings, replay);
        out.write_all(report.text.as_bytes())?;
        concerns += report.concerns;
        outcome.map_err(&unreadable)?;
    }
    finish(&mut out, "", concerns)
}

/// Returns whether a path names a lanelet2 map and not a recording.
fn is_map(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "osm") || path.is_dir()
}

/// Writes the rest of a report and the number of warnings.
fn finish(out: &mut impl Write, text: &str, concerns: u32) -> Result<ExitCode, Failure> {
    writeln!(out, "{text}{}", counted(concerns.into(), "warning"))?;
    Ok(if concerns == 0 { ExitCode::SUCCESS } else { ExitCode::from(4) })
}

pub(super) fn decode(args: &DecodeArgs) -> Result<ExitCode, Failure> {
    start_log("warn");
    let settings = settings(&args.recording.config)?;
    let mut decoder = Decoder::new(&settings, args.changes);
    if args.live {
        let mut out = io::stdout().lock();
        let clock = Clock::start();
        daemon::listen(&settings, |input| decoder.print(&input, clock.now(), &mut out))?;
        return Ok(ExitCode::SUCCESS);
    }
    let (path, routes) = recording(&args.recording, &settings)?;
    let unreadable = Failure::file(&path);
    let mut replay = Replay::new(settings.gateway, open(&path)?, routes).map_err(&unreadable)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let outcome = loop {
        match replay.skim() {
            Ok(Some(input)) => decoder.print(&input, replay.now(), &mut out)?,
            Ok(None) => break Ok(ExitCode::SUCCESS),
            Err(error) => break Err(unreadable(error)),
        }
    };
    out.flush()?;
    mention_losses(&replay);
    outcome.and_then(|code| has_frames(&replay, code, &unreadable))
}
