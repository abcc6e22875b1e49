//! The promise `rust-version` makes: no locked dependency requires a newer compiler than this crate.

#![allow(clippy::unwrap_used)] // a test's own functions

use serde_json::Value;
use std::process::Command;

/// Major, minor, patch.
type Version = (u32, u32, u32);

#[test]
fn no_dependency_requires_a_newer_compiler_than_this_crate() {
    let ours = version(env!("CARGO_PKG_RUST_VERSION"));
    let packages = locked_packages();
    let newer: Vec<String> = packages
        .iter()
        .filter_map(|package| {
            let theirs = package["rust_version"].as_str()?;
            (version(theirs) > ours)
                .then(|| format!("{} {} needs {theirs}", package["name"], package["version"]))
        })
        .collect();
    assert!(packages.len() > 50, "the lockfile was not read");
    assert!(newer.is_empty(), "rust-version is {ours:?}, but\n{}", newer.join("\n"));
}

#[test]
fn versions_are_compared_as_numbers() {
    assert!(version("1.100") > version("1.89.2"));
    assert_eq!(version("1.89"), version("1.89.0"));
}

/// What this machine's kind would build, development dependencies included.
fn locked_packages() -> Vec<Value> {
    let host = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version=1", "--locked", "--filter-platform", &host])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

fn version(text: &str) -> Version {
    let mut parts = text.split('.').map(|part| part.parse::<u32>().unwrap());
    let mut next = || parts.next().unwrap_or(0);
    (next(), next(), next())
}
