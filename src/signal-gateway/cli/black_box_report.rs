//! `black-box-report`: the page of a black box for the live page, in a separate process, so that neither its
//! memory nor its faults affect the gateway.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use clap::Args;
use rustix::process::{Resource, Rlimit, setrlimit};

use super::arguments::{ConfigArgs, file_name, settings};
use super::failure::Failure;
use crate::check::timeline::TimelineCollector;
use crate::replay::{Recording, Replay, Routes};
use crate::report::page::Page;
use crate::report::text::escaped;
use crate::report::timeline::{OpenedAt, Timeline};
use can_log::Log;

/// Maximum processor time, seconds; a black box of the default length takes less than 1 s.
const MAX_SECONDS: u64 = 30;
/// Maximum private writable memory, bytes. A black box of 100,000 frames with a change each takes 60 MB. This
/// leaves the service room below its own limit.
const MAX_MEMORY: u64 = 128 * 1024 * 1024;

#[derive(Debug, Args)]
pub(super) struct BlackBoxReportArgs {
    /// Log of the black box
    log: PathBuf,
    /// Place at which it opens, as JSON
    #[arg(long, value_parser = |text: &str| serde_json::from_str::<OpenedAt>(text).map_err(|error| error.to_string()))]
    opened_at: OpenedAt,
    #[command(flatten)]
    config: ConfigArgs,
}

pub(super) fn run(args: &BlackBoxReportArgs) -> Result<ExitCode, Failure> {
    for (resource, limit) in [(Resource::Cpu, MAX_SECONDS), (Resource::Data, MAX_MEMORY)] {
        let limit = Some(limit);
        setrlimit(resource, Rlimit { current: limit, maximum: limit }).map_err(io::Error::from)?;
    }
    let settings = settings(&args.config)?;
    let unreadable = Failure::file(&args.log);
    let recording = Recording::from(Log::open(&args.log).map_err(&unreadable)?);
    let routes = Routes::by_interface(&settings.gateway);
    let replay = Replay::new(settings.gateway.clone(), recording, routes).map_err(&unreadable)?;
    let timeline =
        TimelineCollector::replayed(&settings, replay, file_name(&args.log)).map_err(&unreadable)?;
    io::stdout().lock().write_all(timeline.to_html(Some(&args.opened_at)).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Creates the page of a black-box log, with the configuration on the disk. An error is a text for users.
pub(super) fn black_box_report(
    config: &ConfigArgs,
    log: &Path,
    opened_at: &OpenedAt,
) -> Result<Page, String> {
    let mut command = Command::new("/proc/self/exe");
    command.arg("black-box-report").arg(log);
    // Plain structs of numbers and strings: this cannot fail.
    command.arg("--opened-at").arg(serde_json::to_string(opened_at).unwrap_or_default());
    for (name, path) in [("--config", &config.config), ("--profile", &config.profile)] {
        command.args(path.iter().flat_map(|path| [name.as_ref(), path.as_os_str()]));
    }
    let output = command.stdin(Stdio::null()).output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(format!("no report of {}: {}; {}", log.display(), output.status, escaped(text.trim())));
    }
    String::from_utf8(output.stdout).map(Timeline::page).map_err(|error| error.to_string())
}
