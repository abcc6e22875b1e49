//! The top of the file: the vehicle profile, and the origin of frames.

use crate::config::reading::{Keywords, key_rows, keyword, text};

/// The origin of frames in `run`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SourceKind {
    /// Frames come from the configured interfaces.
    #[default]
    Socketcan,
    /// Frames come from the configured recording.
    Recording,
}

const SOURCES: Keywords<SourceKind> =
    &[("socketcan", SourceKind::Socketcan), ("recording", SourceKind::Recording)];

key_rows! {
    PROFILE: String = text("profile").example("\"vehicles/hyundai_kia.toml\"").doc("The vehicle profile: which DBC signals mean what. See the end of config/gateway.toml for its keys.
A path relative to this file, or a name of `signal-gateway profiles list`; a file wins. Maps, drives and scenarios
of the project have names as well. Instead of a path the profile can stand here as [vehicle], [vehicle.turn] and so on.");
    SOURCE: SourceKind = keyword("source", SOURCES).or_text("socketcan").restart()
        .doc("where `run` takes frames from: \"socketcan\" (the interfaces of [can]) or \"recording\"");
}
