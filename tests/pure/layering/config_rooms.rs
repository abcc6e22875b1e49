//! The rooms of `config`: imports run downhill between them.

use super::circles::imports;
use super::sources_below;

/// Rooms of `config`, top to bottom; a file imports from its own room and from those below.
const ROOMS_OF_CONFIG: &[&[&str]] = &[
    &["gateway"],
    &["draft", "drive", "scenario", "vehicle"],
    &["decider"],
    &["car_models", "country", "dimensions", "map", "ros_parameters"],
    &["named_file"],
    &["file_kind"],
    &["fingerprints"],
    &["files", "reading"],
    &["built_in", "ros_names"],
];

#[test]
fn rooms_of_config_import_downhill() {
    let sources = sources_below("src/signal-gateway/config");
    assert!(sources.len() > 10, "the sources were not found");
    let mut breaches = Vec::new();
    for (file, imported) in
        imports(&sources).iter().flat_map(|(file, all)| all.iter().map(move |it| (file, it)))
    {
        let [own, other] = [file, imported].map(|module| module.get(2).map(|room| room_of_config(room)));
        if file.get(2) != imported.get(2) && own.is_some() && other.is_none_or(|other| other <= own.flatten())
        {
            breaches.push(format!("{}: must not import {}", file.join("::"), imported.join("::")));
        }
    }
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

fn room_of_config(room: &str) -> Option<usize> {
    ROOMS_OF_CONFIG.iter().position(|rooms| rooms.contains(&room))
}
