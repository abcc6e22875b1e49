//! Within a room, files import each other in one direction: who reads a file needs to know only those
//! below it. A file and its own private children, which it names without `self`, are read together.

use std::collections::{BTreeMap, BTreeSet};

use super::{Mention, Source, sources_below};

type Module = Vec<String>;

/// Rooms in which no file imports another one that imports it; those of `config` have a test of their own.
#[rustfmt::skip]
const ROOMS: &[&str] = &[
    "can-log", "can-signal", "gateway-base", "gateway-core", "lanelet2-map", "ros-transport", "signal-gateway/check",
    "signal-gateway/cli",
    "signal-gateway/daemon", "signal-gateway/desk", "signal-gateway/io", "signal-gateway/process_status",
    "signal-gateway/replay", "signal-gateway/report", "traffic-lights", "turn-signal", "vehicle-bringup",
];

#[test]
fn no_files_of_a_room_import_each_other_in_a_circle() {
    for room in ROOMS {
        let sources = sources_below(&format!("src/{room}"));
        let tests: Vec<_> = sources.iter().flat_map(|source| &source.test_modules).collect();
        let is_test = |module: &Module| tests.iter().any(|test| module.starts_with(test.as_slice()));
        let sources: Vec<_> = sources.into_iter().filter(|source| !is_test(&source.module)).collect();
        let modules: BTreeSet<_> = sources.iter().map(|source| source.module.clone()).collect();
        let imports = sources.iter().map(|source| (source.module.clone(), imports_of(source, &modules)));
        let circles: Vec<_> = in_circles(imports.collect()).iter().map(|module| module.join("::")).collect();
        assert!(sources.len() > 2, "the sources of {room} were not found");
        assert!(circles.is_empty(), "these import each other in a circle:\n{}", circles.join("\n"));
    }
}

/// The files that a file imports.
fn imports_of(source: &Source, modules: &BTreeSet<Module>) -> BTreeSet<Module> {
    let targets = source.mentions.iter().filter_map(Mention::target);
    let files = targets.filter_map(|mut target| {
        while !modules.contains(&target) {
            target.pop()?;
        }
        Some(target)
    });
    files.filter(|file| *file != source.module).collect()
}

/// What is left when everything is taken away that imports nothing, or that nothing imports.
fn in_circles<T: Ord + Clone>(mut imports: BTreeMap<T, BTreeSet<T>>) -> BTreeSet<T> {
    loop {
        let before = imports.len();
        let imported: BTreeSet<T> = imports.values().flatten().cloned().collect();
        imports.retain(|file, targets| !targets.is_empty() && imported.contains(file));
        let left: BTreeSet<T> = imports.keys().cloned().collect();
        for targets in imports.values_mut() {
            targets.retain(|target| left.contains(target));
        }
        if imports.len() == before {
            return left;
        }
    }
}

#[test]
fn circles_are_found_and_what_hangs_on_them_is_not() {
    let graph = |edges: &[(char, &str)]| {
        edges.iter().map(|(file, targets)| (*file, targets.chars().collect())).collect()
    };
    assert_eq!(in_circles(graph(&[('a', "bc"), ('b', "c"), ('c', "")])), BTreeSet::new());
    let two = graph(&[('a', "b"), ('b', "cd"), ('c', "b"), ('d', "e"), ('e', "")]);
    assert_eq!(in_circles(two), BTreeSet::from(['b', 'c']));
    let three = graph(&[('a', "b"), ('b', "c"), ('c', "a")]);
    assert_eq!(in_circles(three), BTreeSet::from(['a', 'b', 'c']));
}
