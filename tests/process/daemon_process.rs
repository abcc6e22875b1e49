//! The daemon as a process: how it starts, its messages to the service manager, how it ends. Runs
//! anywhere: frames come from a recording, or from an interface that is not there.

use std::path::Path;
use std::time::Duration;

use crate::support::command_vehicle::{DBC, PROFILE};
use crate::support::process::{self, Folder, Process};
use crate::support::service_manager::ServiceManager;
use crate::support::waiting::Bystander;

/// The demo recording at the configured speed, without ROS.
fn recording(keys: &str) -> Folder {
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/config/demo.log.gz");
    Folder::with_demo_vehicle(
        "no-such-can",
        &format!(
            "source = \"recording\"\n[recording]\nfile = \"{recording}\"\n{keys}\n[ros]\nenabled = false\n"
        ),
    )
}

/// A recording that is over at once, without ROS.
fn short_recording() -> Folder {
    let keys = "source = \"recording\"\n[recording]\nfile = \"short.log\"\n[ros]\nenabled = false\n";
    let folder = Folder::with_demo_vehicle("can0", keys);
    folder.write("short.log", "(1000.000000) can0 2A5#0000000000000000\n");
    folder
}

#[test]
fn the_service_manager_is_notified_of_start_watchdog_periods_and_end() {
    // Diagnostics every 500 ms, and a second of the recording takes 100 s: neither feeds the watchdog.
    for (folder, status) in [
        (recording("speed = 0.01"), "WARN: turn_indicators: starting: waiting for "),
        (
            Folder::with_demo_vehicle("no-such-can", "[ros]\nenabled = false\n"),
            "ERROR: turn_indicators: unknown: no-such-can is missing; hazard_lights: unknown: no-such-can is missing; \
             no-such-can: no-such-can is missing",
        ),
    ] {
        let manager = ServiceManager::in_folder(folder.path());
        let mut gateway = Process::run_with(&folder, |command| manager.watch(command, 100_000));
        let ready = manager.next();
        assert!(ready.starts_with(&format!("READY=1\nSTATUS={status}")), "{ready}");
        let other = || std::iter::repeat_with(|| manager.next()).find(|text| !text.starts_with("STATUS="));
        let bystander = Bystander::start();
        for _ in 0..20 {
            assert_eq!(other().unwrap(), "WATCHDOG=1");
        }
        // 20 pings 50 ms apart; without a clock of its own the watchdog would wait for 5 s and more.
        bystander.assert_in_time("feeding the watchdog", Duration::from_secs(4));
        gateway.stop("TERM");
        // Without a watchdog, whose pings would fill the queue while nobody reads it.
        manager.drain();
        let mut gateway = Process::run_with(&folder, |command| manager.supervise(command));
        manager.wait_for("READY=1");
        gateway.stop("TERM");
        assert_eq!(other().unwrap(), "STOPPING=1");
    }
}

#[test]
fn sigterm_and_sigint_end_it_in_time_whatever_it_is_doing() {
    let folders = [
        ("at the end of a recording", short_recording()),
        ("in a recording", recording("repeat = true")),
        ("in one that is always behind its time", recording("speed = 1000.0\nrepeat = true")),
        ("in one that is hardly moving", recording("speed = 0.01")),
        ("without its interface", Folder::with_demo_vehicle("no-such-can", "[ros]\nenabled = false\n")),
        ("with ROS", Folder::with_demo_vehicle("no-such-can", &process::ros())),
    ];
    for (doing, folder) in &folders {
        for signal in ["TERM", "INT"] {
            let mut gateway = Process::run(folder);
            gateway.wait_for_log(if doing.contains("end of") { "has ended" } else { "turn_indicators: " });
            println!("SIG{signal} {doing}: {:?}", gateway.stop(signal));
        }
    }
}

#[test]
fn an_empty_recording_that_is_to_be_repeated_ends_the_process_with_its_reason() {
    let folder = Folder::with_demo_vehicle(
        "can0",
        "source = \"recording\"\n[recording]\nfile = \"empty.log\"\nrepeat = true\n[ros]\nenabled = false\n",
    );
    folder.write("empty.log", "");
    let mut gateway = Process::run(&folder);
    assert_eq!(gateway.ended().code(), Some(1));
    gateway.wait_for_log("empty.log: the file is empty");
}

#[test]
fn a_vehicle_without_turn_and_hazard_lights_needs_no_bus() {
    let folder = Folder::with_demo_vehicle("can0", "");
    folder.write("bare.toml", "name = \"Bare\"\n[turn]\nfitted = false\n[hazard]\nfrom = \"not_fitted\"\n");
    folder.write("gateway.toml", "profile = \"bare.toml\"\n[ros]\nenabled = false\n");
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("hazard_lights: publishing");
    gateway.stop("TERM");
}

#[test]
fn what_happens_at_one_moment_is_one_record_of_the_log() {
    for (interface, why) in [("no-such-can", "is missing"), ("lo", "is not a CAN interface")] {
        let folder = Folder::with_demo_vehicle(interface, &process::ros());
        let mut gateway = Process::run(&folder);
        gateway.wait_for_log(&format!("{interface}: {interface} {why}"));
        assert!(gateway.is_running());
        gateway.stop("TERM");
        let lines: Vec<_> =
            gateway.log().into_iter().filter(|line| line.contains(&format!("{interface} {why}"))).collect();
        let text = format!(
            "ERROR turn_indicators: unknown: {interface} {why}; hazard_lights: unknown: {interface} {why}; {interface}: \
             {interface} {why}"
        );
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].contains(&text), "{lines:?}");
    }
}

