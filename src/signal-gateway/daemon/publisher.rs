//! The publisher on ROS 2, if it is built in and enabled.

use std::path::PathBuf;
use std::sync::Arc;

use super::ros_environment::{self, RosEnvironmentError};
use crate::config::Settings;
use crate::config::gateway::command::CommandConfig;
use crate::config::gateway::topic_names::TopicNames;
use crate::config::gateway::turn_signal::TurnSignalConfig;
use crate::config::ros_names::{NodeNames, Remapping};
use crate::io::ros::inbox::Inbox;
use crate::io::ros::reception::IncomingStatus;
use crate::io::ros::session::{RosError, RosSession, RosStatus};
use crate::io::ros::settings::{Isolation, RosSettings};
use crate::io::ros::topics::{
    LightsTopicSettings, OUTGOING, OutgoingRow, OutgoingTopic, Subscription, SubscriptionKind, TopicFlow,
    TopicKey, Topics,
};
use crate::process_status::network::NetworkState;
use crate::process_status::snapshot::{RosSnapshot, TopicSnapshot};
use gateway_base::near_miss::mistyped;
use gateway_base::time::millis;
use gateway_core::command::settings::{CommandSource, ModeFrom};
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::doors::Door;
use ros_messages::autoware_adapi_v1_msgs::DoorLayout;
use ros_transport::parameters::{DoorLayouts, Parameters, ServiceContents};
use ros_transport::settings::Recovery;
use turn_signal::planner_input::FactorTopic;

/// Service that reports the layout of the doors.
const DOOR_LAYOUT: &str = "/vehicle/doors/layout";

/// Publishes outputs, or nothing if ROS 2 is disabled.
#[derive(Debug)]
pub struct Publisher {
    session: Option<RosSession>,
    domain_id: u16,
}

/// Reason why nothing can be published.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // see the texts
pub enum PublisherError {
    #[error(transparent)]
    Environment(#[from] RosEnvironmentError),
    #[error("{0} would be both written and read by this node; give each topic its own name")]
    Loop(String),
    #[error(
        "this build has no ROS 2; build it with the feature `jazzy` or `humble`, or set [ros] enabled = false"
    )]
    NotBuilt,
    #[error(transparent)]
    Ros(#[from] RosError),
}

impl Publisher {
    /// Joins the ROS graph, unless the configuration disables it.
    pub fn start(settings: &Settings) -> Result<Self, PublisherError> {
        if !settings.ros.enabled {
            return Ok(Self { session: None, domain_id: 0 });
        }
        for (Remapping { from, to }, meant) in unused_rules(settings) {
            let reason = format!("-r {from}:={to} has no effect: this node has no topic {from}");
            // Launch files contain rules for all their nodes.
            match meant {
                Some(meant) => tracing::warn!("{reason}; did you mean {meant}?"),
                None => tracing::info!("{reason}"),
            }
        }
        let ros = ros_settings(settings)?;
        if let Some(name) = loop_topic(&ros) {
            return Err(PublisherError::Loop(name));
        }
        if !ros_transport::IS_BUILT_IN {
            return Err(PublisherError::NotBuilt);
        }
        let domain_id = ros.domain_id;
        Ok(Self { session: Some(RosSession::start(ros)?), domain_id })
    }

    /// Passes an output to the session. Never blocks.
    pub fn send(&self, output: &Output) {
        self.session.iter().for_each(|session| session.send(output));
    }

    /// Updates the parameters of the node to another configuration.
    pub fn show_configuration(&self, settings: &Settings) {
        if let Some(session) = &self.session {
            session.set_parameters(parameters(settings, self.domain_id));
        }
    }

    /// Returns true while publishing works or is disabled.
    pub fn is_healthy(&self) -> bool {
        self.session.as_ref().is_none_or(RosSession::is_running)
    }

    /// Returns the domain and its transport, as text.
    pub fn graph(&self) -> String {
        let Some(network) = self.network() else { return "ROS 2 off".to_owned() };
        let zenoh = if network.links.is_some() { " over Zenoh" } else { "" };
        format!("ROS 2 domain {}{zenoh}", self.domain_id)
    }

