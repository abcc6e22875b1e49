//! `identify`: finds the built-in profiles that fit a recording or a bus.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;

use super::arguments::{ShowProgress, TimeArgs, open, seconds};
use super::failure::Failure;
use super::messages;
use super::progress::ProgressDisplay;
use super::recordings::{Batch, Identified, SeveralArgs, Wanted};
use crate::check::identify::{Identifier, ProfileCandidate};
use crate::check::{identify_text, log_faults};
use crate::daemon::DaemonError;
use crate::daemon::bus_survey::listen_to;
use crate::io::process_log::LogForm;
use can_log::{EntryContent, no_frame};
use can_signal::can::{CanInput, LinkState};
use gateway_base::time::millis;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway identify drive.log.gz
  signal-gateway identify drive.log --all --json
  signal-gateway identify archive/ --jobs 4
  signal-gateway identify --live can0 --seconds 60

Listening ends with --seconds, on Ctrl-C with what was received until then, or as soon as one
profile alone fits. Use the indicators meanwhile: left, right and hazard tell profiles apart.";

#[derive(Debug, Args)]
pub(super) struct IdentifyArgs {
    /// Recording in any format that `check` reads, - for standard input
    #[arg(required_unless_present = "live")]
    log: Option<PathBuf>,
    #[command(flatten)]
    several: SeveralArgs,
    #[command(flatten)]
    time: TimeArgs,
    /// Listen to INTERFACE instead of reading a recording; nothing is sent
    #[arg(long, value_name = "INTERFACE", conflicts_with = "log")]
    live: Option<String>,
    /// Longest time to listen
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "30", requires = "live", conflicts_with = "log")]
    seconds: Duration,
    /// List every profile of which a message was received, not only the best three
    #[arg(long)]
    all: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &IdentifyArgs) -> Result<ExitCode, Failure> {
    messages::start_log("error", LogForm::Messages)?;
    if let Some(recordings) = args.several.all(args.log.as_deref())? {
        let read = Identified::read;
        let batch = Batch { wanted: Wanted::Frames, car: None, tables: None, as_json: args.json, read };
        return args.several.run(recordings, &batch);
    }
    let identifier = match (&args.live, &args.log) {
        (Some(interface), _) => listen(interface, args.seconds)?,
        (None, log) => read(log.as_deref().unwrap_or(Path::new("-")), args.time)?,
    };
    let mut out = io::BufWriter::new(io::stdout().lock());
    let text = if args.json {
        identify_text::json(&identifier)
    } else {
        identify_text::text(&identifier, args.log.as_deref(), args.all, messages::layout(&io::stdout()))
    };
    out.write_all(text.as_bytes())?;
    out.flush()?;
    let fits = identifier.candidates().iter().any(ProfileCandidate::fits);
    Ok(if fits { ExitCode::SUCCESS } else { ExitCode::from(4) })
}

pub(super) fn read(path: &Path, time: TimeArgs) -> Result<Identifier, Failure> {
    let unreadable = Failure::file(path);
    let mut log = open(path, time, ShowProgress::Always)?;
    let mut identifier = Identifier::new()?;
    while let Some(record) = log.next_record().map_err(&unreadable)? {
        if let EntryContent::Data(frame) = record.content {
            identifier.frame(&log.interfaces()[record.interface.0], &frame, record.stamp);
        }
    }
    if identifier.frames() == 0 {
        return Err(unreadable(no_frame()));
    }
    log_faults(&log).for_each(|text| messages::warn(&text));
    Ok(identifier)
}

/// Minimum time to listen, and the interval at which the best candidate is determined.
const SHORTEST: Duration = Duration::from_secs(3);
const LOOK: Duration = Duration::from_secs(1);

pub(super) fn listen(interface: &str, length: Duration) -> Result<Identifier, Failure> {
    let mut identifier = Identifier::new()?;
    let form = "{spinner} {msg} [{wide_bar}] {eta} left";
    let progress = ProgressDisplay::new(format!("listening to {interface}"), Some(millis(length)), form);
    let start = Instant::now();
    let (mut looked, mut unusable) = (SHORTEST, None);
    listen_to(interface, length, |input| {
        if let CanInput::Link { state, .. } = *input {
            unusable = (state != LinkState::Up).then_some(state);
            return unusable.is_none();
        }
        let CanInput::Frame { frame, stamp, .. } = input else { return true };
        identifier.frame(interface, frame, *stamp);
        let elapsed = start.elapsed();
        progress.set(millis(elapsed));
        if elapsed < looked {
            return true;
        }
        looked = elapsed + LOOK;
        !identifier.is_sure()
    })?;
    drop(progress);
    if let Some(state) = unusable.filter(|_| identifier.frames() == 0) {
        return Err(DaemonError::NoLink { interface: interface.to_owned(), state }.into());
    }
    if identifier.frames() == 0 {
        let seconds = start.elapsed().as_secs_f64();
        return Err(Failure::Usage(format!(
            "{interface}: not one frame was received in {seconds:.0} s; look at ignition, cable and bit rate"
        )));
    }
    Ok(identifier)
}
