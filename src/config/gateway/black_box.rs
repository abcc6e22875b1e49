//! `[black_box]`: recordings around faults.

use std::path::PathBuf;
use std::time::Duration;

use crate::config::reading::fields::Fields;

/// The recordings that are kept around a change to ERROR.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlackBoxConfig {
    /// Folder of the recordings; by default systemd's `STATE_DIRECTORY`, and none without that.
    pub folder: Option<PathBuf>,
    /// Time kept before the change.
    pub before: Duration,
    /// Time kept after the change.
    pub after: Duration,
    /// Number of recordings kept.
    pub keep: usize,
}

/// Reads the section; what is absent has its default.
pub(super) fn black_box(fields: Fields<'_>) -> BlackBoxConfig {
    let seconds = |key, default| Duration::from_secs(fields.number(key, 1..=300, "s").unwrap_or(default));
    let config = BlackBoxConfig {
        folder: fields.path("folder"),
        before: seconds("before_s", 30),
        after: seconds("after_s", 10),
        keep: fields.number("keep", 1..=1000, "recordings").unwrap_or(20),
    };
    fields.done();
    config
}
