//! Tests the topics of configurations.

use std::path::Path;
use std::time::Duration;

use super::*;
use crate::config::files::TestFiles;
use crate::config::{Overrides, load};
use gateway_core::command::arbitration::ArbitrationRules;
use gateway_core::command::feedback_monitor::FeedbackLimits;
use gateway_core::command::settings::{CommandBinding, CommandSettings, Transmit};

const CROSSROADS: &str = include_str!("../../../../tests/maps/crossroads.osm");

/// Returns the command topics, the number of subscriptions, and whether Autoware's own commands are among
/// them.
fn graph(keys: &str) -> ([Option<String>; 2], usize, bool) {
    let text = format!("[turn_signal]\nmap = \"map.osm\"\n{keys}");
    let files = TestFiles(&[("gateway.toml", &text), ("map.osm", CROSSROADS)]);
    let settings = load(&files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
    let (topics, read) = (topics(&settings), subscriptions(&settings));
    let own = |subscription: &Subscription| {
        matches!(subscription.kind, SubscriptionKind::OwnTurnCommand | SubscriptionKind::OwnHazardCommand)
    };
    let commands = [OutgoingTopic::TurnCommand, OutgoingTopic::HazardCommand];
    (commands.map(|topic| topics.name(topic).map(str::to_owned)), read.len(), read.iter().any(own))
}

#[test]
fn commands_are_written_or_autowares_own_are_read_never_both() {
    let commands = ["/planning/turn_indicators_cmd", "/planning/hazard_lights_cmd"];
    let commands = commands.map(|name| Some(name.to_owned()));
    assert_eq!(graph("enabled = true"), (commands, 15, false));
    assert_eq!(graph("shadow = true"), ([None, None], 17, true));
    assert_eq!(graph(""), ([None, None], 0, false));
    let less = "shadow = true\ninputs.planning_factors = \"\"\ninputs.own_hazard_command = \"\"";
    assert_eq!(graph(less), ([None, None], 8, true));
}

const DBC: &str = "BO_ 256 LAMPS: 8 X\n SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X\n\
    BO_ 257 DRIVE: 8 X\n SG_ WHEEL : 0|16@1- (0.1,0) [0|0] \"\" X\n SG_ GEAR : 16|4@1+ (1,0) [0|15] \"\" X\n \
    SG_ MODE : 20|2@1+ (1,0) [0|3] \"\" X\n SG_ DOOR : 22|1@1+ (1,0) [0|1] \"\" X\n";
const PROFILE: &str = "name = \"Car\"\n[bus.can0]\ndbc = \"car.dbc\"\n\
    [turn]\nsignal = \"LAMPS.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
    [hazard]\nfrom = \"not_visible\"\n[message.LAMPS]\ntimeout_ms = 500\n";

const DRIVE: &str = "[message.DRIVE]\ntimeout_ms = 500\n";

#[test]
fn the_status_of_the_vehicle_has_the_topics_that_the_profile_describes() {
    let sections = [
        (
            "autoware_vehicle_msgs/msg/VelocityReport",
            "[velocity]\nheading_rate_unknown = \"zero\"\n[[velocity.source]]\nname = \"speed\"\nkind = \"speed\"\n\
             speed = { signal = \"DRIVE.WHEEL\", unit = \"km/h\", positive = \"forward\", valid = [\"0..=5000\"] }\n",
        ),
        (
            "autoware_vehicle_msgs/msg/SteeringReport",
            "[steering]\nwheel = { signal = \"DRIVE.WHEEL\", unit = \"deg\", positive = \"left\", \
             valid = [\"-5000..=5000\"] }\n",
        ),
        (
            "autoware_vehicle_msgs/msg/GearReport",
            "[gear]\nsignal = \"DRIVE.GEAR\"\npark = [0]\ndrive = [1]\n",
        ),
        (
            "autoware_vehicle_msgs/msg/ControlModeReport",
            "[control_mode]\nsignal = \"DRIVE.MODE\"\nautonomous = [1]\nmanual = [0]\n",
        ),
        (
            "autoware_adapi_v1_msgs/msg/DoorStatusArray",
            "[[doors.door]]\nname = \"front left\"\nsignal = \"DRIVE.DOOR\"\nopen = [1]\nclosed = [0]\n",
        ),
    ];
    let written = |profile: &str, gateway: &str| -> Vec<&str> {
        let gateway = format!("profile = \"car.toml\"\n[can.can0]\ninterface = \"can0\"\n{gateway}");
        let files = TestFiles(&[("gateway.toml", &gateway), ("car.toml", profile), ("car.dbc", DBC)]);
        let settings = load(&files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
        let topics = topics(&settings);
        let topics = topics.named().filter(|(topic, _)| topic.row().flow == TopicFlow::VehicleStatus);
        topics.map(|(topic, _)| topic.row().type_name).collect()
    };
    assert_eq!(written(PROFILE, ""), [""; 0]);
    for (message, section) in &sections {
        assert_eq!(written(&format!("{PROFILE}{DRIVE}{section}"), ""), [*message]);
    }
    let all = format!("{PROFILE}{DRIVE}{}", sections.map(|(_, section)| section).concat());
    let unnamed = "[ros.topics]\nsteering_status = \"\"\n";
    assert_eq!(
        written(&all, unnamed),
        [
            "autoware_vehicle_msgs/msg/VelocityReport",
            "autoware_vehicle_msgs/msg/GearReport",
            "autoware_vehicle_msgs/msg/ControlModeReport",
            "autoware_adapi_v1_msgs/msg/DoorStatusArray"
        ]
    );
}

#[test]
fn commands_for_the_vehicle_are_read_where_they_come_from() {
    let second = Duration::from_secs(1);
    let read = |source, mode_from| {
        let settings = CommandSettings {
            source,
            transmit: Transmit::On,
            mode_from,
            turn_timeout: second,
            hazard_timeout: second,
            rules: ArbitrationRules::default(),
            limits: FeedbackLimits { warn: second, error: second },
        };
        let names =
            [("turn_indicators_cmd", "/turn"), ("hazard_lights_cmd", "/hazard"), ("control_mode", "/mode")];
        let topics = TopicNames(names.into_iter().map(|(key, name)| (key, name.to_owned())).collect());
        let config = CommandConfig { settings, binding: CommandBinding::default(), topics };
        command_subscriptions(&config).into_iter().map(|read| (read.name, read.kind)).collect::<Vec<_>>()
    };
    let turn = ("/turn".to_owned(), SubscriptionKind::TurnCommand);
    let hazard = ("/hazard".to_owned(), SubscriptionKind::HazardCommand);
    let mode = ("/mode".to_owned(), SubscriptionKind::ControlMode);
    let topic = ModeFrom::Topic { timeout: second };
    assert_eq!(read(CommandSource::Topic, topic), [turn, hazard.clone(), mode]);
    assert_eq!(read(CommandSource::Decider, ModeFrom::Signal), [hazard]);
}
