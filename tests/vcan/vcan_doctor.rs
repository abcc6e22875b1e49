//! `doctor` on broken set-ups, each of which is mended as its remedy says. Virtual interfaces, and a
//! controller behind the kernel's `slcan`, whose adapter the test is.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::Value;
use socketcan::CanCtrlMode;

use crate::support::doctor::{examine, wait_until_found};
use crate::support::prerequisite::require;
use crate::support::process::Folder;
use crate::support::slcan::Adapter;
use crate::support::vcan::{Sender, Vcan, can_interfaces};
use crate::support::waiting::{Pace, wait_until};

/// Messages of the demo vehicle.
const SOUND: [(u32, [u8; 8]); 2] = [(0x2A5, [0; 8]), (0x2C1, [0; 8])];

fn folder(interface: &str) -> Folder {
    Folder::with_demo_vehicle(interface, "[ros]\nenabled = false\n")
}

/// A count of the kernel for an interface.
fn count(interface: &str, name: &str) -> u64 {
    let path = format!("/sys/class/net/{interface}/statistics/{name}");
    std::fs::read_to_string(Path::new(&path)).unwrap().trim().parse().unwrap()
}

#[test]
fn set_up_1_interface_that_is_missing_is_plugged_in() {
    require!(can_interfaces());
    let folder = folder("vcandr1");
    let broken = examine(folder.path());
    broken.assert_found("interface_missing", "of CAN there is ");
    let vcan = require!(Vcan::new("vcandr1"));
    let _car = Sender::start(&vcan, &SOUND);
    examine(folder.path()).assert_mended("interface_missing");
}

#[test]
fn set_up_2_interface_that_is_down_is_brought_up() {
    let vcan = require!(Vcan::new("vcandr2"));
    vcan.bring_down();
    let folder = folder(vcan.name);
    let broken = examine(folder.path());
    broken.assert_found("interface_down", "ip link set vcandr2 up");
    assert!(
        broken.remedy("interface_down").unwrap().ends_with("vcandr2 up"),
        "a virtual one has no bit rate"
    );
    vcan.bring_up();
    examine(folder.path()).assert_mended("interface_down");
}

#[test]
fn set_up_3_interface_of_another_kind_is_replaced_by_the_right_one() {
    let vcan = require!(Vcan::new("vcandr3"));
    let broken = folder("lo");
    examine(broken.path()).assert_found("interface_not_can", "vcandr3");
    examine(folder(vcan.name).path()).assert_mended("interface_not_can");
}

#[test]
fn set_up_4_silent_bus_wakes_up_with_the_ignition_and_nothing_is_sent_on_it() {
    let vcan = require!(Vcan::new("vcandr4"));
    let folder = folder(vcan.name);
    examine(folder.path()).assert_found("silent_bus", "switch the ignition on");
    assert_eq!(count(vcan.name, "tx_packets"), 0, "doctor sends nothing");
    let car = Sender::start(&vcan, &SOUND);
    let sound = examine(folder.path());
    sound.assert_mended("silent_bus");
    sound.assert_mended("other_vehicle");
    drop(car);
}

#[test]
fn set_up_5_another_bus_is_replaced_by_the_right_one() {
    let (other, right) = (require!(Vcan::new("vcandr5")), require!(Vcan::new("vcandr6")));
    let _others = Sender::start(&other, &[(0x5EE, [1; 8])]);
    let _car = Sender::start(&right, &SOUND);
    examine(folder(other.name).path()).assert_found("other_vehicle", "identify --live vcandr5");
    examine(folder(right.name).path()).assert_mended("other_vehicle");
}

#[cfg(feature = "ros")]
mod with_peers {
    use super::*;
    use crate::support::doctor::{Diagnosis, doctor};
    use crate::support::peer::{Cyclone, domain};
    use crate::support::process::{Process, ros_in};

    const TOPIC: &str = "rt/vehicle/status/turn_indicators_status";

    #[test]
    fn set_up_6_another_publisher_of_a_report_is_stopped() {
        let vcan = require!(Vcan::new("vcandr7"));
        let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
        let folder = Folder::with_demo_vehicle(vcan.name, &ros_in(domain));
        folder.append("gateway.toml", "[status]\nsocket = \"status.sock\"\n");
        let gateway = Process::run(&folder);
        let examine = || examine(folder.path());
        wait_until("a gateway that tells what it publishes", || {
            examine().whole["facts"]["running"]["reach"] == "served"
        });
        let other = cyclone.start("writer.py", domain, &["turn", TOPIC, "reliable", "volatile"]);
        let broken = wait_until_found("other_publisher", true, examine);
        broken.assert_found("other_publisher", "ros2 topic info -v /vehicle/status/turn_indicators_status");
        let text = broken.whole["checks"].to_string();
        assert!(
            text.contains("1 other writer (Cyclone DDS) as well"),
            "the own writer does not count: {text}"
        );
        drop(other);
        wait_until_found("other_publisher", false, examine);
        drop(gateway);
    }

