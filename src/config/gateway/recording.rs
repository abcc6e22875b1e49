//! `[recording]`: which recording to play, and how.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;

/// `[recording]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingFile {
    /// Recording in any known format, plain or gzip, relative to this file.
    pub file: Spanned<String>,
    /// Factor on the original timing.
    pub speed: Option<Spanned<f64>>,
    /// Start again at the end.
    #[serde(default)]
    pub repeat: bool,
    /// Which time goes into message stamps.
    #[serde(default)]
    pub stamps: Stamps,
}

/// `stamps = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stamps {
    /// Those of the recording.
    #[default]
    Recorded,
    /// Moved by a constant so that playback starts now.
    Now,
}

/// Which recording to play, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Recording in any known format, plain or gzip.
    pub file: PathBuf,
    /// Factor on the original timing.
    pub speed: f64,
    /// Start again at the end.
    pub repeat: bool,
    /// Which time goes into stamps while it plays in real time.
    pub stamps: Stamps,
}

/// Checks the section.
pub(super) fn recording(checker: &mut Checker<'_>, file: &RecordingFile) -> Recording {
    let remedy = "give 0.01 to 1000 (1 = original)";
    let speed = checker.in_range(file.speed.as_ref(), &(0.01..=1000.0), "invalid speed {}", remedy);
    Recording {
        file: checker.beside(&file.file),
        speed: speed.unwrap_or(1.0),
        repeat: file.repeat,
        stamps: file.stamps,
    }
}
