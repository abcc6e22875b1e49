//! `[recording]`: the recording that is played.

use std::path::PathBuf;

use crate::config::reading::{Fields, Keywords, flag, key_rows, keyword, number, path};

key_rows! {
    FILE: PathBuf = path("file").example("\"drive.log.gz\"").restart().doc("the recording, plain or compressed");
    SPEED: f64 = number("speed", 0.01, 1000.0, "").or_number(1.0).doc("factor on the original timing in `run` and `demo`");
    REPEAT: bool = flag("repeat", false).doc("start again at the end");
    STAMPS: Stamps = keyword("stamps", STAMP_TIMES).or_text("now")
        .doc("message stamps: \"now\", or \"recorded\": stale to Autoware, whose monitors compare them with the present");
}

/// Time used for message stamps while a recording is played in real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stamps {
    /// The time of the recording.
    Recorded,
    /// The current time, at which the recording is played.
    #[default]
    Now,
}

const STAMP_TIMES: Keywords<Stamps> = &[("recorded", Stamps::Recorded), ("now", Stamps::Now)];

/// The recording that is played.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Recording in any known format, plain or compressed.
    pub file: PathBuf,
    /// Speed relative to the original timing.
    pub speed: f64,
    /// True if playback starts again at the end.
    pub repeat: bool,
    /// Time used for message stamps.
    pub stamps: Stamps,
}

/// Reads the section; returns `None` if it names no file.
pub(super) fn recording(fields: &Fields<'_>) -> Option<Recording> {
    fields.require(&["file"], "");
    let file = fields.given(&FILE);
    let (speed, repeat, stamps) = (fields.read(&SPEED), fields.read(&REPEAT), fields.read(&STAMPS));
    // A recording in progress keeps its initial settings.
    fields.checker.keep_recorded(|key| key.section != "recording" || key.row.name() == FILE.name);
    Some(Recording { file: file?, speed, repeat, stamps })
}
