//! `identify`: the built-in profiles that fit a recording or a bus.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::arguments::{Shown, open};
use super::{Failure, messages};
use crate::check::identify::Identifier;
use crate::check::identify_text;
use crate::io::can::formats::Content;
use crate::io::can::log::no_frame;
use crate::io::process_log::LogForm;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway identify drive.log.gz
  signal-gateway identify drive.log --all --json";

#[derive(Debug, Args)]
pub(super) struct IdentifyArgs {
    /// Recording in any format that `check` reads, - for standard input
    log: PathBuf,
    /// List every profile of which a message was received, not only the best three
    #[arg(long)]
    all: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &IdentifyArgs) -> Result<ExitCode, Failure> {
    messages::start_log("error", LogForm::Messages)?;
    let unreadable = Failure::file(&args.log);
    let mut log = open(&args.log, Shown::Always)?;
    let mut identifier = Identifier::new()?;
    while let Some(record) = log.next_record().map_err(&unreadable)? {
        if let Content::Data(frame) = record.content {
            identifier.frame(&log.interfaces()[record.interface.0], &frame, record.stamp);
        }
    }
    drop(log);
    if identifier.frames() == 0 {
        return Err(unreadable(no_frame()));
    }
    let mut out = io::BufWriter::new(io::stdout().lock());
    let text =
        if args.json { identify_text::json(&identifier) } else { identify_text::text(&identifier, args.all) };
    out.write_all(text.as_bytes())?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}
