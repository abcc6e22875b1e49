//! Commands over ROS 2 become frames on a real CAN interface: the built binary, the shipped vehicles that
//! take commands (and an invented one), an independent sender of commands, and the simulated vehicle.
//!
//! The guest of `tests/with-vcan` has one slow CPU: nothing here depends on how fast something comes. What is
//! measured is printed.

mod bytes;
pub(crate) mod car;
mod cases;
mod clocks;
mod closed_loop;
pub(crate) mod commander;
mod counters;
mod killed;
mod queue;
pub(crate) mod recording;
mod rhythm;
mod round_trip;
mod stops;
pub(crate) mod vehicles;

use gateway_base::time::WallStamp;
use gateway_core::gateway::event::Output;
use signal_gateway::io::ros::session::{OutgoingTopic, RosSession, RosSettings, Topics};
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::output::TurnSignalOutput;

use crate::support::command_vehicle::{DBC, MODE, PROFILE, request_text};
use crate::support::peer::domain;
use crate::support::prerequisite::require;
use crate::support::process::{self, Folder, Process};
use crate::support::vcan::{self, Sender, Vcan};
use crate::support::waiting::{Pace, wait_until};
use recording::{BusTime, Recording};

/// The command message of the vehicle.
const CMD: u32 = 304;

/// `STATE` of the vehicle: the control mode is in bits 5 and 6, lights in those below.
const STATE: u32 = 560;
const MANUAL: [u8; 8] = [0; 8];
const AUTONOMOUS: [u8; 8] = [1 << 5, 0, 0, 0, 0, 0, 0, 0];
const AUTONOMOUS_LEFT: [u8; 8] = [1 << 5 | 1, 0, 0, 0, 0, 0, 0, 0];
const VELOCITY_ONLY: [u8; 8] = [2 << 5, 0, 0, 0, 0, 0, 0, 0];

/// The gateway's configuration. Everything is valid for as long as a slow machine may need.
fn folder(interface: &str, tx: &str) -> (Folder, u16) {
    let domain = domain();
    let ros = process::ros_in(domain);
    let text = format!(
        "profile = \"bench.toml\"\n[can.body]\ninterface = \"{interface}\"\n[command]\ntx = \"{tx}\"\n\
         control_mode = \"signal\"\nturn_timeout_ms = 60000\nhazard_timeout_ms = 60000\n\
         on_shutdown = \"hazard\"\n{ros}"
    );
    let folder = Folder::with_configuration(&text);
    folder.write("bench.toml", &format!("{PROFILE}{MODE}").replace("timeout_ms = 500", "timeout_ms = 60000"));
    folder.write("bench.dbc", DBC);
    (folder, domain)
}

/// Autoware, as far as the gateway can tell.
struct Commander(RosSession);

impl Commander {
    fn start(domain_id: u16) -> Self {
        let topics = Topics::default()
            .with(OutgoingTopic::TurnIndicatorsReport, "")
            .with(OutgoingTopic::HazardLightsReport, "")
            .with(OutgoingTopic::TurnCommand, "/control/command/turn_indicators_cmd")
            .with(OutgoingTopic::HazardCommand, "/control/command/hazard_lights_cmd");
        let only_networks = vec!["127.0.0.1".parse().unwrap()];
        let node = "commander".to_owned();
        let settings = RosSettings { node, domain_id, only_networks, topics, ..RosSettings::default() };
        Self(RosSession::start(settings).unwrap())
    }

    /// Sends it again and again, as command topics require, until `done`.
    fn send_until(&self, turn: TurnCommand, hazard: HazardCommand, done: impl Fn() -> bool) {
        let mut pace = Pace::every(std::time::Duration::from_millis(50));
        wait_until(format!("{turn} and {hazard} to come through"), || {
            let stamp = WallStamp::from_nanos(vcan::wall());
            self.0.send(&Output::TurnSignal(TurnSignalOutput::TurnCommand { command: turn, stamp }));
            self.0.send(&Output::TurnSignal(TurnSignalOutput::HazardCommand { command: hazard, stamp }));
            pace.wait();
            done()
        });
    }
}

/// The request of each frame since the mark.
fn requests(recording: &Recording, mark: BusTime) -> Vec<&'static str> {
    recording.since(mark, CMD).iter().map(|frame| request_text(&frame.data)).collect()
}

