//! The shipped vehicle profiles on real recordings, silences, frames written by hand and the demo
//! recording.

mod demo;
mod document;
mod models;
mod opendbc;
pub(crate) mod payload;
mod platforms;
pub(crate) mod playback;
mod profiles;
mod protection;
mod real_dbcs;
mod real_logs;
mod recognition;
mod silences;
mod simulated;
mod status;
mod v2x_unit;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use signal_gateway::config::files::Disk;
use signal_gateway::config::{Settings, load_profile};

/// The project's own files.
fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A shipped profile by file name, its buses on can0, can1…; each is read once.
pub(crate) fn profile(name: &str) -> &'static Settings {
    static READ: Mutex<BTreeMap<String, &'static Settings>> = Mutex::new(BTreeMap::new());
    if let Some(settings) = READ.lock().unwrap().get(name) {
        return settings;
    }
    let settings = read_profile(name);
    READ.lock().unwrap().entry(name.to_owned()).or_insert_with(|| Box::leak(Box::new(settings)))
}

/// As [`profile`], read again so that it can be changed.
pub(crate) fn read_profile(name: &str) -> Settings {
    let path = project().join("config/vehicles").join(format!("{name}.toml"));
    load_profile(&Disk, &path).unwrap_or_else(|refused| panic!("{refused}"))
}

/// Names of all shipped profiles.
pub(crate) fn profile_names() -> Vec<String> {
    let folder = std::fs::read_dir(project().join("config/vehicles")).unwrap();
    let mut names: Vec<_> = folder
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
