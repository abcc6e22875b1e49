//! A log that nobody reads, and one that floods: the gateway runs on, and follows its signals.

use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::process::Stdio;

use crate::support::process::{Folder, Process};
use crate::support::service_manager::ServiceManager;

/// Left and off in turn, over and over, as fast as it goes: a flood of changes.
fn flood() -> Folder {
    let keys = "source = \"recording\"\n[recording]\nfile = \"flood.log\"\nspeed = 1000.0\nrepeat = true\n\
                [ros]\nenabled = false\n";
    let folder = Folder::with_demo_vehicle("can0", keys);
    let line = |frame: u32| {
        format!(
            "({}.{:02}0000) can0 2A5#0000{:02X}0000000000\n",
            1000 + frame / 50,
            frame % 50 * 2,
            frame % 2 * 2
        )
    };
    folder.write("flood.log", &(0..500).map(line).collect::<String>());
    folder
}

/// Runs with this standard error until the loop has fed the watchdog often, then stops in order.
fn runs_and_stops_with(stderr: Stdio, folder: &Folder) {
    let manager = ServiceManager::in_folder(folder.path());
    let mut gateway = Process::run_with(folder, |command| {
        manager.watch(command, 100_000);
        command.stderr(stderr);
    });
    for _ in 0..20 {
        manager.wait_for("WATCHDOG=1");
    }
    gateway.stop("TERM");
}

#[test]
fn reader_of_the_log_that_vanishes_does_not_end_the_gateway() {
    let (reader, writer) = io::pipe().unwrap();
    drop(reader);
    runs_and_stops_with(writer.into(), &flood());
}

#[test]
fn full_disk_under_the_log_does_not_end_the_gateway() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    runs_and_stops_with(full.into(), &flood());
}

#[test]
fn log_that_is_never_read_does_not_stop_the_gateway_nor_its_end() {
    let (mut reader, mut writer) = io::pipe().unwrap();
    // The size of a pipe: it is full from the start.
    writer.write_all(&vec![b'x'; 65_536]).unwrap();
    runs_and_stops_with(writer.into(), &flood());
    let mut read = Vec::new();
    reader.read_to_end(&mut read).unwrap();
    assert!(read.iter().all(|byte| *byte == b'x'), "the pipe had room for more");
}

#[test]
fn refused_configuration_is_exit_code_3_whoever_reads_the_log() {
    let folder = Folder::with_configuration("profile = 3\n");
    let (reader, gone) = io::pipe().unwrap();
    drop(reader);
    let (_reader, mut full) = io::pipe().unwrap();
    full.write_all(&vec![b'x'; 65_536]).unwrap();
    for stderr in [gone, full] {
        let mut gateway = Process::run_with(&folder, |command| {
            command.stderr(stderr);
        });
        assert_eq!(gateway.ended().code(), Some(3));
    }
}

#[test]
fn flood_of_changes_is_bounded_and_summed_up() {
    let folder = flood();
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log(" more times in ");
    gateway.stop("TERM");
    let seconds = gateway.started().elapsed().as_secs() + 2;
    let lines = gateway.log();
    // Two reports and their bus, ten lines and at most six summaries of each in six seconds.
    let most = usize::try_from((seconds / 6 + 1) * 3 * 16).unwrap() + 10;
    assert!(lines.len() <= most, "{} lines in {seconds} s", lines.len());
    for line in lines.iter().filter(|line| line.contains(" in ") && line.contains(" s, the last: ")) {
        let mut words = line.split_whitespace();
        let (stamp, level) = (words.next().unwrap(), words.next().unwrap());
        assert!(stamp.ends_with('Z') && ["WARN", "INFO", "ERROR"].contains(&level), "{line}");
    }
}

#[test]
fn level_that_does_not_exist_is_refused_and_every_other_one_is_taken() {
    let folder = Folder::with_configuration("profile = 3\n");
    let log_of = |level: &str| {
        let mut gateway = Process::run_with(&folder, |command| {
            command.env("RUST_LOG", level);
        });
        assert_eq!(gateway.ended().code(), Some(3));
        gateway.log().join("\n")
    };
    for level in ["loud", "info,garbage", "signal_gateway=loud", "=,=", "warn;error"] {
        let log = log_of(level);
        assert!(
            log.contains("RUST_LOG: cannot read ") && log.contains("expected error, warn"),
            "{level}: {log}"
        );
    }
    for level in ["", "debug", "INFO", "warn,rustdds=debug", "signal_gateway::io=trace,", "off"] {
        let log = log_of(level);
        assert!(log.contains("gateway.toml") && !log.contains("RUST_LOG"), "{level}: {log}");
    }
}
