//! Status of the log on standard error, and the number of its lost lines.

use ros_transport::link::LostLines;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue::{self, LOG};
use gateway_base::diagnostics::Status;

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

impl LogState {
    /// Returns the lines that this process could not write.
    pub fn lost_lines(&self) -> LostLines {
        LostLines { suppressed: self.suppressed, dropped: self.dropped }
    }

    /// Returns the state with the lost lines of another process added.
    #[must_use]
    pub fn with(self, other: LostLines) -> Self {
        let LostLines { suppressed, dropped } = self.lost_lines().plus(other);
        Self { suppressed, dropped, ..self }
    }

    /// Returns the status of the log.
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
