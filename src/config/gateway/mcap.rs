//! `[mcap]`: the recording of all that is received and published.

use std::path::PathBuf;
use std::time::Duration;

use crate::config::reading::fields::Fields;

/// The recording of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct McapConfig {
    /// Folder of the bags; `None` records nothing.
    pub folder: Option<PathBuf>,
    /// Size of a file from which the next one is begun, bytes.
    pub file_bytes: u64,
    /// Time of a file from which the next one is begun.
    pub file_duration: Duration,
    /// Size of all recordings in the folder, bytes.
    pub total_bytes: u64,
}

/// Reads the section; what is absent has its default.
pub(super) fn mcap(fields: Fields<'_>) -> McapConfig {
    let megabytes = |key, default: u64| {
        fields.number(key, 1..=1_000_000, "MB").unwrap_or(default).saturating_mul(1_000_000)
    };
    let seconds = fields.number("file_s", 1..=86_400, "s").unwrap_or(600);
    let config = McapConfig {
        folder: fields.path("folder"),
        file_bytes: megabytes("file_mb", 256),
        file_duration: Duration::from_secs(seconds),
        total_bytes: megabytes("total_mb", 4_096),
    };
    fields.done();
    config
}