    #[test]
    fn set_up_7_reader_that_requests_more_than_is_offered_is_served() {
        let vcan = require!(Vcan::new("vcandr8"));
        let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
        let keys = |durability: &str| format!("{}[reports]\ndurability = \"{durability}\"\n", ros_in(domain));
        let _reader = cyclone.topic_reader(domain, "turn", TOPIC, "transient_local");
        let broken = Folder::with_demo_vehicle(vcan.name, &keys("volatile"));
        let found = wait_until_found("incompatible_reader", true, || examine(broken.path()));
        found.assert_found("incompatible_reader", "set [reports] durability = \"transient_local\"");
        let mended = Folder::with_demo_vehicle(vcan.name, &keys("transient_local"));
        let seen = |diagnosis: &Diagnosis| {
            diagnosis.whole["checks"].to_string().contains("turn_indicators_status 1 reader")
        };
        wait_until("the reader, as one that is served", || seen(&examine(mended.path())));
        examine(mended.path()).assert_mended("incompatible_reader");
    }

    #[test]
    fn set_up_8_gateway_in_another_domain_than_the_others_joins_theirs() {
        let vcan = require!(Vcan::new("vcandr9"));
        let cyclone = require!(Cyclone::on_loopback());
        let (wrong, right) = (domain(), domain());
        let _autoware = cyclone.topic_reader(right, "turn", TOPIC, "volatile");
        let run = |folder: &Folder| {
            let mut command = doctor(folder.path(), &["--config", "gateway.toml", "--seconds", "1"]);
            Diagnosis::of(command.env("ROS_DOMAIN_ID", right.to_string()))
        };
        let broken = Folder::with_demo_vehicle(vcan.name, &ros_in(wrong));
        let found = wait_until_found("peers_in_other_domain", true, || run(&broken));
        found.assert_found("peers_in_other_domain", &format!("set [ros] domain_id = {right}"));
        let mended = run(&Folder::with_demo_vehicle(vcan.name, &ros_in(right)));
        mended.assert_mended("peers_in_other_domain");
        mended.assert_mended("other_domain_in_shell");
    }
}

#[test]
fn set_up_9_controller_that_is_bus_off_is_restarted() {
    let adapter = require!(Adapter::plug_in());
    let folder = folder(&adapter.name);
    adapter.send_lines("sb000256\r");
    let state = || examine(folder.path());
    let broken = wait_until_found("bus_off", true, state);
    broken.assert_found("bus_off", &format!("ip link set {} type can restart", adapter.name));
    // What the command has the driver do.
    adapter.send_lines("sa000000\r");
    wait_until_found("bus_off", false, state);
}

#[test]
fn set_up_10_controller_that_can_send_is_set_to_listen_only() {
    let adapter = require!(Adapter::plug_in());
    let folder = folder(&adapter.name);
    let remedy = format!("ip link set {} up type can bitrate 500000 listen-only on", adapter.name);
    examine(folder.path()).assert_found("listen_only_off", &remedy);
    let can = adapter.interface();
    can.bring_down().unwrap();
    can.set_ctrlmode(CanCtrlMode::ListenOnly, true).unwrap();
    can.bring_up().unwrap();
    examine(folder.path()).assert_mended("listen_only_off");
}

/// Codes of the protocol for bit rates of 100 to 500 kbit/s.
const CODES: [(&str, u32); 4] = [("S3", 100_000), ("S4", 125_000), ("S5", 250_000), ("S6", 500_000)];

/// Runs `test` with a bus of this bit rate behind the adapter: frames while the adapter is open with it,
/// errors while it is open with another one. Nothing comes at all for `None`.
fn on_bus<T>(adapter: &Adapter, bitrate: Option<u32>, test: impl FnOnce() -> T) -> T {
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut pace = Pace::every(Duration::from_millis(20));
            while !is_over.load(Ordering::SeqCst) {
                if let (Some(bitrate), Some(opened)) = (bitrate, opened(&adapter.commands())) {
                    adapter.send_lines(if opened == bitrate { "t2A580000000000000000\r" } else { "e2bs\r" });
                }
                pace.wait();
            }
        });
        let tested = std::panic::catch_unwind(std::panic::AssertUnwindSafe(test));
        is_over.store(true, Ordering::SeqCst);
        tested.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The bit rate with which the adapter is open, 0 for one that is not in [`CODES`]; `None` while it is
