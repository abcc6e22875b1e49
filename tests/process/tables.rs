//! `--csv`: bound signals and reports as tables for other tools. `tests/cases/vehicle_status` has whole
//! tables.

use std::fs;
use std::process::Command;

use tempfile::TempDir;

use crate::support::prerequisite::{peer_python, require};
use crate::support::program::run;
use crate::support::status_vehicle;

/// A folder with the invented vehicle and its drive of six seconds.
pub(super) fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("bench.toml", status_vehicle::PROFILE),
        ("bench.dbc", status_vehicle::DBC),
        ("drive.log", &status_vehicle::drive()),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

const BENCH: [&str; 2] = ["--profile", "bench.toml"];

#[test]
fn a_table_at_a_rate_has_its_rows_at_equal_times() {
    let folder = folder();
    let replay = ["replay", "drive.log", "--csv", "tables/drive.csv", "--rate", "4", "--json"];
    let [summary] = &run(&folder, &[&replay[..], &BENCH].concat()).json()[..] else { panic!("one summary") };
    let table = fs::read_to_string(folder.path().join("tables/drive.csv")).unwrap();
    let times: Vec<&str> = table.lines().skip(1).filter_map(|row| row.split(',').next()).collect();
    assert_eq!((times.len(), times[1], times[23]), (24, "0.250000000", "5.750000000"));
    assert_eq!((summary["csv"].as_str(), summary["rows"].as_u64()), (Some("tables/drive.csv"), Some(24)));
    assert_eq!(summary["known_s"]["velocity_mps"].as_f64(), Some(4.99), "{summary}");
}

#[test]
fn a_value_ends_with_its_timeout_and_with_a_frame_that_is_too_short() {
    let folder = folder();
    let log = "(1.000) can0 301#0100000000000000\n(1.100) can0 301#0200000000000000\n(1.200) can0 301#02\n\
               (1.900) can0 001#00\n(2.000) can0 301#0100000000000000\n(2.700) can0 001#00\n";
    fs::write(folder.path().join("gaps.log"), log).unwrap();
    let table = run(&folder, &[&["decode", "gaps.log", "--csv", "-"][..], &BENCH].concat()).succeeded();
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let gear = names.iter().position(|name| *name == "BODY.GEAR").unwrap();
    let gears: Vec<_> = lines.map(|row| format!("{} {}", row[0].trim_end_matches('0'), row[gear])).collect();
    // The last good frame is 500 ms old at 0.6 s and at 1.5 s.
    let expected = ["0. drive", "0.1 reverse", "0.600000001 ", "1. drive", "1.500000001 ", "1.7 "];
    assert_eq!(gears, expected, "{table}");
}

#[test]
fn a_table_does_not_replace_its_recording_and_a_mistaken_name_is_refused() {
    let folder = folder();
    fs::rename(folder.path().join("drive.log"), folder.path().join("drive.csv")).unwrap();
    let refused =
        |arguments: &[&str], reason: &str| run(&folder, &[arguments, &BENCH].concat()).assert(2, reason);
    refused(
        &["decode", "drive.csv", "--csv", "./drive.csv"],
        "./drive.csv: this is the recording; give another name",
    );
    refused(&["replay", "--csv", "drive.log"], "expected a name that ends in .csv");
    refused(&["replay", "drive.csv", "--csv", "x.csv", "--speed", "1"], "leave out --speed");
    refused(&["replay", "drive.csv", "--rate", "10"], "--csv");
    let kept = fs::read_to_string(folder.path().join("drive.csv")).unwrap();
    assert_eq!(kept, status_vehicle::drive());
}

/// Python's module reads what spreadsheets read.
#[test]
fn the_csv_module_of_python_reads_numbers_and_words() {
    let python = require!(peer_python());
    let folder = folder();
    run(&folder, &[&["decode", "drive.log", "--csv", "signals.csv"][..], &BENCH].concat())
        .assert(0, "rows in 5.990 s");
    let script = "import csv\n\
                  rows = list(csv.DictReader(open('signals.csv', newline='', encoding='ascii')))\n\
                  assert all(None not in row and None not in row.values() for row in rows)\n\
                  times = [float(row['time_s']) for row in rows]\n\
                  speeds = [float(row['MOTION.SPEED [km per h]'] or 'nan') for row in rows]\n\
                  print(times == sorted(set(times)), speeds[0], rows[0]['BODY.GEAR'])";
    let read = Command::new(python).args(["-c", script]).current_dir(&folder).output().unwrap();
    let text = String::from_utf8_lossy(&[read.stdout, read.stderr].concat()).into_owned();
    assert_eq!(text, "True 36.0 drive\n");
}
