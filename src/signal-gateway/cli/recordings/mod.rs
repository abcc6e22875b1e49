//! Commands on several recordings: each recording in a process of its own, as many at once as there are
//! processors, and one table of the results.
//!
//! A recording that makes its process fail, or use too much memory, is a row like any other. The processes
//! run the command for one recording with `--json`; only a few rows are held in memory.

mod command_line;
mod found;
mod row;
mod search;
mod worker;

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

use clap::Args;

use super::failure::Failure;
use super::progress::ProgressDisplay;
use super::{messages, misuse};
use can_log::standard_input;
use command_line::Arguments;
use found::ReadResult;
pub(super) use found::{Checked, DecideSummary, Identified, Tabulated};
use row::{ResultTable, Row};
use search::Search;
pub(super) use search::Wanted;

/// Maximum number of recordings that have been given to a process before the oldest row is written, for
/// each process.
const AHEAD: usize = 64;

#[derive(Debug, Clone, Default, Args)]
pub(super) struct SeveralArgs {
    /// Further recordings. Of several recordings, or of the recordings in a folder, each is read in a process
    /// of its own, and one table has the results; the exit code is the worst: 1, 2, 3, 5, 4 or 0
    #[arg(value_name = "LOG|FOLDER")]
    more: Vec<PathBuf>,
    /// Number of recordings that are read at once; default: the number of processors. A single recording also
    /// gets a row of the table then
    #[arg(long, value_name = "NUMBER")]
    jobs: Option<NonZeroUsize>,
}

/// A command on several recordings.
pub(super) struct Batch<'a> {
    /// What the recordings must contain.
    pub(super) wanted: Wanted,
    /// Name of the vehicle in each row; `None` if the command finds it.
    pub(super) car: Option<&'a str>,
    /// Folder for the tables, which get a name for each recording.
    pub(super) tables: Option<&'a Path>,
    pub(super) as_json: bool,
    /// Reads the JSON of the command for one recording.
    pub(super) read: ReadResult,
}

impl SeveralArgs {
    /// Returns all recordings and folders if there are several recordings; `None` for a single one. Fails if
    /// one of them cannot be among several.
    pub(super) fn all(&self, first: Option<&Path>) -> Result<Option<Vec<PathBuf>>, Failure> {
        let Some(first) = first else { return Ok(None) };
        if self.more.is_empty() && self.jobs.is_none() && !search::is_archive(first) {
            return Ok(None);
        }
        let all: Vec<_> = std::iter::once(first).chain(self.more.iter().map(PathBuf::as_path)).collect();
        if all.iter().any(|path| standard_input::is_named(path)) {
            let reason = "standard input is one recording: give it alone";
            return Err(Failure::Usage(reason.to_owned()));
        }
        if let Some(config) =
            all.iter().find(|path| path.extension().is_some_and(|extension| extension == "toml"))
        {
            let config = config.display();
            return Err(Failure::Usage(format!(
                "{config}: expected a recording; {}",
                misuse::config_tip(&config)
            )));
        }
        Ok(Some(all.into_iter().map(Path::to_owned).collect()))
    }

    /// Runs a command on each of the recordings, and prints their results. Returns the worst exit code.
    pub(super) fn run(&self, given: Vec<PathBuf>, batch: &Batch<'_>) -> Result<ExitCode, Failure> {
        let arguments = Arguments::of_process()?;
        let jobs = self.jobs.or_else(|| std::thread::available_parallelism().ok());
        let jobs = jobs.map_or(1, NonZeroUsize::get);
        let first = given.first().cloned().unwrap_or_default();
        let mut search = Search::new(given, batch.wanted);
        let mut table = ResultTable::new(io::stdout().lock(), batch.as_json, messages::options().quiet);
        run_each(jobs, &mut search, |path| row(&arguments, batch, path), |row| table.add(&row))?;
        if search.skipped > 0 {
            let skipped = search.skipped;
            let files = if skipped == 1 { "file was" } else { "files were" };
            messages::note(&format!("{skipped} other {files} skipped, which are not recordings"));
        }
        if table.rows() == 0 {
            let error = io::Error::new(
                io::ErrorKind::InvalidData,
                can_log::NotRecording {
                    reason: "there is no recording in it".into(),
                    remedy: format!("these are read: {}", can_log::names().join(", ")),
                },
            );
            return Err(Failure::file(&first)(error));
        }
        Ok(ExitCode::from(table.finish()?))
    }
}

/// Runs the command for one recording.
fn row(arguments: &Arguments, batch: &Batch<'_>, recording: PathBuf) -> Row {
    let command = arguments.for_recording(&recording, batch.tables);
    let ended = worker::run(command);
    let found = ended.result.as_ref().and_then(|result| (batch.read)(result));
    let car = batch.car.map(str::to_owned);
    Row::new(recording, car, found, ended)
}

/// Calls `work` for each path in `jobs` threads, and `write` for each result in the order of the paths. Ends
/// with the first error of `write`.
fn run_each<T: Send>(
    jobs: usize,
    paths: &mut impl Iterator<Item = PathBuf>,
    work: impl Fn(PathBuf) -> T + Sync,
    mut write: impl FnMut(T) -> io::Result<()>,
) -> io::Result<()> {
    let (given, waiting): (Sender<(usize, PathBuf)>, Receiver<_>) = channel();
    let waiting = Mutex::new(waiting);
    let (done, results) = channel();
    let progress = ProgressDisplay::several("recordings");
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (done, waiting, work) = (done.clone(), &waiting, &work);
            let next = move || waiting.lock().unwrap_or_else(PoisonError::into_inner).recv();
            scope.spawn(move || {
                while let Ok((position, path)) = next() {
                    if done.send((position, work(path))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(done);
        // Dropped at the end, which ends the threads after the recordings that they have begun.
        let (given, results) = (given, results);
        let mut early: BTreeMap<usize, T> = BTreeMap::new();
        let (mut begun, mut written) = (0, 0);
        loop {
            while begun - written < jobs * AHEAD
                && let Some(path) = paths.next()
            {
                // The threads live as long as `given`.
                drop(given.send((begun, path)));
                begun += 1;
            }
            if begun == written {
                return Ok(());
            }
            let Ok((position, result)) = results.recv() else { return Ok(()) };
            early.insert(position, result);
            while let Some(result) = early.remove(&written) {
                write(result)?;
                written += 1;
                if let Some(progress) = &progress {
                    progress.set(written as u64);
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_recordings_whatever_process_ends_first() {
        let mut paths = (0..500).map(|number| PathBuf::from(number.to_string()));
        let mut written = Vec::new();
        let work = |path: PathBuf| path.display().to_string().parse::<u32>().unwrap();
        run_each(3, &mut paths, work, |number| {
            written.push(number);
            Ok(())
        })
        .unwrap();
        assert_eq!(written, (0..500).collect::<Vec<_>>());
    }

    #[test]
    fn no_more_recordings_are_begun_when_the_output_fails() {
        let begun = std::sync::atomic::AtomicUsize::new(0);
        let mut paths = std::iter::repeat_with(|| PathBuf::from("drive.log"));
        let work = |_| begun.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let closed = run_each(2, &mut paths, work, |_| Err(io::ErrorKind::BrokenPipe.into()));
        assert_eq!(closed.unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        assert!(begun.into_inner() <= 2 * AHEAD);
    }
}