/// closed.
fn opened(commands: &[String]) -> Option<u32> {
    let (mut bitrate, mut is_open) = (0, false);
    for command in commands {
        match command.as_str() {
            "C" => is_open = false,
            "L" | "O" => is_open = true,
            code if code.starts_with('S') => {
                bitrate = CODES.iter().find(|(known, _)| *known == code).map_or(0, |(_, bitrate)| *bitrate);
            }
            _ => {}
        }
    }
    is_open.then_some(bitrate)
}

fn scan(interface: &str, seconds: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.args(["doctor", "--scan", interface, "--seconds", seconds, "--json"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)))
}

/// Asserts that the interface is down, at 500 kbit/s and able to send, as it was plugged in.
fn assert_as_before(adapter: &Adapter) {
    let details = adapter.interface().details().unwrap();
    assert_eq!(details.can.bit_timing.map(|timing| timing.bitrate), Some(500_000));
    let is_listen_only = details.can.ctrl_mode.is_some_and(|modes| modes.has_mode(CanCtrlMode::ListenOnly));
    assert!(!details.is_up && !is_listen_only, "{details:?}");
}

#[test]
fn set_up_11_wrong_bit_rate_is_replaced_by_the_one_that_the_scan_finds() {
    let adapter = require!(Adapter::plug_in());
    let folder = folder(&adapter.name);
    on_bus(&adapter, Some(125_000), || {
        let broken = examine(folder.path());
        broken.assert_found("wrong_bit_rate", &format!("doctor --scan {}", adapter.name));
        let can = adapter.interface();
        can.bring_down().unwrap();
        let before = adapter.commands().len();
        let output = scan(&adapter.name, "2").wait_with_output().unwrap();
        let found = json(&output);
        assert_eq!((output.status.code(), &found["bitrate_bps"]), (Some(0), &125_000.into()), "{found:#}");
        let tried = found["tried"].as_array().unwrap();
        assert!(
            tried[0]["error_frames"].as_u64() > Some(0) && tried[2]["frames"].as_u64() >= Some(5),
            "{tried:#?}"
        );
        assert_as_before(&adapter);
        let commands = adapter.commands().split_off(before);
        assert!(commands.iter().any(|command| command == "L"), "{commands:?}");
        assert!(!commands.iter().any(|command| command == "O"), "never open for sending: {commands:?}");
        can.set_bitrate(125_000, None).unwrap();
        can.bring_up().unwrap();
        let mended = examine(folder.path());
        mended.assert_mended("wrong_bit_rate");
        mended.assert_mended("silent_bus");
    });
}

#[test]
fn scan_that_is_interrupted_leaves_the_interface_as_it_was() {
    let adapter = require!(Adapter::plug_in());
    adapter.interface().bring_down().unwrap();
    on_bus(&adapter, None, || {
        for signal in ["INT", "TERM"] {
            let before = adapter.commands().len();
            let running = scan(&adapter.name, "60");
            wait_until("the first bit rate", || {
                adapter.commands().split_off(before).iter().any(|line| line == "L")
            });
            let kill = format!("kill -{signal} {}", running.id());
            assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
            let output = running.wait_with_output().unwrap();
            assert_eq!((output.status.code(), &json(&output)["verdict"]), (Some(1), &"interrupted".into()));
            assert_as_before(&adapter);
        }
    });
}

#[test]
fn interface_that_is_up_or_has_no_bit_rate_is_not_scanned() {
    let vcan = require!(Vcan::new("vcandrs"));
    let adapter = require!(Adapter::plug_in());
    for (interface, reason) in [
        (adapter.name.as_str(), "it is up, and its bit rate is not changed"),
        (vcan.name, "it is virtual, and has no bit rate"),
        ("lo", "it is not a CAN interface"),
        ("nosuchcan", "there is no interface of that name"),
    ] {
        let output = scan(interface, "1").wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && error.contains(reason), "{interface}: {error}");
    }
    let details = adapter.interface().details().unwrap();
    assert!(details.is_up && vcan.interface().details().unwrap().is_up);
}
