//! `[recording]`: the recording that is played.

use std::path::PathBuf;

use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;

/// The time that goes into message stamps while a recording is played in real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stamps {
    /// The time of the recording.
    Recorded,
    /// The present time, at which the recording is played.
    #[default]
    Now,
}

const STAMPS: Keywords<Stamps> = &[("recorded", Stamps::Recorded), ("now", Stamps::Now)];

/// The recording that is played.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Recording in any known format, plain or compressed.
    pub file: PathBuf,
    /// Factor on the original timing.
    pub speed: f64,
    /// True if playback starts again at the end.
    pub repeat: bool,
    /// Time that goes into message stamps.
    pub stamps: Stamps,
}

/// Reads the section; `None` when it names no file.
pub(super) fn recording(fields: Fields<'_>) -> Option<Recording> {
    fields.require(&["file"], "");
    let file = fields.path("file");
    let speed = fields.number("speed", 0.01..=1000.0, "").unwrap_or(1.0);
    let repeat = fields.flag("repeat").unwrap_or_default();
    let stamps = fields.keyword("stamps", STAMPS).unwrap_or_default();
    fields.done();
    Some(Recording { file: file?, speed, repeat, stamps })
}
