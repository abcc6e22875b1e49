//! Commands over ROS 2 become frames on a real CAN interface: the built binary, the shipped vehicles that
//! take commands (and an invented one), an independent sender of commands, and the simulated vehicle.
//!
//! Runs where `tests/with-vcan` has prepared the ground (its header tells how) and
//! `SIGNAL_GATEWAY_PEER_PYTHON` names a Python with `cyclonedds==11.0.1` and `cantools==45.1.0`; says what it
//! leaves out elsewhere. The guest of `tests/with-vcan` has one slow CPU: nothing here depends on how fast
//! something comes, except that a stop takes less than a second. What is measured is printed.

#![cfg(feature = "ros")]
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod adapter;
#[path = "../command_model/bench.rs"]
#[allow(dead_code)] // the vehicle is wanted, not its virtual time
mod bench;
mod bytes;
mod car;
mod cases;
mod closed_loop;
mod commander;
mod counters;
#[path = "../vcan_gateway/interface.rs"]
#[allow(dead_code)]
mod interface;
mod killed;
mod lines;
#[path = "../vcan_gateway/process.rs"]
#[allow(dead_code)]
mod process;
mod queue;
mod recording;
mod rhythm;
#[path = "../daemon_on_ros/drive/script.rs"]
#[allow(dead_code)] // what the scenario expects is judged elsewhere
mod script;
mod traffic;
mod vehicles;

use signal_gateway::core::event::Output;
use signal_gateway::core::time::WallStamp;
use signal_gateway::core::turn_signal::signal::{Hazard, Signal};
use signal_gateway::io::ros::session::{RosSession, RosSettings, Topics};

use bench::{DBC, PROFILE};
use interface::{Sender, Vcan};
use process::{Folder, Process};
use traffic::{CMD, Traffic};

/// `STATE` of the vehicle: the control mode is in bits 5 and 6, lights in those below.
const STATE: u32 = 560;
const MANUAL: [u8; 8] = [0; 8];
const AUTONOMOUS: [u8; 8] = [1 << 5, 0, 0, 0, 0, 0, 0, 0];
const AUTONOMOUS_LEFT: [u8; 8] = [1 << 5 | 1, 0, 0, 0, 0, 0, 0, 0];
const VELOCITY_ONLY: [u8; 8] = [2 << 5, 0, 0, 0, 0, 0, 0, 0];

/// The gateway's configuration. Everything is believed for as long as a slow machine may need.
fn folder(interface: &str, tx: &str) -> (Folder, u16) {
    let ros = process::ros();
    let domain = ros.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
    let text = format!(
        "profile = \"bench.toml\"\n[can.body]\ninterface = \"{interface}\"\n[command]\ntx = \"{tx}\"\n\
         control_mode = \"signal\"\nturn_timeout_ms = 60000\nhazard_timeout_ms = 60000\n\
         at_stop = \"hazard\"\n{ros}"
    );
    let folder = Folder::with_configuration(&text);
    folder.write("bench.toml", &PROFILE.replace("timeout_ms = 500", "timeout_ms = 60000"));
    folder.write("bench.dbc", DBC);
    (folder, domain)
}

/// Autoware, as far as the gateway can tell.
struct Commander(RosSession);

impl Commander {
    fn start(domain_id: u16) -> Self {
        let topics = Topics {
            turn_indicators: String::new(),
            hazard_lights: String::new(),
            turn_command: Some("/control/command/turn_indicators_cmd".to_owned()),
            hazard_command: Some("/control/command/hazard_lights_cmd".to_owned()),
            ..Topics::default()
        };
        let only_networks = vec!["127.0.0.1".parse().unwrap()];
        let node = "commander".to_owned();
        let settings = RosSettings { node, domain_id, only_networks, topics, ..RosSettings::default() };
        Self(RosSession::start(settings).unwrap())
    }

