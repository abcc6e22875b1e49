//! `[black_box]`: recordings around faults.

use std::path::PathBuf;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;

/// `[black_box]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlackBoxFile {
    /// Where recordings go, relative to this file.
    pub folder: Option<Spanned<String>>,
    /// Time kept before a change to ERROR, s.
    pub before_s: Option<Spanned<u64>>,
    /// Time kept after it, s.
    pub after_s: Option<Spanned<u64>>,
    /// Recordings kept.
    pub keep: Option<Spanned<usize>>,
}

/// What is kept around a change to ERROR, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlackBoxConfig {
    /// Where recordings go; systemd's `STATE_DIRECTORY` when not given, nowhere without that.
    pub folder: Option<PathBuf>,
    /// Time before the change.
    pub before: Duration,
    /// Time after it.
    pub after: Duration,
    /// Recordings kept.
    pub keep: usize,
}

/// Checks the section.
pub(super) fn black_box(checker: &mut Checker<'_>, file: &BlackBoxFile) -> BlackBoxConfig {
    let mut seconds = |given: &Option<Spanned<u64>>, default: u64| {
        let time = checker.in_range(given.as_ref(), &(1..=300), "{} s cannot be kept", "give 1 to 300 s");
        Duration::from_secs(time.unwrap_or(default))
    };
    let (before, after) = (seconds(&file.before_s, 30), seconds(&file.after_s, 10));
    let reason = "{} recordings cannot be kept";
    let keep = checker.in_range(file.keep.as_ref(), &(1..=1000), reason, "give 1 to 1000");
    let folder = file.folder.as_ref().map(|folder| checker.beside(folder));
    BlackBoxConfig { folder, before, after, keep: keep.unwrap_or(20) }
}
