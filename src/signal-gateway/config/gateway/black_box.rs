//! `[black_box]`: recordings around faults.

use std::path::PathBuf;
use std::time::Duration;

use crate::config::reading::{Fields, key_rows, path, seconds, whole};

key_rows! {
    FOLDER: PathBuf = path("folder").example("\"black-box\"").restart()
        .doc("default: black-box in systemd's state directory; nothing without either");
    BEFORE_S: Duration = seconds("before_s", 1, 300).or(30).doc("time kept before the change");
    AFTER_S: Duration = seconds("after_s", 1, 300).or(10).doc("time kept after the change");
    KEEP: usize = whole("keep", 1, 1000, "recordings").or(20).doc("kept: the newest {range}; each has at most 100000 frames");
}

/// The recordings that are kept around a change to ERROR.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlackBoxConfig {
    /// Folder of the recordings; by default systemd's `STATE_DIRECTORY`, if it is set.
    pub folder: Option<PathBuf>,
    /// Recorded time before the change.
    pub before: Duration,
    /// Recorded time after the change.
    pub after: Duration,
    /// Number of recordings kept.
    pub keep: usize,
}

pub(super) fn black_box(fields: &Fields<'_>) -> BlackBoxConfig {
    BlackBoxConfig {
        folder: fields.given(&FOLDER),
        before: fields.read(&BEFORE_S),
        after: fields.read(&AFTER_S),
        keep: fields.read(&KEEP),
    }
}
