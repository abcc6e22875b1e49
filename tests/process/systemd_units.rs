//! The unit files, judged by systemd's own tools.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{fs, io};

use crate::support::prerequisite::{Missing, Prerequisite, require};

/// systemd's exposure in tenths: 0 locked up, 100 wide open. What is left is the network.
const HIGHEST_EXPOSURE: u32 = 12;

/// The units, as they are started.
const UNITS: [&str; 3] =
    ["signal-gateway.service", "signal-gateway-network@1.service", "signal-gateway-network.socket"];

#[test]
fn systemd_accepts_each_unit_without_a_word() {
    let dir = tempfile::tempdir().unwrap();
    unit_with_an_executable(dir.path());
    for unit in UNITS {
        let unit = dir.path().join(unit);
        let output = require!(run("systemd-analyze", &["verify", "--man=no", text(&unit)]));
        assert!(output.status.success() && output_of(&output).is_empty(), "{}", output_of(&output));
    }
}

#[test]
fn systemd_complains_about_a_spoilt_unit() {
    let dir = tempfile::tempdir().unwrap();
    let unit = unit_with_an_executable(dir.path());
    let spoilt = fs::read_to_string(&unit).unwrap().replace("WatchdogSec=", "WatchDogSeconds=");
    fs::write(&unit, spoilt).unwrap();
    let output = require!(run("systemd-analyze", &["verify", "--man=no", text(&unit)]));
    assert!(output_of(&output).contains("WatchDogSeconds"), "{}", output_of(&output));
}

#[test]
fn each_unit_is_exposed_no_more_than_its_network_requires() {
    let dir = tempfile::tempdir().unwrap();
    unit_with_an_executable(dir.path());
    let threshold = format!("--threshold={HIGHEST_EXPOSURE}");
    for unit in ["signal-gateway.service", "signal-gateway-network@.service"] {
        let unit = dir.path().join(unit);
        let arguments = ["security", "--offline=true", "--no-pager", &threshold, text(&unit)];
        let output = require!(run("systemd-analyze", &arguments));
        let table = output_of(&output);
        println!("{}", table.lines().last().unwrap_or_default());
        assert!(output.status.success(), "{table}");
        assert!(exposure_in_tenths(&table).unwrap() <= HIGHEST_EXPOSURE, "{table}");
    }
}

/// The network process can do no more under its own unit than under the gateway's.
#[test]
fn both_units_are_hardened_alike() {
    /// What each has for itself.
    #[rustfmt::skip]
    const OWN: [&str; 9] = [
        "Description", "ExecStart", "RestrictAddressFamilies", "OOMPolicy", "UMask", "TasksMax", "MemoryMax",
        "TimeoutStopSec", "KillMode",
    ];
    let [gateway, network] = ["signal-gateway.service", "signal-gateway-network@.service"]
        .map(|name| fs::read_to_string(project_file(name)).unwrap());
    let hardening = |unit: &str| {
        let entries = entries(unit).filter(|(section, key, _)| *section == "Service" && !OWN.contains(key));
        let entries = entries.skip_while(|(_, key, _)| *key != "CapabilityBoundingSet");
        entries.map(|(_, key, value)| format!("{key}={value}")).collect::<Vec<_>>()
    };
    // Files of its own are the gateway's alone.
    let folders = ["StateDirectory", "RuntimeDirectory"];
    let mut shared = hardening(&gateway);
    shared.retain(|entry| !folders.iter().any(|folder| entry.starts_with(folder)));
    assert_eq!(hardening(&network), shared);
    let families = entries(&network).find(|(_, key, _)| *key == "RestrictAddressFamilies");
    assert_eq!(families.map(|(.., value)| value), Some("AF_NETLINK AF_INET AF_INET6"));
}

/// systemd knows the keys from 254 on; an older one names them, and nothing else.
#[test]
fn systemd_accepts_the_growing_delay_or_names_its_keys() {
    let dir = tempfile::tempdir().unwrap();
    let unit = unit_with_an_executable(dir.path());
    let beside = dir.path().join("signal-gateway.service.d");
    fs::create_dir(&beside).unwrap();
    fs::copy(project_file("delay.conf"), beside.join("delay.conf")).unwrap();
    let output = require!(run("systemd-analyze", &["verify", "--man=no", text(&unit)]));
    let complaints = output_of(&output);
    let is_known = |line: &str| line.contains("Unknown key") && line.contains("'Restart");
    assert!(complaints.lines().all(is_known), "{complaints}");
    assert!([0, 2].contains(&complaints.lines().count()), "{complaints}");
}

