//! Statuses of the recordings on disk: black-box files, and the MCAP recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue::{self, BLACK_BOX, MCAP};
use gateway_base::diagnostics::Status;

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
    /// Returns the status of the recordings. It is never an ERROR, which would trigger another recording.
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

/// State of the MCAP recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct McapState {
    /// Folder of the bags.
    pub folder: String,
    /// Name of the bag being written; `None` before the first.
    pub bag: Option<String>,
    /// Number of files in this bag.
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
    /// Returns the status of the recording.
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
