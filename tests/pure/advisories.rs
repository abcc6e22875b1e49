//! Known weaknesses of the crates in the lock files: each one that applies has its reason in `deny.toml`,
//! which has no other.

#![allow(clippy::unwrap_used, clippy::panic)] // a test's own functions

use std::collections::BTreeSet;
use std::fs::read_to_string;
use std::path::Path;

use semver::{Version, VersionReq};
use toml::Table;

#[test]
fn each_listed_advisory_that_applies_to_a_lock_file_has_a_reason_and_no_other_has_one() {
    let list = read("tests/advisories/list");
    let applying = |lock: &str| {
        let crates = locked(&read(lock));
        assert!(crates.len() > 100, "{lock} was not read");
        applying(&list, &crates)
    };
    let reasons = reasons(&read("deny.toml"));
    let applies = applying("Cargo.lock");
    let explained: BTreeSet<&str> = reasons.iter().map(|(id, _)| id.as_str()).collect();
    let applies: BTreeSet<&str> = applies.iter().map(String::as_str).collect();
    assert_eq!(
        applies, explained,
        "left: what applies to Cargo.lock; right: what deny.toml has a reason for"
    );
    for (id, reason) in &reasons {
        assert!(reason.len() > 40, "{id}: {reason:?} is hardly a reason");
    }
    for id in applying("fuzz/Cargo.lock") {
        assert!(
            explained.contains(id.as_str()),
            "{id} applies to fuzz/Cargo.lock, and deny.toml has no reason for it"
        );
    }
}

#[test]
fn an_advisory_applies_to_the_versions_that_are_not_patched() {
    let list = "# a comment\n\
                RUSTSEC-2026-0001 one ^0.11.6,>=0.12.1 - weak\n\
                RUSTSEC-2026-0002 two - unmaintained two is unmaintained\n\
                RUSTSEC-2026-0003 three >=1.0.0 unsound unsound";
    let applies = |name: &str, version: &str| {
        !applying(list, &[(name.to_owned(), version.parse().unwrap())]).is_empty()
    };
    for (name, version, expected) in [
        ("one", "0.10.0", true),
        ("one", "0.11.5", true),
        ("one", "0.11.6", false),
        ("one", "0.12.0", true),
        ("one", "0.14.2", false),
        ("two", "99.0.0", true),
        ("three", "1.0.0-rc.1", true),
        ("three", "1.0.0", false),
        ("four", "1.0.0", false),
    ] {
        assert_eq!(applies(name, version), expected, "{name} {version}");
    }
}

fn read(path: &str) -> String {
    read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// The advisories of a list that apply to one of these crates.
fn applying(list: &str, crates: &[(String, Version)]) -> BTreeSet<String> {
    let lines = list.lines().filter(|line| !line.starts_with('#'));
    let applies = |line: &&str| {
        let [_, package, patched, ..] = line.split(' ').collect::<Vec<_>>()[..] else {
            panic!("{line:?}: expected ID CRATE VERSIONS KIND TITLE")
        };
        let patched: Vec<VersionReq> =
            patched.split(',').filter(|range| *range != "-").map(|range| range.parse().unwrap()).collect();
        let is_patched = |version: &Version| patched.iter().any(|range| range.matches(version));
        crates.iter().any(|(name, version)| name == package && !is_patched(version))
    };
    lines.filter(applies).map(|line| line.split(' ').next().unwrap().to_owned()).collect()
}

/// Name and version of each crate in a lock file.
fn locked(lock: &str) -> Vec<(String, Version)> {
    let lock: Table = lock.parse().unwrap();
    let text = |package: &toml::Value, key| package[key].as_str().unwrap().to_owned();
    let packages = lock["package"].as_array().unwrap().iter();
    packages.map(|package| (text(package, "name"), text(package, "version").parse().unwrap())).collect()
}

/// Identifier and reason of each advisory that `deny.toml` ignores.
fn reasons(deny: &str) -> Vec<(String, String)> {
    let deny: Table = deny.parse().unwrap();
    let text = |entry: &toml::Value, key| entry[key].as_str().unwrap().to_owned();
    let ignored = deny["advisories"]["ignore"].as_array().unwrap().iter();
    ignored.map(|entry| (text(entry, "id"), text(entry, "reason"))).collect()
}