    /// Returns the state of the network side; `None` without a session.
    pub fn network(&self) -> Option<NetworkState> {
        self.session.as_ref().map(|session| session.status().network)
    }

    /// Returns the state of the ROS 2 connection for clients; `None` without a session.
    pub fn snapshot(&self) -> Option<RosSnapshot> {
        let RosStatus { outgoing, incoming, seen, send_errors, network, .. } =
            self.session.as_ref()?.status();
        let read = |read: &IncomingStatus| TopicSnapshot {
            peers: read.writers.into(),
            ..TopicSnapshot::unmatched(&read.name)
        };
        Some(RosSnapshot {
            domain_id: self.domain_id,
            is_up: network.is_up,
            restarts: network.restarts,
            last_failure: network.last_failure,
            joined_ms: network.age.map(millis),
            memory_bytes: network.memory_bytes,
            written: outgoing,
            read: incoming.iter().map(read).collect(),
            links: network.links,
            missing_peers: seen.missing_peers.into(),
            write_errors: seen.write_errors.saturating_add(send_errors),
        })
    }

    /// Returns the inbox of received messages; `None` without a session.
    pub fn inbox(&self) -> Option<Arc<Inbox>> {
        self.session.as_ref().map(RosSession::inbox)
    }

    /// Leaves the graph, within half a second.
    pub fn stop(self) {
        if let Some(session) = self.session {
            session.stop();
        }
    }
}

/// Returns the names by which ROS 2 knows this node.
fn names(settings: &Settings) -> NodeNames<'_> {
    NodeNames {
        node: &settings.gateway.node,
        namespace: &settings.ros.namespace,
        remappings: &settings.ros.remappings,
    }
}

/// Returns the topics by the names that ROS 2 knows, without the log.
pub fn topics(settings: &Settings) -> Topics {
    resolved(configured_topics(settings), settings)
}

fn resolved(mut topics: Topics, settings: &Settings) -> Topics {
    topics.names_mut().for_each(|name| *name = names(settings).resolve(name));
    topics
}

/// Returns the topics as configured, with the log.
fn with_log(settings: &Settings) -> Topics {
    let log = settings.ros.rosout.as_deref().unwrap_or_default();
    configured_topics(settings).with(OutgoingTopic::Log, log)
}

/// Returns the subscriptions by the names that ROS 2 knows.
pub fn subscriptions(settings: &Settings) -> Vec<Subscription> {
    let mut subscriptions = configured_subscriptions(settings);
    for topic in &mut subscriptions {
        topic.name = names(settings).resolve(&topic.name);
    }
    subscriptions
}

/// Returns remapping rules for topics that this node does not have, each with the topic that was probably
/// meant.
fn unused_rules(settings: &Settings) -> Vec<(&Remapping, Option<String>)> {
    let (names, mut topics) = (names(settings), with_log(settings));
    let mut known: Vec<_> = topics.names_mut().map(|name| name.clone()).collect();
    known.extend(configured_subscriptions(settings).into_iter().map(|topic| topic.name));
    known.extend(door_layouts(settings).map(|_| DOOR_LAYOUT.to_owned()));
    let rules = settings.ros.remappings.iter();
    let unused = rules.filter(|rule| !known.iter().any(|topic| names.concerns(rule, topic)));
    let meant = |rule: &Remapping| mistyped(&rule.from, known.iter().map(String::as_str)).map(str::to_owned);
    unused.map(|rule| (rule, meant(rule))).collect()
}

/// Returns a topic that is both published and subscribed to.
fn loop_topic(ros: &RosSettings) -> Option<String> {
    let mut topics = ros.topics.clone();
    let is_read = |name: &&mut String| ros.subscriptions.iter().any(|topic| topic.name == **name);
    topics.names_mut().find(is_read).cloned()
}

