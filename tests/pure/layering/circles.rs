//! Within a crate, files import each other in one direction: who reads a file needs to know only those below
//! it. That holds for a parent and its children too: what both need is in a file of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::{OURS, SOURCES, Source, test_files};

pub(super) type Module = Vec<String>;

#[test]
fn no_files_import_each_other_in_a_circle() {
    let test_files = test_files();
    let sources = SOURCES.iter().filter(|source| source.path.starts_with("src"));
    let sources: Vec<_> = sources.filter(|source| !test_files.contains(&source.path)).collect();
    for package in OURS.keys() {
        let found = sources.iter().filter(|source| source.module.first() == Some(package)).count();
        assert!(found > 2, "the sources of {package} were not found");
    }
    assert_eq!(in_circles(&imports(&sources)), Vec::<String>::new(), "these files import each other");
}

/// Modules by the modules among them that they import.
pub(super) fn imports(sources: &[&Source]) -> BTreeMap<Module, BTreeSet<Module>> {
    let modules: BTreeSet<_> = sources.iter().map(|source| &source.module).collect();
    let imported = |source: &Source| {
        let targets = source.mentions.iter().filter_map(|mention| {
            // A path that begins with a child of the module; one segment alone is a variable more often.
            let below = || (mention.path.len() > 1).then(|| [&*mention.inside, &*mention.path].concat());
            mention.target().or_else(below)
        });
        let files = targets.filter_map(|target| {
            let prefixes = (1..=target.len()).rev().map(|length| target[..length].to_vec());
            prefixes.into_iter().find(|prefix| modules.contains(prefix))
        });
        files.filter(|file| *file != source.module).collect()
    };
    let mut all = BTreeMap::<_, BTreeSet<_>>::new();
    for source in sources {
        all.entry(source.module.clone()).or_default().append(&mut imported(source));
    }
    all
}

/// The modules that import themselves, through whatever others.
fn in_circles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    let imports_itself = |module: &&Module| {
        let mut open: Vec<_> = imports[*module].iter().collect();
        let mut seen: BTreeSet<_> = open.iter().copied().collect();
        while let Some(imported) = open.pop() {
            open.extend(imports[imported].iter().filter(|next| seen.insert(next)));
        }
        seen.contains(module)
    };
    imports.keys().filter(imports_itself).map(|module| module.join("::")).collect()
}

#[test]
fn circles_are_found_and_what_hangs_on_them_is_not() {
    let circle = |files: &[(&str, &str)]| {
        let sources: Vec<_> = files.iter().map(|(path, text)| Source::parse(Path::new(path), text)).collect();
        in_circles(&imports(&sources.iter().collect::<Vec<_>>()))
    };
    let parent = [("src/x/a/mod.rs", "mod b; use b::B; struct A;"), ("src/x/a/b.rs", "use super::A;")];
    assert_eq!(circle(&parent), ["x::a", "x::a::b"]);
    let twins = [("src/x/a/b.rs", "use super::c::C;"), ("src/x/a/c.rs", "use crate::a::b::B;")];
    assert_eq!(circle(&twins), ["x::a::b", "x::a::c"]);
    let hanging =
        [("src/x/d.rs", "use super::a::b::B;"), ("src/x/e.rs", ""), ("src/x/a/d.rs", "fn f() { d + b }")];
    assert_eq!(circle(&[&twins[..], &hanging].concat()), ["x::a::b", "x::a::c"]);
    let downhill = [("src/x/a/mod.rs", "mod b; use b::B;"), ("src/x/a/b.rs", "use super::super::io::A;")];
    assert_eq!(circle(&downhill), [""; 0]);
}
