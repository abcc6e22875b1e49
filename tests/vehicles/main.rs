//! What the shipped vehicle profiles make of real recordings, of silences, of frames written by
//! hand and of the demo recording.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod demo;
mod payload;
mod playback;
mod profiles;
mod real_dbcs;
mod real_logs;
mod seal;
mod silences;
mod simulated;
mod v2x_unit;

use std::path::{Path, PathBuf};

use signal_gateway::config::files::Disk;
use signal_gateway::config::{Settings, load_profile};

/// The project's own files.
fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A shipped profile by file name, its buses on can0, can1…
fn profile(name: &str) -> Settings {
    let path = project().join("config/vehicles").join(format!("{name}.toml"));
    load_profile(&Disk, &path).unwrap_or_else(|refused| panic!("{refused}"))
}

/// Names of all shipped profiles.
fn profile_names() -> Vec<String> {
    let folder = std::fs::read_dir(project().join("config/vehicles")).unwrap();
    let mut names: Vec<_> = folder
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// The folder of files from real vehicles, unless it is not here: then says so.
fn real_files(test: &str) -> Option<PathBuf> {
    let given = std::env::var_os("SIGNAL_GATEWAY_SHARED").map(PathBuf::from);
    let shared = given.unwrap_or_else(|| project().join("../shared"));
    let folder = shared.join("data");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: {test}: ../shared is absent");
    None
}
