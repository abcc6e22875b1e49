//! The rooms of `config`: imports run downhill between them, and no two files import each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::Source;
use crate::support::sources::files_of_kind;

/// Rooms of `config`, top to bottom; a file imports from its own room and from those below.
const ROOMS_OF_CONFIG: &[&[&str]] = &[
    &["gateway"],
    &["draft", "drive", "scenario", "vehicle"],
    &["decider"],
    &["country", "dimensions", "map", "ros_parameters"],
    &["named_file"],
    &["file_kind"],
    &["fingerprints"],
    &["files", "reading"],
    &["built_in", "ros_names"],
];

#[test]
fn rooms_of_config_import_downhill_and_none_of_its_files_import_each_other() {
    let sources: Vec<_> =
        files_of_kind("src/signal-gateway/config", "rs").iter().map(|path| Source::read(path)).collect();
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
    assert_eq!(circle(&sources), Vec::<String>::new(), "these files import each other");
}

/// Modules by the modules among them that they import.
fn imports(sources: &[Source]) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let modules: BTreeSet<_> = sources.iter().map(|source| source.module.clone()).collect();
    let imported = |source: &Source| {
        let targets = source.mentions.iter().map(|mention| {
            let below = || [mention.inside.clone(), mention.path.clone()].concat();
            mention.target().unwrap_or_else(below)
        });
        let files = targets.filter_map(|target| {
            let prefixes = (1..=target.len()).rev().map(|length| target[..length].to_vec());
            prefixes.into_iter().find(|prefix| modules.contains(prefix))
        });
        files.filter(|file| *file != source.module).collect()
    };
    sources.iter().map(|source| (source.module.clone(), imported(source))).collect()
}

/// The modules that are in a circle of imports, or import one that is.
fn circle(sources: &[Source]) -> Vec<String> {
    let mut open = imports(sources);
    let is_free = |open: &BTreeMap<Vec<String>, BTreeSet<_>>, imported: &BTreeSet<Vec<String>>| {
        imported.iter().all(|module| !open.contains_key(module))
    };
    while let Some(free) = open.iter().find(|(_, imported)| is_free(&open, imported)) {
        let free = free.0.clone();
        open.remove(&free);
    }
    open.keys().map(|module| module.join("::")).collect()
}

fn room_of_config(room: &str) -> Option<usize> {
    ROOMS_OF_CONFIG.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn finds_files_that_import_each_other() {
    let source = |(path, text): (&str, &str)| Source::parse(Path::new(path), text);
    let parent = [("src/x/a/mod.rs", "mod b; use b::B; struct A;"), ("src/x/a/b.rs", "use super::A;")];
    assert_eq!(circle(&parent.map(source)), ["x::a", "x::a::b"]);
    let twins = [("src/x/a/b.rs", "use super::c::C;"), ("src/x/a/c.rs", "use crate::a::b::B;")];
    assert_eq!(circle(&twins.map(source)), ["x::a::b", "x::a::c"]);
    let downhill = [("src/x/a/mod.rs", "mod b; use b::B;"), ("src/x/a/b.rs", "use super::super::io::A;")];
    assert_eq!(circle(&downhill.map(source)), Vec::<String>::new());
}