#[test]
fn the_unit_keeps_what_the_gateway_lives_on() {
    let unit = fs::read_to_string(project_file("signal-gateway.service")).unwrap();
    let value = |key| entries(&unit).find(|entry| entry.1 == key).map(|entry| entry.2);
    assert_eq!(value("Type"), Some("notify"));
    assert_eq!(value("RestartPreventExitStatus"), Some("2 3"));
    for family in ["AF_CAN", "AF_NETLINK", "AF_UNIX", "AF_INET", "AF_INET6"] {
        assert!(value("RestrictAddressFamilies").unwrap().split(' ').any(|one| one == family), "{family}");
    }
    let reload = "/usr/local/bin/signal-gateway reload --pid $MAINPID";
    assert_eq!(value("ExecReload"), Some(reload));
    for tie in ["BindsTo", "Requires", "PrivateNetwork", "JoinsNamespaceOf"] {
        assert_eq!(value(tie), None, "{tie}");
    }
}

#[test]
fn a_shipped_binary_that_panics_or_overflows_ends_and_is_restarted() {
    let manifest: toml::Table = include_str!("../../Cargo.toml").parse().unwrap();
    let release = &manifest["profile"]["release"];
    let (panic, overflow_checks) = (release["panic"].as_str(), release["overflow-checks"].as_bool());
    assert_eq!((panic, overflow_checks), (Some("abort"), Some(true)));
    let unit = fs::read_to_string(project_file("signal-gateway.service")).unwrap();
    let has = |key, value| entries(&unit).any(|entry| (entry.1, entry.2) == (key, value));
    assert!(has("Restart", "always") && has("StartLimitIntervalSec", "0"), "it never gives up");
}

#[test]
fn the_user_can_be_made() {
    let file = project_file("signal-gateway.sysusers");
    let output = require!(run("systemd-sysusers", &["--dry-run", text(&file)]));
    assert!(output.status.success(), "{}", output_of(&output));
    assert!(!output_of(&output).contains("ignoring"), "{}", output_of(&output));
}

/// networkd has no verifier: sections and keys are held against `systemd.network(5)` (v252).
#[test]
fn the_network_file_has_only_sections_and_keys_that_networkd_knows() {
    let known = [
        ("Match", "Name"),
        ("Link", "RequiredForOnline"),
        ("CAN", "BitRate"),
        ("CAN", "SamplePoint"),
        ("CAN", "ListenOnly"),
        ("CAN", "RestartSec"),
        ("CAN", "BusErrorReporting"),
        ("CAN", "FDMode"),
        ("CAN", "DataBitRate"),
    ];
    let file = fs::read_to_string(project_file("80-can0.network")).unwrap();
    for (section, key, value) in entries(&file) {
        assert!(known.contains(&(section, key)) && !value.is_empty(), "[{section}] {key}={value}");
    }
    assert!(entries(&file).any(|entry| entry == ("Match", "Name", "can0")));
    assert!(entries(&file).any(|(section, key, _)| (section, key) == ("CAN", "BitRate")));
}

/// (section, key, value) of every assignment; panics on a line that is none of systemd's syntax.
fn entries(file: &str) -> impl Iterator<Item = (&str, &str, &str)> {
    let mut section = "";
    let lines = file.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', ';']));
    lines.filter_map(move |line| {
        if let Some(name) = line.strip_prefix('[') {
            section = name.strip_suffix(']').unwrap();
            return None;
        }
        let (key, value) = line.split_once('=').unwrap_or_else(|| panic!("no assignment: {line}"));
        Some((section, key, value))
    })
}

/// The gateway's unit, copied together with the others, with a program that exists: `verify` looks for it.
fn unit_with_an_executable(dir: &Path) -> PathBuf {
    let program = "/usr/local/bin/signal-gateway";
    let units =
        ["signal-gateway-network.socket", "signal-gateway-network@.service", "signal-gateway.service"];
    for name in units {
        let unit = fs::read_to_string(project_file(name)).unwrap();
        assert!(unit.contains(program) || name.ends_with(".socket"));
        fs::write(dir.join(name), unit.replace(program, env!("CARGO_BIN_EXE_signal-gateway"))).unwrap();
    }
    dir.join("signal-gateway.service")
}

/// Runs `program` with `arguments`.
fn run(program: &str, arguments: &[&str]) -> Result<Output, Missing> {
    let missing = |why| Err(Prerequisite::SystemdAnalyze.missing(why));
    match Command::new(program).args(arguments).env("SYSTEMD_COLORS", "0").output() {
        Ok(output) if output_of(&output).contains("unrecognized option") => {
            missing(format!("this {program} is too old for {arguments:?}"))
        }
        Ok(output) => Ok(output),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            missing(format!("{program} is not installed"))
        }
        Err(error) => panic!("{program}: {error}"),
    }
}

/// The number before the point and the digit after it in "… exposure level for x: 1.2 OK".
fn exposure_in_tenths(table: &str) -> Option<u32> {
    let (_, verdict) = table.lines().find(|line| line.contains("exposure level"))?.split_once(": ")?;
    let (whole, tenths) = verdict.split_whitespace().next()?.split_once('.')?;
    Some(whole.parse::<u32>().ok()? * 10 + tenths.parse::<u32>().ok()?)
}

fn output_of(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

fn project_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("systemd").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