    /// Says it again and again, as command topics are to be, until `done`.
    fn say_until(&self, turn: Signal, hazard: Hazard, done: impl Fn() -> bool) {
        let asked = std::time::Instant::now();
        while !done() {
            assert!(asked.elapsed() < process::DEADLINE, "{turn} {hazard} never came through");
            let stamp = WallStamp::from_nanos(interface::wall());
            self.0.send(&Output::TurnCommand { command: turn, stamp });
            self.0.send(&Output::HazardCommand { command: hazard, stamp });
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    }
}

#[test]
fn commands_become_frames_within_the_control_mode_and_a_stop_has_its_last_one() {
    let test = "commands_become_frames_within_the_control_mode_and_a_stop_has_its_last_one";
    let Some(vcan) = Vcan::for_test(test, "vcan-cmd") else { return };
    let traffic = Traffic::of(&vcan);
    let (folder, domain) = folder(vcan.name, "on");
    let vehicle = Sender::start(&vcan, &[(STATE, MANUAL)]);
    let autoware = Commander::start(domain);
    let mut gateway = Process::run(&folder);
    let say = |turn, hazard, asked: &str| {
        let mark = traffic.mark();
        autoware.say_until(turn, hazard, || traffic.asked_since(mark) == Some(asked));
    };
    // In manual mode frames go out, and no command gives them authority.
    traffic.wait_for("-");
    autoware.say_until(Signal::Left, Hazard::Enable, || traffic.count() > 20);
    assert!(traffic.all_asked().iter().all(|asked| *asked == "-"));
    vehicle.set(STATE, AUTONOMOUS);
    say(Signal::Left, Hazard::Disable, "left");
    vehicle.set(STATE, AUTONOMOUS_LEFT);
    gateway.wait_for_log("turn_indicators: ENABLE_LEFT");
    say(Signal::Left, Hazard::Enable, "hazard");
    say(Signal::Left, Hazard::Disable, "left");
    say(Signal::Right, Hazard::Disable, "right");
    vehicle.set(STATE, VELOCITY_ONLY);
    say(Signal::Right, Hazard::Enable, "hazard, any turn");
    // A link that was down: the present state again, with the next counter.
    vcan.bring_down();
    gateway.wait_for_log("nothing can be sent on body");
    let mark = traffic.mark();
    vcan.bring_up();
    traffic.wait_since(mark, "hazard, any turn");
    vehicle.set(STATE, AUTONOMOUS);
    say(Signal::Left, Hazard::Disable, "left");

    let mark = traffic.mark();
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
    let last = traffic.after_silence(mark);
    assert_eq!(last.last().copied(), Some("hazard"), "{last:?}");
    assert!(last.iter().rev().skip(1).all(|asked| *asked == "left"), "one last frame: {last:?}");
    traffic.check_every_byte();
    assert!(!gateway.log().iter().any(|line| line.contains("somebody else")), "own frames are not foreign");
}

#[test]
fn a_dry_run_is_told_and_leaves_the_bus_alone_and_somebody_elses_commands_are_found() {
    let test = "a_dry_run_is_told_and_leaves_the_bus_alone_and_somebody_elses_commands_are_found";
    let Some(vcan) = Vcan::for_test(test, "vcan-dry") else { return };
    let vehicle = Sender::start(&vcan, &[(STATE, AUTONOMOUS)]);
    {
        let traffic = Traffic::of(&vcan);
        let (folder, domain) = folder(vcan.name, "off");
        let autoware = Commander::start(domain);
        let mut gateway = Process::run(&folder);
        let would = || gateway.log().iter().filter(|line| line.contains("would send 130#")).count();
        autoware.say_until(Signal::Left, Hazard::Disable, || would() >= 2);
        gateway.stop("TERM");
        assert_eq!(traffic.count(), 0);
    }
    let (folder, _) = folder(vcan.name, "on");
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("control mode AUTONOMOUS");
    vehicle.set(CMD, [0xFD, 0, 0, 0, 0, 0, 0, 0]);
    gateway.wait_for_log("somebody else sends CMD as well");
    gateway.stop("TERM");
}