/// Sends commands on these interfaces, which are missing: the lock does not need them.
fn commanding(tx: &str, interface: &str) -> Folder {
    let folder = Folder::with_configuration(&format!(
        "profile = \"bench.toml\"\n[can.body]\ninterface = \"{interface}\"\n[command]\ntx = \"{tx}\"\n\
         [ros]\nenabled = false\n"
    ));
    folder.write("bench.toml", PROFILE);
    folder.write("bench.dbc", DBC);
    folder
}

#[test]
fn a_second_process_that_would_command_on_the_same_interface_is_refused_with_the_pid_of_the_first() {
    let (on, elsewhere, dry) =
        (commanding("on", "no-can-0"), commanding("on", "no-can-1"), commanding("off", "no-can-0"));
    let mut first = Process::run(&on);
    first.wait_for_log("nothing can be sent on body");
    let mut second = Process::run(&on);
    assert_eq!(second.ended().code(), Some(1));
    let text = format!("commands are already sent on no-can-0 by process {}", first.id());
    assert!(second.log().iter().any(|line| line.contains(&text)), "{text}: {:?}", second.log());
    for other in [&elsewhere, &dry] {
        let mut other = Process::run(other);
        other.wait_for_log(" is missing");
        other.stop("TERM");
    }
    assert!(first.is_running());
    drop(first); // SIGKILL
    let mut successor = Process::run(&on);
    successor.wait_for_log("nothing can be sent on body");
    successor.stop("TERM");
}

#[test]
fn black_box_that_cannot_be_written_is_reported_and_the_gateway_runs_on() {
    let keys = |folder: &str| format!("[black_box]\nfolder = \"{folder}\"\n[ros]\nenabled = false\n");
    for (place, why) in
        [("gateway.toml", "File exists"), ("gateway.toml/box", "Not a directory"), ("/proc/box", "")]
    {
        let folder = Folder::with_demo_vehicle("no-such-can", &keys(place));
        let mut gateway = Process::run(&folder);
        gateway.wait_for_log(&format!("black_box: recordings cannot be written: {why}"));
        gateway.wait_for_log("no-such-can: no-such-can is missing");
        gateway.stop("TERM");
        let reported =
            gateway.log().into_iter().filter(|line| line.contains("black box not written in")).count();
        assert_eq!(reported, 1, "{:?}", gateway.log());
    }
}

#[test]
fn errors_of_the_configuration_are_reported_with_their_position_and_exit_code_3() {
    let spoilt = [
        ("profile = 3\n", "gateway.toml:1:11"),
        ("profile = \"demo_vehicle.toml\"\n[can.body]\ninterface = \"can/0\"\n", "gateway.toml:3:13"),
        ("profile = \"demo_vehicle.toml\"\nsource = \n", "gateway.toml:2:10"),
        ("profile = \"none.toml\"\n[can.body]\ninterface = \"can0\"\n", "gateway.toml:1:11"),
        ("profile = \"no_dbc.toml\"\n[can.body]\ninterface = \"can0\"\n", "no_dbc.toml:3:7"),
    ];
    for (text, position) in spoilt {
        let folder = Folder::with_demo_vehicle("can0", "");
        folder.write("gateway.toml", text);
        let profile = "name = \"x\"\n[bus.body]\ndbc = \"none.dbc\"\n[turn]\nfitted = false\n[hazard]\nfrom = \"not_fitted\"\n";
        folder.write("no_dbc.toml", profile);
        let mut gateway = Process::run(&folder);
        assert_eq!(gateway.ended().code(), Some(3), "{text}");
        let log = gateway.log();
        assert!(log.iter().any(|line| line.contains(position)), "{position} is not in {log:?}");
    }
    let mut gateway = Process::start(Path::new("/"), |command| {
        command.arg("fly");
    });
    assert_eq!(gateway.ended().code(), Some(2));
}

#[test]
#[cfg(feature = "ros")]
fn dds_logs_only_when_rust_log_names_it() {
    let folder = Folder::with_demo_vehicle("no-such-can", &process::ros());
    for (rust_log, noisy) in [(None, false), (Some("debug"), false), (Some("rustdds=debug"), true)] {
        let mut gateway = Process::run_with(&folder, |command| {
            command.envs(rust_log.map(|level| ("RUST_LOG", level)));
        });
        gateway.wait_for_log("no-such-can: no-such-can is missing");
        gateway.stop("TERM");
        let strange = |line: &String| {
            ![
                "turn_indicators: ",
                "hazard_lights: ",
                "log: ",
                "wall_clock: ",
                "ros: ",
                "no-such-can",
                "Demo vehicle",
                "status socket",
                "stopped",
                // Of a machine that stands still for seconds.
                "continuing with a new DDS participant",
                "the network side of ROS 2 has ended (no answer)",
            ]
            .iter()
            .any(|ours| line.contains(ours))
        };
        let strangers: Vec<_> = gateway.log().into_iter().filter(strange).collect();
        assert_eq!(!strangers.is_empty(), noisy, "{rust_log:?}: {strangers:?}");
    }
}
