//! Lists the files that are built into the binary, so that a new profile, country or drive needs no entry
//! anywhere else, and makes the text of `--version`.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

const FILES: [&str; 4] =
    ["config/demo.log.gz", "config/demo.toml", "config/demo_commands.toml", "config/demo_lights.toml"];
const FOLDERS: [&str; 7] = [
    "config/cars",
    "config/countries",
    "config/drives",
    "config/maps",
    "config/scenarios",
    "config/vehicles",
    "dbc",
];
const EXTENSIONS: [&str; 5] = ["dbc", "osm", "toml", "xosc", "yaml"];

fn main() -> Result<(), Box<dyn Error>> {
    let mut paths: Vec<PathBuf> = FILES.iter().map(PathBuf::from).collect();
    for folder in FOLDERS {
        println!("cargo::rerun-if-changed={folder}");
        add_files(Path::new(folder), &mut paths)?;
    }
    paths.sort_unstable();
    let mut list = "&[\n".to_owned();
    for path in &paths {
        let [name, file] = [path, &path.canonicalize()?].map(|path| path.display().to_string());
        writeln!(list, "({name:?}, include_bytes!({file:?})),")?;
    }
    let output = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(output.join("built_in.rs"), list + "]\n")?;
    println!("cargo::rustc-env=SIGNAL_GATEWAY_VERSION={}", version()?);
    Ok(())
}

/// The version of the package, the ROS 2 distribution, Zenoh if it is built in, and the commit where the
/// build is given one.
fn version() -> Result<String, env::VarError> {
    println!("cargo::rerun-if-env-changed=SIGNAL_GATEWAY_COMMIT");
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let distribution = match (has("JAZZY"), has("HUMBLE")) {
        (true, _) => "ROS 2 Jazzy",
        (_, true) => "ROS 2 Humble",
        _ => "without ROS 2",
    };
    let zenoh = if has("ZENOH") { ", Zenoh" } else { "" };
    let commit =
        env::var("SIGNAL_GATEWAY_COMMIT").map(|commit| format!(", commit {commit}")).unwrap_or_default();
    Ok(format!("{} ({distribution}{zenoh}{commit})", env::var("CARGO_PKG_VERSION")?))
}

fn add_files(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            add_files(&path, paths)?;
        } else if EXTENSIONS.iter().any(|known| path.extension().is_some_and(|extension| extension == *known))
        {
            paths.push(path);
        }
    }
    Ok(())
}