/// Returns the topics as configured. Reports that the profile does not provide have no topic, since they are
/// never published.
fn configured_topics(settings: &Settings) -> Topics {
    let lights = &settings.gateway.lights;
    let (ros, decider) = (&settings.ros, settings.turn_signal.as_ref().filter(|decider| decider.runs));
    let named = |TopicKey { section, key }| match section {
        "ros.topics" => ros.topics.name(key),
        _ => decider.map_or("", |decider| decider.outputs.name(key)),
    };
    // The row without a key is the log, which is not part of a recording; see `ros_settings`.
    let keys = OUTGOING.iter().filter_map(|row| Some((row.topic, row.key?)));
    let mut topics = keys.fold(Topics::default(), |topics, (topic, key)| topics.with(topic, named(key)));
    if matches!(lights.turn, TurnBinding::LeftOut) {
        topics = topics.with(OutgoingTopic::TurnIndicatorsReport, "");
    }
    if matches!(lights.hazard, HazardBinding::LeftOut) {
        topics = topics.with(OutgoingTopic::HazardLightsReport, "");
    }
    let described: Vec<_> = settings.gateway.status.reports().map(status_topic).collect();
    let is_left_out =
        |row: &&OutgoingRow| row.flow == TopicFlow::VehicleStatus && !described.contains(&row.topic);
    for row in OUTGOING.iter().filter(is_left_out) {
        topics = topics.with(row.topic, "");
    }
    if !decider.is_some_and(TurnSignalConfig::publishes_commands) {
        topics = topics.with(OutgoingTopic::TurnCommand, "").with(OutgoingTopic::HazardCommand, "");
    }
    let lights = settings.light_topics.outputs.iter().map(|output| LightsTopicSettings {
        topic: output.topic,
        name: output.name.clone(),
        lights: output.message,
        compat: settings.light_topics.compat,
    });
    topics.lights = lights.collect();
    topics
}

/// Returns the topic of a report on the vehicle's status.
const fn status_topic(report: StatusReport) -> OutgoingTopic {
    match report {
        StatusReport::Velocity => OutgoingTopic::VelocityReport,
        StatusReport::Steering => OutgoingTopic::SteeringReport,
        StatusReport::Gear => OutgoingTopic::GearReport,
        StatusReport::ControlMode => OutgoingTopic::ControlModeReport,
        StatusReport::Doors => OutgoingTopic::DoorStatusArray,
    }
}

/// Returns the subscriptions, grouped by the part that reads them.
fn configured_subscriptions(settings: &Settings) -> Vec<Subscription> {
    let topics = &settings.light_topics;
    let states =
        topics.inputs.iter().map(|(store, name)| Subscription::new(name, SubscriptionKind::Groups(*store)));
    let camera = topics.camera.iter().map(|name| Subscription::new(name, SubscriptionKind::Camera));
    let clock = topics
        .use_sim_time
        .then(|| Subscription::new(SubscriptionKind::Clock.row().default_name, SubscriptionKind::Clock));
    let commands = topics.command.iter().map(|name| Subscription::new(name, SubscriptionKind::Command));
    let decider = settings.turn_signal.iter().filter(|decider| decider.runs);
    // Subscribes to Autoware's own commands only for comparison: if we publish commands, they are ours.
    let decider =
        decider.flat_map(|decider| decider_subscriptions(&decider.inputs, !decider.publishes_commands()));
    let vehicle = settings.command.iter().flat_map(command_subscriptions);
    states.chain(camera).chain(clock).chain(commands).chain(decider).chain(vehicle).collect()
}

/// Returns the subscriptions to commands for the vehicle. If our own decider is the source, the turn command
/// is its command.
fn command_subscriptions(command: &CommandConfig) -> Vec<Subscription> {
    let CommandConfig { settings, topics, .. } = command;
    let turn = match settings.source {
        CommandSource::Topic => Some(SubscriptionKind::TurnCommand),
        CommandSource::Decider => None,
    };
    let mode = match settings.mode_from {
        ModeFrom::Topic { .. } => Some(SubscriptionKind::ControlMode),
        ModeFrom::Signal => None,
    };
    let kinds = [turn, Some(SubscriptionKind::HazardCommand), mode].into_iter().flatten();
    kinds.filter_map(|kind| subscription(topics, kind)).collect()
}

