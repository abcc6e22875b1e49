//! The gateway's side of the tests: a session that takes commands over standard input.

use std::io::BufRead;
use std::thread;
use std::time::{Duration, Instant};

use gateway_base::diagnostics::{Diagnostics, Level, Section, Status};
use gateway_base::time::WallStamp;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::velocity::Velocity;
use ros_messages::autoware_adapi_v1_msgs::DoorLayout;
use ros_transport::parameters::{DoorLayouts, Parameters, ServiceContents};
use serde_json::{Value, json};
use signal_gateway::io::process_log;
use signal_gateway::io::ros::session::{
    Durability, Isolation, OutgoingTopic, Recovery, RosSession, RosSettings, Topics, Transport, TypeHashes,
    ZenohSettings,
};
use signal_gateway::process_status::snapshot::TopicSnapshot;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::output::TurnSignalOutput;

use super::{ROLE, autoware_topics, lights};
use crate::support::processor::waited;
use crate::support::waiting::{Bystander, Lateness};

/// Not a test by itself: does nothing unless [`super::Role::start`] started it. One command a line: `turn
/// left 5` publishes with a stamp of 5 s and 1 ns, `turn withdraw` withdraws, `hazard on 5` and `command left
/// 5` likewise; `diagnostics TEXT`, `value TEXT` (diagnostics that end with this text), `velocity 2.5 5`
/// (m/s), `gear reverse 5`, `warn TEXT` (for `/rosout`), `parameters` (others than before), `status`, `stop`;
/// and those of [`lights::send`]. Its log, and that of its network process, are on standard error.
#[test]
fn session_process() {
    let Ok(role) = std::env::var(ROLE) else { return };
    let role: Value = serde_json::from_str(&role).unwrap();
    let (topics, subscriptions) = match role["topics"].as_str() {
        Some("lights") => (light_topics(), lights::subscriptions()),
        Some("autoware") => (autoware_topics::topics(), autoware_topics::subscriptions()),
        Some("vehicle_status") => (vehicle_status_topics(), vec![]),
        Some(_) | None => (Topics::default(), vec![]),
    };
    let networks = role["networks"].as_array().unwrap().iter();
    let alert = Recovery {
        check_interval: Duration::from_millis(200),
        min_rebuild_interval: Duration::from_millis(500),
    };
    let settings = RosSettings {
        node: "gateway_under_test".to_owned(),
        namespace: "/vehicle".to_owned(),
        graph: role["graph"] != false,
        domain_id: role["domain"].as_u64().unwrap().try_into().unwrap(),
        durability: if role["volatile"] == true { Durability::Volatile } else { Durability::TransientLocal },
        only_networks: networks.map(|address| address.as_str().unwrap().parse().unwrap()).collect(),
        hardware_id: "bench".to_owned(),
        topics: if role["rosout"] == true { topics.with(OutgoingTopic::Log, "/rosout") } else { topics },
        services: (role["parameters"] == true).then(|| services(&role)),
        subscriptions,
        recovery: if role["alert"] == true { alert } else { Recovery::default() },
        transport: transport(&role),
        isolation: if role["isolated"] == true {
            Isolation::Process {
                program: env!("CARGO_BIN_EXE_signal-gateway").into(),
                memory_limit_mb: 384,
                supervisor: None,
            }
        } else {
            Isolation::Thread
        },
    };
    let filter = "off,signal_gateway=info";
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(false).init();
    let is_isolated = matches!(settings.isolation, Isolation::Process { .. });
    let mut beside = Beside::default();
    let session = RosSession::start(settings).unwrap();
    let inbox = session.inbox();
    thread::spawn(move || lights::print_arrivals(&inbox));
    println!("\n{}", json!({"event": "ready"}));
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        match line.as_str() {
            "status" => {
                let status = session.status();
                let Lateness { worst, total } = beside.look();
                println!(
                    "{}",
                    json!({"event": "status", "running": status.running, "rebuilds": status.seen.rebuilds,
                        "readers": readers(&status.outgoing, |name| REPORTS.contains(&name)),
                        "lights": readers(&status.outgoing, |name| !REPORTS.contains(&name)),
                        "commands": readers(&status.outgoing, |name| name.starts_with("/commanded_")),
                        "incoming": status.incoming.iter().map(|topic| json!({"writers": topic.writers,
                            "received": topic.received, "undecodable": topic.undecodable,
                            "rejected": topic.rejected_groups})).collect::<Vec<_>>(),
                        "missing": status.seen.missing_peers, "probe": status.seen.has_probe,
                        "isolated": is_isolated, "worst_us": worst.as_micros(), "total_us": total.as_micros(),
                        "waited_us": waited(std::process::id()).as_micros(),
                        "write_errors": status.seen.write_errors + status.send_errors,
                        "unanswered": status.seen.unanswered_requests,
                        "overtaken": status.overtaken_lights,
                        "up": status.network.is_up, "restarts": status.network.restarts,
                        "taken_anew": status.network.taken_anew, "peers": status.network.peers,
                        "recent_ends": status.network.recent_ends,
                        "burden": status.network.burden.map(|burden| format!("{burden:?}")),
                        "echo": status.network.has_echo, "links": status.network.links,
                        "shared": status.network.shared_topics.iter().map(ToString::to_string).collect::<Vec<_>>(),
                        "failure": status.network.last_failure.map(|failure| failure.to_string())})
                );
            }
            "stop" => {
                let (stopping, requested_at) = (Bystander::start(), Instant::now());
                session.stop();
                let (took, Lateness { worst, total }) = (requested_at.elapsed(), stopping.finish());
                println!(
                    "{}",
                    json!({"event": "stopped", "millis": took.as_millis(), "worst_us": worst.as_micros(),
                        "total_us": total.as_micros(), "waited_us": waited(std::process::id()).as_micros()})
                );
                return;
            }
            "parameters" => {
                let mut parameters = Parameters::default();
                parameters.set("reports.rate_hz", 20);
                session.set_parameters(parameters);
            }
            command if command.starts_with("warn ") => {
                let text = command.trim_start_matches("warn ");
                let (subject, _) = text.split_once(": ").unwrap_or((text, ""));
                process_log::warn_others(tracing::Level::WARN, subject, text);
            }
            command if command.starts_with("lights") => lights::send(&session, command),
            command => session.send(&output(command)),
        }
    }
}

