//! `--csv`: the file or standard output for a table, and its summary.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Component, Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::arguments::number;
use super::failure::Failure;
use crate::report::joined;
use crate::report::table::{Rows, TableSummary};
use can_log::standard_input;

#[derive(Debug, Clone, Args)]
pub(super) struct CsvArgs {
    /// Write a table instead: a row for each change, a column for each state with its unit, and an empty cell
    /// where a value is unknown; - for standard output, a folder for FOLDER/LOG.csv
    #[arg(long, value_name = "FILE.csv|FOLDER", value_parser = csv_path)]
    pub(super) csv: Option<PathBuf>,
    /// Write HZ rows of the table a second instead of a row for each change
    #[arg(long, value_name = "HZ", requires = "csv", value_parser = rate)]
    rate: Option<f64>,
}

/// Accepts `-`, a name that ends in .csv, and the name of a folder, so that a recording is not overwritten by
/// mistake.
fn csv_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_table = standard_input::is_named(&path) || is_csv(&path);
    if is_table || path.is_dir() || path.extension().is_none() {
        return Ok(path);
    }
    Err("expected a name that ends in .csv, - for standard output, or a folder".to_owned())
}

fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) && !path.is_dir()
}

fn rate(text: &str) -> Result<f64, String> {
    number(text, "rows a second", 0.001..=1000.0)
}

/// Destination of a table.
pub(super) enum CsvFile {
    StandardOutput,
    File(PathBuf),
}

impl CsvArgs {
    pub(super) fn rows(&self) -> Rows {
        self.rate.map_or(Rows::Changes, Rows::Rate)
    }

    /// Returns the folder for the tables of several recordings; `None` for a single file.
    pub(super) fn folder(&self) -> Option<&Path> {
        self.csv.as_deref().filter(|path| !standard_input::is_named(path) && !is_csv(path))
    }

    /// Returns the destination for the table of a recording; `None` without `--csv`. Refuses the recording
    /// itself.
    pub(super) fn file(&self, recording: &Path) -> Result<Option<CsvFile>, Failure> {
        let Some(path) = &self.csv else { return Ok(None) };
        if standard_input::is_named(path) {
            return Ok(Some(CsvFile::StandardOutput));
        }
        let path = if is_csv(path) { path.clone() } else { path_in(path, recording) };
        let identity = |path: &Path| fs::metadata(path).ok().map(|found| (found.dev(), found.ino()));
        if identity(&path).is_some_and(|file| identity(recording) == Some(file)) {
            let path = path.display();
            return Err(Failure::Usage(format!("--csv {path}: this is the recording; give another name")));
        }
        Ok(Some(CsvFile::File(path)))
    }
}

/// Returns the path of the table of a recording in a folder: the path of the recording, with `.csv` added.
pub(super) fn path_in(folder: &Path, recording: &Path) -> PathBuf {
    let leads_up = recording.components().any(|part| part == Component::ParentDir);
    let whole = fs::canonicalize(recording).ok().filter(|_| leads_up);
    let recording = whole.as_deref().unwrap_or(recording);
    let parts = recording.components().filter(|part| matches!(part, Component::Normal(_)));
    let mut path = folder.join(parts.collect::<PathBuf>()).into_os_string();
    path.push(".csv");
    path.into()
}

impl CsvFile {
    /// Converts an error of writing the table.
    pub(super) fn failure(&self, error: io::Error) -> Failure {
        match self {
            Self::StandardOutput => error.into(),
            Self::File(path) => Failure::written(path)(error),
        }
    }

    /// Creates the file, with the folders above it.
    pub(super) fn create(&self) -> Result<Box<dyn Write>, Failure> {
        let Self::File(path) = self else { return Ok(Box::new(io::stdout())) };
        let create = || {
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder)?;
            }
            File::create(path)
        };
        Ok(Box::new(create().map_err(Failure::written(path))?))
    }

    /// Prints the size of the written table, unless the table is on standard output.
    pub(super) fn conclude(&self, summary: io::Result<TableSummary>, as_json: bool) -> Result<(), Failure> {
        let summary = summary.map_err(|error| self.failure(error))?;
        let Self::File(path) = self else { return Ok(()) };
        let mut out = io::stdout().lock();
        let path = path.display().to_string();
        if as_json {
            let summary = serde_json::to_value(&summary).map_err(io::Error::from)?;
            writeln!(out, "{}", joined(json!({ "csv": path }), summary))?;
        } else {
            writeln!(out, "{path}: {}", summary.text())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_name_that_no_recording_has() {
        for name in ["-", "drive.csv", "DRIVE.CSV", "tables"] {
            assert_eq!(csv_path(name), Ok(PathBuf::from(name)));
        }
        for name in ["drive.log", "drive.csv.gz"] {
            assert!(csv_path(name).is_err(), "{name}");
        }
    }

    #[test]
    fn tables_in_a_folder_have_the_paths_of_their_recordings() {
        let path = |recording| path_in(Path::new("out"), Path::new(recording));
        assert_eq!(path("day/drive.log.gz"), Path::new("out/day/drive.log.gz.csv"));
        assert_eq!(path("/day/./drive.log"), Path::new("out/day/drive.log.csv"));
        let above = path_in(Path::new("out"), Path::new("../"));
        assert!(above.components().all(|part| part != Component::ParentDir), "{above:?}");
    }
}
