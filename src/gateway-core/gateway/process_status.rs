//! Statuses of the process itself, which no input tells the gateway of: its configuration, its black-box
//! files, its recording and its log.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue::{self, BLACK_BOX, CONFIGURATION, LOG, MCAP};
use super::configuration::{ConfigurationState, changes_text};
use gateway_base::diagnostics::Status;

/// Tasks of the statuses of the process itself, which the daemon adds to those of the gateway. A replay has
/// none of them.
pub const PROCESS_TASKS: [&str; 5] = ["black_box", "configuration", "mcap", "log", "ros"];

/// State of the black-box files.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct RecorderState {
    /// Folder of the recordings.
    pub folder: String,
    /// File name of the newest recording in the folder; `None` while there is none.
    pub newest: Option<String>,
    /// Number of recordings in the folder.
    pub recordings: usize,
    /// Number of recordings written since start.
    pub written: u64,
    /// Number of failed attempts to write since start; each lost a recording or found the folder unusable.
    pub failures: u64,
    /// Reason of the last failure.
    pub last_error: Option<String>,
    /// True if the last attempt failed.
    pub is_failing: bool,
}

impl RecorderState {
    /// The status of the recordings. It is never an ERROR, which would ask for another recording.
    pub fn status(&self) -> Status {
        let last_error = self.last_error.as_deref().unwrap_or("none");
        let message = if self.is_failing { catalogue::not_written(last_error) } else { catalogue::ready() };
        let values = vec![
            ("folder", self.folder.clone()),
            ("newest", self.newest.clone().unwrap_or_else(|| "none".to_owned())),
            ("recordings", self.recordings.to_string()),
            ("written", self.written.to_string()),
            ("failures", self.failures.to_string()),
            ("last_error", last_error.to_owned()),
        ];
        Status::new(&BLACK_BOX, "black_box", &[message], values)
    }
}

impl ConfigurationState {
    /// The status of the configuration.
    pub fn status(&self) -> Status {
        let reason = self.last_reload.as_ref().and_then(|reload| reload.reason.as_deref());
        let first = reason.and_then(|reason| reason.lines().next());
        let message = match (first, &self.last_reload) {
            (Some(first), _) => catalogue::refused(first),
            (None, Some(_)) => catalogue::reloaded(),
            (None, None) => catalogue::as_at_start(),
        };
        let changes = self.last_reload.as_ref().map_or(&[][..], |reload| &reload.changes);
        let text = if changes.is_empty() { "none".to_owned() } else { changes_text(changes) };
        let values = vec![
            ("reloads", self.reloads.to_string()),
            ("refused_reloads", self.refused.to_string()),
            ("last_changes", text),
            ("last_error", reason.unwrap_or("none").to_owned()),
        ];
        Status::new(&CONFIGURATION, "configuration", &[message], values)
    }
}

/// State of the MCAP recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct McapState {
    /// Folder of the bags.
    pub folder: String,
    /// Name of the bag being written; `None` before the first was begun.
    pub bag: Option<String>,
    /// Number of its files.
    pub files: usize,
    /// Size of all bags in the folder, bytes.
    pub bytes: u64,
    /// Number of messages recorded since start.
    pub messages: u64,
    /// Number of messages lost since start, because the disk was full or too slow.
    pub lost: u64,
    /// Number of failed attempts to write since start.
    pub failures: u64,
    /// Reason of the last failure.
    pub last_error: Option<String>,
    /// True if the last attempt failed.
    pub is_failing: bool,
}

impl McapState {
    /// The status of the recording.
    pub fn status(&self) -> Status {
        let last_error = self.last_error.as_deref().unwrap_or("none");
        let message =
            if self.is_failing { catalogue::recording_failed(last_error) } else { catalogue::recording() };
        let values = vec![
            ("folder", self.folder.clone()),
            ("bag", self.bag.clone().unwrap_or_else(|| "none".to_owned())),
            ("files", self.files.to_string()),
            ("bytes", self.bytes.to_string()),
            ("messages", self.messages.to_string()),
            ("lost", self.lost.to_string()),
            ("failures", self.failures.to_string()),
            ("last_error", last_error.to_owned()),
        ];
        Status::new(&MCAP, "mcap", &[message], values)
    }
}

/// State of the log on standard error.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct LogState {
    /// Number of lines left out since start because their kind came too often.
    pub suppressed: u64,
    /// Number of lines lost since start because standard error did not take them.
    pub dropped: u64,
    /// Reason of the last loss.
    pub last_error: Option<String>,
    /// True if a line was lost since standard error last took one.
    pub is_failing: bool,
}

/// Number of log lines that were not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LostLines {
    /// Lines left out because their kind came too often.
    pub suppressed: u64,
    /// Lines lost because standard error did not take them.
    pub dropped: u64,
}

impl LostLines {
    /// The sum of two numbers of lines.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            suppressed: self.suppressed.saturating_add(other.suppressed),
            dropped: self.dropped.saturating_add(other.dropped),
        }
    }
}

impl LogState {
    /// The lines of this process that were not written.
    pub fn lost_lines(&self) -> LostLines {
        LostLines { suppressed: self.suppressed, dropped: self.dropped }
    }

    /// The state with the lost lines of another process added.
    #[must_use]
    pub fn with(self, other: LostLines) -> Self {
        let LostLines { suppressed, dropped } = self.lost_lines().plus(other);
        Self { suppressed, dropped, ..self }
    }

    /// The status of the log.
    pub fn status(&self) -> Status {
        let last_error = self.last_error.as_deref().unwrap_or("none");
        let message = if self.is_failing { catalogue::lines_lost(last_error) } else { catalogue::written() };
        let values = vec![
            ("suppressed_lines", self.suppressed.to_string()),
            ("dropped_lines", self.dropped.to_string()),
            ("last_error", last_error.to_owned()),
        ];
        Status::new(&LOG, "log", &[message], values)
    }
}