/// Waits until the newest frame since the mark requests this.
fn wait_for(recording: &Recording, mark: BusTime, request: &str) {
    recording.wait(mark, CMD, request, |frames| {
        frames.last().is_some_and(|last| request_text(&last.data) == request)
    });
}

/// Counter without a gap and checksum right, from the first frame to the last. (`request_text` has looked at
/// all other bits.)
fn check_every_byte(recording: &Recording) {
    for (index, frame) in recording.since(BusTime::START, CMD).iter().enumerate() {
        assert_eq!(usize::from(frame.data[6] & 15), index % 16, "frame {index}");
        assert_eq!(frame.data[7], j1850(&frame.data[..7]), "frame {index}");
    }
}

/// CRC-8 SAE J1850, bit by bit.
pub(crate) fn j1850(data: &[u8]) -> u8 {
    let step = |crc: u8| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D };
    !data.iter().fold(0xFF, |crc, byte| (0..8).fold(crc ^ byte, |crc, _| step(crc)))
}

#[test]
fn commands_become_frames_within_the_control_mode_and_a_stop_has_its_last_one() {
    let vcan = require!(Vcan::new("vcan-cmd"));
    let mut recording = Recording::of(vcan.name);
    let (folder, domain) = folder(vcan.name, "on");
    let vehicle = Sender::start(&vcan, &[(STATE, MANUAL)]);
    let autoware = Commander::start(domain);
    let mut gateway = Process::run(&folder);
    let command = |turn, hazard, expected: &str| {
        let mark = BusTime::now();
        autoware.send_until(turn, hazard, || requests(&recording, mark).last() == Some(&expected));
    };
    // In manual mode frames go out, and no command gives them authority.
    wait_for(&recording, BusTime::START, "-");
    autoware.send_until(TurnCommand::Left, HazardCommand::Enable, || recording.count(CMD) > 20);
    assert!(requests(&recording, BusTime::START).iter().all(|request| *request == "-"));
    vehicle.set(STATE, AUTONOMOUS);
    command(TurnCommand::Left, HazardCommand::Disable, "left");
    vehicle.set(STATE, AUTONOMOUS_LEFT);
    gateway.wait_for_log("turn_indicators: left");
    command(TurnCommand::Left, HazardCommand::Enable, "hazard");
    command(TurnCommand::Left, HazardCommand::Disable, "left");
    command(TurnCommand::Right, HazardCommand::Disable, "right");
    vehicle.set(STATE, VELOCITY_ONLY);
    command(TurnCommand::Right, HazardCommand::Enable, "hazard, any turn");
    // A link that was down: the present state again, with the next counter.
    vcan.bring_down();
    gateway.wait_for_log("nothing can be sent on body");
    let mark = BusTime::now();
    vcan.bring_up();
    wait_for(&recording, mark, "hazard, any turn");
    vehicle.set(STATE, AUTONOMOUS);
    command(TurnCommand::Left, HazardCommand::Disable, "left");

    let mark = BusTime::now();
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
    recording.finish();
    let last = requests(&recording, mark);
    assert_eq!(last.last().copied(), Some("hazard"), "{last:?}");
    assert!(last.iter().rev().skip(1).all(|request| *request == "left"), "one last frame: {last:?}");
    check_every_byte(&recording);
    assert!(!gateway.log().iter().any(|line| line.contains("somebody else")), "own frames are not foreign");
}

#[test]
fn a_dry_run_is_reported_and_leaves_the_bus_alone_and_a_conflicting_sender_is_found() {
    let vcan = require!(Vcan::new("vcan-dry"));
    let vehicle = Sender::start(&vcan, &[(STATE, AUTONOMOUS)]);
    {
        let mut recording = Recording::of(vcan.name);
        let (folder, domain) = folder(vcan.name, "off");
        let autoware = Commander::start(domain);
        let mut gateway = Process::run(&folder);
        let would = || gateway.log().iter().filter(|line| line.contains("would send 130#")).count();
        autoware.send_until(TurnCommand::Left, HazardCommand::Disable, || would() >= 2);
        gateway.stop("TERM");
        recording.finish();
        assert_eq!(recording.count(CMD), 0);
    }
    let (folder, _) = folder(vcan.name, "on");
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("control mode AUTONOMOUS");
    vehicle.set(CMD, [0xFD, 0, 0, 0, 0, 0, 0, 0]);
    gateway.wait_for_log("conflicting sender of CMD");
    gateway.stop("TERM");
}
