//! Configurations that must be refused, each with the whole text: position, key, reason and remedy.
//! Most are cases in `tests/cases/config`.

mod garbled;
mod reference;
mod turn_signal;
mod v2i;

use std::path::Path;

use signal_gateway::config::files::Disk;
use signal_gateway::config::{Overrides, Problem, Settings, load, load_profile};

use can_signal::dbc::model::MAX_ENTRIES;

use crate::support::cases;
use crate::support::files::MemoryFiles;

/// A configuration that is accepted; each test changes something.
fn sound() -> MemoryFiles {
    MemoryFiles::of_folder(&cases::folder("config/sound"))
}

/// The sound configuration with these lines in a file, where they need no particular place.
fn with(file: &str, lines: &str) -> MemoryFiles {
    let files = sound();
    let text = files.text(file).replacen("# here\n", lines, 1);
    files.with(file, text)
}

fn load_texts(texts: &MemoryFiles) -> Result<Settings, Vec<Problem>> {
    load(texts, Path::new("gateway.toml"), &Overrides::default()).map_err(|refused| refused.0)
}

#[test]
fn the_sound_configuration_is_accepted() {
    let settings = load_texts(&sound()).unwrap_or_else(|problems| panic!("{problems:?}"));
    assert_eq!(settings.vehicle, "Car");
    assert_eq!(settings.dbcs[0].database.rejected(), 2);
}

#[test]
fn broken_configurations_are_refused_where_they_break() {
    cases::check("config", &sound(), |case| match load_texts(&case.files) {
        Ok(_) => "accepted".to_owned(),
        Err(problems) => problems.iter().map(|problem| format!("{problem}\n")).collect(),
    });
}

#[test]
fn a_file_that_is_not_utf8_is_refused_at_its_first_bad_byte() {
    for file in ["gateway.toml", "car.toml"] {
        let mut texts = sound();
        let mut bytes = b"# caf\xE9\n".to_vec();
        bytes.extend(texts.text(file).as_bytes());
        texts.insert(file, bytes);
        let problems: Vec<_> = load_texts(&texts).unwrap_err().iter().map(ToString::to_string).collect();
        assert_eq!(problems, [format!("{file}:1:6: this is not UTF-8; save the file as UTF-8")]);
    }
}

#[test]
fn a_dbc_with_too_many_entries_is_refused() {
    let mut texts = sound();
    let dbc = format!("{}{}", texts.text("car.dbc"), "x\n".repeat(MAX_ENTRIES));
    texts.insert("car.dbc", dbc.into_bytes());
    let problems: Vec<_> = load_texts(&texts).unwrap_err().iter().map(ToString::to_string).collect();
    let reason = "car.dbc: more than 250000 messages, signals, names of values and malformed statements";
    assert!(problems[0].contains(reason), "{problems:?}");
}

#[test]
fn a_missing_configuration_is_refused_with_its_path_and_the_option() {
    let refused = load(&Disk, Path::new("nowhere/gateway.toml"), &Overrides::default()).unwrap_err();
    let text = refused.to_string();
    assert!(text.starts_with("nowhere/gateway.toml: there is no such file"), "{text}");
    assert!(text.contains("--config FILE"), "{text}");
    let refused = load_profile(&Disk, Path::new("nowhere/car.toml")).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("nowhere/car.toml: there is no such file"), "{text}");
    assert!(!text.contains("--config"), "{text}");
}