/// A thread of this process that only sleeps.
struct Beside {
    thread: Bystander,
    so_far: Lateness,
}

impl Default for Beside {
    fn default() -> Self {
        Self { thread: Bystander::start(), so_far: Lateness::default() }
    }
}

impl Beside {
    /// How late it was from the start until now.
    fn look(&mut self) -> Lateness {
        let Lateness { worst, total } = std::mem::replace(&mut self.thread, Bystander::start()).finish();
        self.so_far = Lateness { worst: self.so_far.worst.max(worst), total: self.so_far.total + total };
        self.so_far
    }
}

fn transport(role: &Value) -> Transport {
    let Some(config) = role["zenoh"].as_str() else { return Transport::Dds };
    let type_hashes = if role["humble"] == true { TypeHashes::NotSupported } else { TypeHashes::Rihs01 };
    Transport::Zenoh(ZenohSettings { config: Some(config.to_owned()), type_hashes })
}

fn services(role: &Value) -> ServiceContents {
    let mut parameters = Parameters::default();
    parameters.set("use_sim_time", true);
    parameters.set("ros.domain_id", role["domain"].as_i64().unwrap());
    parameters.set("ros.only_networks", vec!["127.0.0.1".to_owned()]);
    let door = DoorLayout {
        roles: vec![DoorLayout::GET_ON, DoorLayout::GET_OFF],
        description: "front left".to_owned(),
    };
    let doors = DoorLayouts { service: "/vehicle/doors/layout".to_owned(), doors: vec![door] };
    ServiceContents { parameters, doors: Some(doors) }
}

/// Topics that are always written.
const REPORTS: [&str; 4] = [
    "/vehicle/status/turn_indicators_status",
    "/vehicle/status/hazard_lights_status",
    "/diagnostics",
    "/rosout",
];

