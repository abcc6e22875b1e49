//! `[mcap]`: the recording of all that is received and published.

use std::path::PathBuf;
use std::time::Duration;

use crate::config::reading::{Fields, key_rows, path, seconds, whole};

key_rows! {
    FOLDER: PathBuf = path("folder").example("\"bags\"").restart().doc("nothing without it; `run --record DIR` replaces it");
    FILE_MB: u64 = whole("file_mb", 1, 1_000_000, "MB").or(256).restart().doc("a new file from this size on");
    FILE_S: Duration = seconds("file_s", 1, 86_400).or(600).restart().doc("a new file from this time on");
    TOTAL_MB: u64 = whole("total_mb", 1, 1_000_000, "MB").or(4096).restart()
        .doc("size of the folder, {range}; the oldest recordings are removed");
}

const MEGABYTE: u64 = 1_000_000;

/// Settings of the MCAP recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct McapConfig {
    /// Folder of the bags; `None` records nothing.
    pub folder: Option<PathBuf>,
    /// Size at which a new file is begun, bytes.
    pub file_bytes: u64,
    /// Duration at which a new file is begun.
    pub file_duration: Duration,
    /// Size of all recordings in the folder, bytes.
    pub total_bytes: u64,
}

pub(super) fn mcap(fields: &Fields<'_>) -> McapConfig {
    McapConfig {
        file_duration: fields.read(&FILE_S),
        folder: fields.given(&FOLDER),
        file_bytes: fields.read(&FILE_MB).saturating_mul(MEGABYTE),
        total_bytes: fields.read(&TOTAL_MB).saturating_mul(MEGABYTE),
    }
}
