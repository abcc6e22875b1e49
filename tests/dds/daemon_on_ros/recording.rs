//! A recording that `run` plays: commands over ROS 2 are followed in a dry run, with what is wrong on their
//! topics.

use std::time::{Duration, SystemTime};

use gateway_base::time::WallStamp;
use gateway_core::gateway::event::Output;
use signal_gateway::io::ros::session::{OutgoingTopic, RosSession, RosSettings, Topics};
use turn_signal::light_command::TurnCommand;
use turn_signal::output::TurnSignalOutput;

use crate::support::command_vehicle::{DBC, MODE, PROFILE};
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process, ros_in};
use crate::support::waiting::{Pace, wait_until};

const TURN_COMMANDS: &str = "/control/command/turn_indicators_cmd";

/// A gateway on ten seconds of a vehicle in control mode AUTONOMOUS, again and again.
fn on_recording(domain: u16) -> (Folder, Process) {
    let folder = Folder::with_configuration(&format!(
        "profile = \"bench.toml\"\nsource = \"recording\"\n[can.body]\ninterface = \"can0\"\n\
         [recording]\nfile = \"drive.log\"\nrepeat = true\n[command]\ntx = \"on\"\ncontrol_mode = \"signal\"\n{}",
        ros_in(domain)
    ));
    folder.write("bench.toml", &format!("{PROFILE}{MODE}"));
    folder.write("bench.dbc", DBC);
    let frame = |tenth: u32| format!("(17.{tenth:02}) can0 230#20000000\n");
    folder.write("drive.log", &(0..100).step_by(10).map(frame).collect::<String>());
    let gateway = Process::run(&folder);
    (folder, gateway)
}

#[test]
fn commands_are_followed_in_the_dry_run_of_a_recording() {
    let domain = domain();
    let (_folder, mut gateway) = on_recording(domain);
    let autoware = RosSession::start(RosSettings {
        node: "autoware".to_owned(),
        domain_id: domain,
        only_networks: vec!["127.0.0.1".parse().unwrap()],
        topics: Topics::default().with(OutgoingTopic::TurnCommand, TURN_COMMANDS),
        ..RosSettings::default()
    })
    .unwrap();
    let mut pace = Pace::every(Duration::from_millis(50));
    wait_until("a command that is followed", || {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
        let stamp = WallStamp::from_nanos(now.as_nanos().try_into().unwrap());
        autoware
            .send(&Output::TurnSignal(TurnSignalOutput::TurnCommand { command: TurnCommand::Left, stamp }));
        pace.wait();
        gateway.log().iter().any(|line| line.contains("left commanded, not sent: dry run"))
    });
    gateway.wait_for_log("would send 130#");
    autoware.stop();
}

#[test]
fn a_publisher_of_another_type_is_named_with_both_types() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let (_folder, mut gateway) = on_recording(domain);
    let topic = format!("rt{TURN_COMMANDS}");
    let _writer = cyclone.start("writer.py", domain, &["text", &topic, "reliable", "volatile"]);
    gateway.wait_for_log(
        "/control/command/turn_indicators_cmd is published as std_msgs/msg/String, but read here as \
         autoware_vehicle_msgs/msg/TurnIndicatorsCommand: they are not connected",
    );
}
