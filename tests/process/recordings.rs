//! Commands on several recordings: a table with a row for each, whatever becomes of it.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::tables;
use crate::support::program::{Ran, run};

/// The invented vehicle's drive twice, with a file between that breaks off, and files that are not
/// recordings.
fn archive() -> TempDir {
    let folder = tables::folder();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir_all(path("archive/b")).unwrap();
    fs::rename(path("drive.log"), path("archive/a.log")).unwrap();
    fs::write(path("archive/b/broken.blf"), b"LOGG").unwrap();
    fs::copy(path("archive/a.log"), path("archive/c.log")).unwrap();
    fs::write(path("archive/notes.txt"), "no frame\n").unwrap();
    folder
}

/// `recording exit_code` of each row.
fn codes(ran: &Ran) -> Vec<String> {
    ran.json()
        .iter()
        .map(|row| format!("{} {}", row["recording"].as_str().unwrap(), row["exit_code"]))
        .collect()
}

const ALL: [&str; 3] = ["archive/a.log", "archive/b/broken.blf", "archive/c.log"];

#[test]
fn a_bad_recording_in_the_middle_is_a_row_and_the_exit_code_is_the_worst() {
    let folder = archive();
    let checked = run(&folder, &["check", "archive", "--profile", "bench.toml", "--json", "--jobs", "2"]);
    assert_eq!(codes(&checked), [format!("{} 4", ALL[0]), format!("{} 1", ALL[1]), format!("{} 4", ALL[2])]);
    assert_eq!(checked.code, 1, "{}", checked.text());
    assert!(checked.error.contains("1 other file was skipped"), "{}", checked.error);
    let rows = checked.json();
    let names: Vec<_> = rows[0].as_object().unwrap().keys().collect();
    assert_eq!(names, ["recording", "car", "found", "exit_code", "error", "result"]);
    assert_eq!(
        (&rows[0]["car"], &rows[0]["error"], &rows[1]["result"]),
        (&json!("Bench"), &Value::Null, &Value::Null)
    );
    assert!(rows[0]["result"]["warnings"].as_u64().unwrap() > 0, "{}", rows[0]);
    let reason = rows[1]["error"]["text"].as_str().unwrap();
    assert!(!reason.is_empty() && rows[1]["found"] == reason, "{}", rows[1]);
    let text = run(&folder, &["check", ALL[0], ALL[1], "--profile", "bench.toml"]);
    text.assert(1, "\n   4  Bench                       archive/a.log: 0 errors, ");
    text.assert(1, &format!("\n   1  Bench                       archive/b/broken.blf: {reason}\n"));
    text.assert(1, "\n\n2 recordings: 1 with exit code 4, 1 with exit code 1\n");
}

#[test]
fn each_recording_has_a_table_in_the_folder_under_its_own_path() {
    let folder = archive();
    let replay = ["replay", "archive", "-p", "bench.toml", "--csv", "tables", "--json"];
    let replayed = run(&folder, &replay);
    assert_eq!(replayed.code, 1, "{}", replayed.text());
    let rows = replayed.json();
    assert_eq!(rows[0]["result"]["csv"], "tables/archive/a.log.csv");
    let table = |name: &str| fs::read_to_string(folder.path().join("tables").join(name)).unwrap();
    let one = run(&folder, &["replay", ALL[0], "-p", "bench.toml", "--csv", "-"]).succeeded();
    assert_eq!((table("archive/a.log.csv"), table("archive/c.log.csv")), (one.clone(), one));
    let refused = run(&folder, &["replay", "archive", "-p", "bench.toml", "--csv", "one.csv"]);
    refused.assert(2, "give --csv FOLDER");
    run(&folder, &["replay", "archive", "-p", "bench.toml"]).assert(2, "give --csv FOLDER");
}

#[test]
fn the_best_profile_of_each_recording_is_in_its_row() {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let folder = archive();
    fs::copy(demo, folder.path().join("archive/b/demo.log.gz")).unwrap();
    let identified = run(&folder, &["identify", "archive/b", "--json"]);
    assert_eq!(codes(&identified), ["archive/b/broken.blf 1", "archive/b/demo.log.gz 0"]);
    assert_eq!((identified.code, &identified.json()[1]["car"]), (1, &json!("demo_vehicle")));
}

#[test]
fn what_all_recordings_have_in_common_is_refused_once() {
    let folder = archive();
    let refused = run(&folder, &["check", "archive", "--profile", "nosuch"]);
    assert_eq!((refused.code, refused.out.as_str()), (3, ""), "{}", refused.error);
    run(&folder, &["decide", "archive"]).assert(2, "a recording needs --map");
    run(&folder, &["check", "-", ALL[0], "-p", "bench.toml"]).assert(2, "standard input is one recording");
    run(&folder, &["check", "archive", "-p", "bench.toml", "--fix"])
        .assert(2, "--fix mends by one recording");
    fs::create_dir(folder.path().join("empty")).unwrap();
    run(&folder, &["identify", "empty"]).assert(1, "there is no recording in it");
}