/// Returns the subscriptions to the inputs of the decider and, for comparison, to Autoware's own commands.
pub fn decider_subscriptions(inputs: &TopicNames, compares: bool) -> Vec<Subscription> {
    let own = SubscriptionKind::OWN_COMMANDS.into_iter().filter(|_| compares);
    let factors = FactorTopic::ALL.map(SubscriptionKind::Factors);
    let kinds = SubscriptionKind::DECIDER.into_iter().chain(factors).chain(own);
    kinds.filter_map(|kind| subscription(inputs, kind)).collect()
}

/// Returns the subscription to a topic of this kind; `None` if no topic is named.
fn subscription(names: &TopicNames, kind: SubscriptionKind) -> Option<Subscription> {
    let name = Some(names.name(kind.row().key?.key)).filter(|name| !name.is_empty())?;
    let SubscriptionKind::Factors(topic) = kind else { return Some(Subscription::new(name, kind)) };
    Some(Subscription::new(&topic.in_folder(name), kind))
}

/// Returns the node's parameters: the keys of the configuration, with the values in effect for `[ros]` and
/// the clock.
fn parameters(settings: &Settings, domain_id: u16) -> Parameters {
    let ros = &settings.ros;
    let mut parameters = settings.parameters.clone();
    parameters.set("use_sim_time", settings.light_topics.use_sim_time);
    parameters.set("ros.node", settings.gateway.node.as_str());
    parameters.set("ros.namespace", ros.namespace.as_str());
    parameters.set("ros.domain_id", i64::from(domain_id));
    parameters.set("ros.rosout", ros.rosout.is_some());
    parameters.set("ros.graph", ros.graph);
    parameters.set("ros.memory_limit_mb", i64::from(ros.memory_limit_mb));
    let topics = topics(settings);
    for row in &OUTGOING {
        if let Some(TopicKey { section: section @ "ros.topics", key }) = row.key {
            parameters.set(&format!("{section}.{key}"), topics.name(row.topic).unwrap_or_default());
        }
    }
    parameters
}

/// Returns the service that reports the layout of the doors; `None` for a profile without doors.
fn door_layouts(settings: &Settings) -> Option<DoorLayouts> {
    let doors = &settings.gateway.status.doors;
    let layout = |door: &Door| {
        let roles = [(door.is_entrance, DoorLayout::GET_ON), (door.is_exit, DoorLayout::GET_OFF)];
        let roles = roles.into_iter().filter_map(|(has_role, role)| has_role.then_some(role)).collect();
        DoorLayout { roles, description: door.name.clone() }
    };
    (!doors.is_empty()).then(|| DoorLayouts {
        service: names(settings).resolve(DOOR_LAYOUT),
        doors: doors.iter().map(layout).collect(),
    })
}

/// Returns the settings of the session, from the configuration and the environment. Fails if an environment
/// variable of ROS 2 has an unsupported value.
pub fn ros_settings(settings: &Settings) -> Result<RosSettings, PublisherError> {
    let network = ros_environment::network(&settings.ros, |name| std::env::var(name).ok())?;
    network.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
    Ok(RosSettings {
        node: settings.gateway.node.clone(),
        namespace: settings.ros.namespace.clone(),
        graph: settings.ros.graph,
        domain_id: network.domain_id,
        only_networks: network.only_networks,
        durability: settings.ros.durability,
        topics: resolved(with_log(settings), settings),
        // Only nodes that see this node in the graph find its services.
        services: settings.ros.graph.then(|| ServiceContents {
            parameters: parameters(settings, network.domain_id),
            doors: door_layouts(settings),
        }),
        subscriptions: subscriptions(settings),
        hardware_id: settings.hardware_id.clone(),
        recovery: Recovery::default(),
        transport: settings.ros.transport.clone(),
        isolation: if settings.ros.isolated {
            Isolation::Process {
                program: "/proc/self/exe".into(),
                memory_limit_mb: settings.ros.memory_limit_mb,
                supervisor: std::env::var_os("SIGNAL_GATEWAY_SUPERVISOR").map(PathBuf::from),
            }
        } else {
            Isolation::Thread
        },
    })
}

#[cfg(test)]
mod tests;