fn light_topics() -> Topics {
    let mut topics = Topics::default();
    topics.lights = lights::outlets();
    topics
}

fn vehicle_status_topics() -> Topics {
    [OutgoingTopic::VelocityReport, OutgoingTopic::GearReport]
        .into_iter()
        .fold(Topics::default(), |topics, topic| topics.with(topic, topic.row().default_name))
}

fn readers(topics: &[TopicSnapshot], is_requested: impl Fn(&str) -> bool) -> Vec<u64> {
    topics.iter().filter(|topic| is_requested(&topic.name)).map(|topic| topic.peers).collect()
}

fn output(command: &str) -> Output {
    let arguments: Vec<&str> = command.split(' ').collect();
    let stamp = || WallStamp::from_nanos(arguments[2].parse::<i64>().unwrap() * 1_000_000_000 + 1);
    let turn = |step| Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step));
    let hazard = |step| Output::VehicleLights(VehicleLightsOutput::HazardLights(step));
    match (arguments[0], arguments[1]) {
        ("turn", "withdraw") => turn(Step::Withdraw),
        ("turn", "left") => turn(Step::Publish(TurnIndicators::EnableLeft, stamp())),
        ("turn", "right") => turn(Step::Publish(TurnIndicators::EnableRight, stamp())),
        ("turn", "off") => turn(Step::Publish(TurnIndicators::Disable, stamp())),
        ("hazard", "withdraw") => hazard(Step::Withdraw),
        ("hazard", "on") => hazard(Step::Publish(HazardLights::Enable, stamp())),
        ("command", "left") => {
            Output::TurnSignal(TurnSignalOutput::TurnCommand { command: TurnCommand::Left, stamp: stamp() })
        }
        ("command", "right") => {
            Output::TurnSignal(TurnSignalOutput::TurnCommand { command: TurnCommand::Right, stamp: stamp() })
        }
        ("command", "disable") => Output::TurnSignal(TurnSignalOutput::TurnCommand {
            command: TurnCommand::Disable,
            stamp: stamp(),
        }),
        ("command", "none") => Output::TurnSignal(TurnSignalOutput::TurnCommand {
            command: TurnCommand::NoCommand,
            stamp: stamp(),
        }),
        ("command", "hazard") => Output::TurnSignal(TurnSignalOutput::HazardCommand {
            command: HazardCommand::Enable,
            stamp: stamp(),
        }),
        ("command", "no_hazard") => Output::TurnSignal(TurnSignalOutput::HazardCommand {
            command: HazardCommand::Disable,
            stamp: stamp(),
        }),
        ("velocity", speed) => {
            let velocity = Velocity { longitudinal_mps: speed.parse().unwrap(), heading_rate_radps: 0.0 };
            Output::VehicleStatus(VehicleStatusOutput::Velocity(Step::Publish(velocity, stamp())))
        }
        ("gear", "reverse") => {
            Output::VehicleStatus(VehicleStatusOutput::Gear(Step::Publish(Gear::Reverse, stamp())))
        }
        ("value", text) => {
            let values = vec![("bus", text.to_owned())];
            let statuses = vec![status(Level::Ok, "", values)];
            let diagnostics = Diagnostics { node: "gw".to_owned(), statuses, refresh: true };
            Output::Diagnostics { diagnostics, stamp: WallStamp::from_nanos(0) }
        }
        ("diagnostics", text) => {
            let values = vec![("bus", "can0".to_owned()), ("", "größer".to_owned())];
            let statuses = vec![status(Level::Error, text, values), status(Level::Stale, "", vec![])];
            let diagnostics = Diagnostics { node: "gw".to_owned(), statuses, refresh: true };
            Output::Diagnostics { diagnostics, stamp: WallStamp::from_nanos(-1) }
        }
        other => panic!("unknown command {other:?}"),
    }
}

/// A status with a message that no flow reports.
fn status(level: Level, message: &str, values: Vec<(&'static str, String)>) -> Status {
    static SECTION: Section = Section { names: &["turn"], messages: &[] };
    Status { level, message: message.to_owned(), ..Status::new(&SECTION, "turn", &[], values) }
}
