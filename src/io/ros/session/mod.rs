//! The session: a node in the ROS 2 graph that publishes any number of topics and reads any number.
//!
//! It owns a thread; the caller only puts messages into its mailbox and is never held up. Received messages wait in an
//! inbox; RustDDS wakes the thread for them. DDS is RustDDS itself. Of `ros2-client` only the names of the ROS graph and
//! `ros_discovery_info` in the layout of the distribution are used, because its node brings endpoints that nobody needs
//! here, and cannot take a publisher back.
//!
//! # Withdrawn reports
//!
//! A transient-local writer hands its last sample to whoever comes later. When a report is
//! withdrawn, the writer is therefore replaced by a new, empty one, after its readers have
//! acknowledged what was sent (or 100 ms). The readers meet the new writer during the silence; see
//! `topic_writer.rs` for a resume that comes sooner. A volatile writer hands nothing over and stays.
//!
//! Fast DDS 2.9 ignores RustDDS's dispose messages, which lack the key hash that it needs: it keeps
//! each replaced writer (some 9 kB) until our participant leaves. Data is unaffected.
//!
//! # Outages
//!
//! RustDDS 0.15 discards repeated participant announcements by their sequence number, so a peer
//! that was silent for longer than its lease is never found again by the same participant, and
//! nothing in RustDDS's interface makes it forget. A new participant finds the peer at once. But
//! the other peers would lose us for a moment if ours were simply rebuilt on suspicion, and a
//! peer that was killed looks the same as one behind a broken link. So:
//!
//! * A peer that leaves orderly, or that we never met, needs nothing.
//! * While a peer is missing (its lease ran out), a second, bare participant listens as a
//!   `DiscoveryProbe`. The peer is new to it, so it can find it.
//! * When it does, and only then, the probe becomes our participant: it gets writers with what is
//!   current on them, and readers, and the old participant leaves when all its peers have found the
//!   new one. Nobody else misses a sample; some get one twice. What we receive twice is recognised by its
//!   number (`duplicate_filter.rs`).
//! * A peer that was killed costs the probe's two idle threads until it is given up after a day.
//! * An interface or address that was not there when the participant was made replaces the
//!   participant in the same way: sockets join multicast groups, and addresses are announced, only
//!   at the start. A link that comes up while somebody is missing renews the probe, which then
//!   announces itself at once instead of within 10 s.
//! * Where hosts have no multicast between them, Cyclone must know our address (`Peers`) and not
//!   forget it (`PruneDelay="inf"`): RustDDS cannot be given addresses, and a new participant has a
//!   new port. Cyclone asks such ports every 30 s. Within one host this is not needed.
//! * A peer that forgot us while we still know it stops acknowledging; see `ack_timeout.rs`.

mod ack_timeout;
mod discovery_probe;
mod duplicate_filter;
mod graph;
mod history;
mod interfaces;
mod mailbox;
mod outgoing;
mod participant;
mod sample;
mod topic_reader;
mod topic_writer;
mod worker;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use ros2_client::names::{Name, NameError};

use super::inbox::Inbox;
use super::messages::{
    DiagnosticArray, HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};
pub use super::settings::{Recovery, RosSettings};
pub use super::topics::{
    Durability, LightsTopicSettings, Reliability, Subscription, SubscriptionKind, Topics,
};
use crate::core::gateway::event::Output;
use crate::core::traffic_light::output::TrafficLightOutput;
use crate::core::turn_signal::output::TurnSignalOutput;
use crate::core::vehicle_lights::output::VehicleLightsOutput;
use mailbox::{Mailbox, OutgoingMessage, Publication};
use outgoing::Outgoing;
use worker::Worker;

#[cfg(all(feature = "humble", feature = "jazzy"))]
compile_error!("choose one ROS 2 distribution: `humble` needs --no-default-features");
#[cfg(not(any(feature = "humble", feature = "jazzy")))]
compile_error!("`ros` is internal: choose the feature `humble` or `jazzy`");

/// The distribution whose graph this build joins.
pub const DISTRO: &str = if cfg!(feature = "humble") { "humble" } else { "jazzy" };

/// Longest time that [`RosSession::stop`] waits for DDS to leave the graph.
const STOP_PATIENCE: Duration = Duration::from_millis(450);
/// The highest domain whose ports exist.
const LAST_DOMAIN: u16 = 232;

/// Why a session cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// The node name or namespace is not allowed by ROS 2.
    #[error(
        "node `{node}` in namespace `{namespace}`: {why}; use letters, digits and `_`, and a namespace like `/` or `/vehicle`"
    )]
    Node {
        /// The configured node name.
        node: String,
        /// The configured namespace.
        namespace: String,
        /// The rule that the name breaks.
        why: NameError,
    },
    /// The topic name is not allowed by ROS 2.
    #[error("topic `{topic}`: {why}; use an absolute name like `/diagnostics`")]
    Topic {
        /// The configured topic name.
        topic: String,
        /// The rule that the name breaks, as text.
        why: String,
    },
    /// The subscription would keep no sample.
    #[error("topic `{topic}`: a depth of {depth} keeps no sample; use 1 or more")]
    Depth {
        /// The topic's name.
        topic: String,
        /// The configured depth, samples.
        depth: i32,
    },
    /// The domain has no UDP ports.
    #[error("ROS_DOMAIN_ID {0} is out of range; use 0 to {LAST_DOMAIN}")]
    Domain(u16),
    /// DDS could not be set up.
    #[error("DDS could not be set up: {0}; are the UDP ports of the domain free?")]
    Dds(String),
    /// The thread could not be started.
    #[error("no thread for ROS 2: {0}")]
    Thread(#[from] std::io::Error),
}

/// State and counts of a session since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RosStatus {
    /// False when the session's thread has ended; nothing is published any more.
    pub running: bool,
    /// The topics that are written: turn indicators and hazard lights if they have a name, diagnostics, traffic
    /// lights in the order of the settings, then the turn and the hazard command if they are configured.
    pub outgoing: Vec<OutgoingStatus>,
    /// The topics that are read, in the order of the settings.
    pub incoming: Vec<IncomingStatus>,
    /// Participants of the network whose lease ran out and that were not found again yet.
    pub missing_peers: usize,
    /// True while a second participant listens for them.
    pub has_probe: bool,
    /// Times our own participant was replaced.
    pub rebuilds: u32,
    /// Emissions of traffic lights overtaken by a newer one because DDS did not keep up.
    pub overtaken_lights: u64,
    /// Samples that RustDDS did not take.
    pub write_errors: u64,
}

/// State of a topic that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutgoingStatus {
    /// Short name for people, e.g. `turn`, `hazard`, `V2I lights`.
    pub label: &'static str,
    /// Its absolute name.
    pub name: Arc<str>,
    /// Readers that are matched now.
    pub readers: usize,
}

impl OutgoingStatus {
    fn new(outgoing: &Outgoing) -> Self {
        Self { label: outgoing.label(), name: outgoing.name.as_str().into(), readers: 0 }
    }
}

/// State and counts of a topic that is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IncomingStatus {
    /// Its absolute name.
    pub name: Arc<str>,
    /// Writers that are matched now.
    pub writers: usize,
    /// Samples that were handed on to the inbox.
    pub received: u64,
    /// Samples that were not of the topic's type.
    pub undecodable: u64,
    /// Groups that were left out because of an undefined number.
    pub rejected_groups: u64,
}

impl IncomingStatus {
    fn new(subscription: &Subscription) -> Self {
        let name = subscription.name.as_str().into();
        Self { name, writers: 0, received: 0, undecodable: 0, rejected_groups: 0 }
    }
}

/// A running session.
#[derive(Debug)]
pub struct RosSession {
    mailbox: Arc<Mailbox>,
    inbox: Arc<Inbox>,
    hardware_id: String,
    ended: Receiver<()>,
}

impl RosSession {
    /// Joins the graph. Blocks until DDS is up, for some 10 ms; at worst 10 s.
    pub fn start(settings: RosSettings) -> Result<Self, RosError> {
        check(&settings)?;
        warn_of_other_distribution();
        let mailbox = Arc::new(Mailbox::default());
        let hardware_id = settings.hardware_id.clone();
        let (end_sender, ended) = channel();
        let (ready_sender, ready) = channel();
        let inbox = Arc::new(Inbox::default());
        let (messages, received) = (Arc::clone(&mailbox), Arc::clone(&inbox));
        thread::Builder::new().name("ros".to_owned()).spawn(move || {
            // Dropped last, also by a panic, which ends the wait of `stop`.
            let _end = end_sender;
            match Worker::new(settings, messages, received) {
                Ok(worker) => {
                    let _ = ready_sender.send(Ok(()));
                    worker.run();
                }
                Err(error) => {
                    let _ = ready_sender.send(Err(error));
                }
            }
        })?;
        match ready.recv() {
            Ok(Ok(())) => Ok(Self { mailbox, inbox, hardware_id, ended }),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(RosError::Dds("the thread ended while starting".to_owned())),
        }
    }

    /// Publishes an output. Never blocks: reports, commands and traffic lights not yet sent are replaced by newer
    /// ones, diagnostics queue up to a bound.
    pub fn send(&self, output: &Output) {
        let message = match output {
            Output::VehicleLights(output) => match output {
                VehicleLightsOutput::TurnIndicators { report, stamp } => {
                    OutgoingMessage::Turn(Publication::Publish(TurnIndicatorsReport::new(*report, *stamp)))
                }
                VehicleLightsOutput::HazardLights { report, stamp } => {
                    OutgoingMessage::Hazard(Publication::Publish(HazardLightsReport::new(*report, *stamp)))
                }
                VehicleLightsOutput::WithdrawTurnIndicators => OutgoingMessage::Turn(Publication::Withdraw),
                VehicleLightsOutput::WithdrawHazardLights => OutgoingMessage::Hazard(Publication::Withdraw),
            },
            Output::Diagnostics { diagnostics, stamp } => {
                OutgoingMessage::Diagnostics(DiagnosticArray::new(diagnostics, *stamp, &self.hardware_id))
            }
            Output::TrafficLights(TrafficLightOutput::Publish(emission)) => {
                OutgoingMessage::Lights(emission.clone())
            }
            Output::TurnSignal(TurnSignalOutput::TurnCommand { command, stamp }) => {
                OutgoingMessage::TurnCommand(TurnIndicatorsCommand::new(*command, *stamp))
            }
            Output::TurnSignal(TurnSignalOutput::HazardCommand { command, stamp }) => {
                OutgoingMessage::HazardCommand(HazardLightsCommand::new(*command, *stamp))
            }
            Output::TurnSignal(TurnSignalOutput::Decision(_))
            | Output::TrafficLights(TrafficLightOutput::CommandRefused(_))
            | Output::Command(_) => return,
        };
        self.mailbox.put(message);
    }

    /// The inbox in which received messages wait.
    pub fn inbox(&self) -> Arc<Inbox> {
        Arc::clone(&self.inbox)
    }

    /// State and counts of the session.
    pub fn status(&self) -> RosStatus {
        self.mailbox.status()
    }

    /// Sends what is still in the mailbox and leaves the graph, within half a second. When DDS
    /// takes longer, it is left to end by itself.
    pub fn stop(self) {
        self.mailbox.put(OutgoingMessage::Stop);
        // Ends when the thread has ended, or when the time is up.
        let _ = self.ended.recv_timeout(STOP_PATIENCE);
    }
}

impl Drop for RosSession {
    fn drop(&mut self) {
        self.mailbox.put(OutgoingMessage::Stop);
    }
}

fn check(settings: &RosSettings) -> Result<(), RosError> {
    graph::node_name(settings)?;
    let written = outgoing::table(settings).into_iter().map(|outgoing| outgoing.name);
    let read = settings.subscriptions.iter().map(|subscription| subscription.name.clone());
    for topic in written.chain(read) {
        let refused = |why: String| RosError::Topic { topic: topic.clone(), why };
        let name = Name::parse(&topic).map_err(|why| refused(why.to_string()))?;
        if !name.is_absolute() {
            return Err(refused("does not start with `/`".to_owned()));
        }
    }
    if let Some(subscription) = settings.subscriptions.iter().find(|subscription| subscription.depth < 1) {
        return Err(RosError::Depth { topic: subscription.name.clone(), depth: subscription.depth });
    }
    if settings.domain_id > LAST_DOMAIN {
        return Err(RosError::Domain(settings.domain_id));
    }
    Ok(())
}

/// The data is the same in every distribution, the graph is not (see `graph.rs`).
fn warn_of_other_distribution() {
    match std::env::var("ROS_DISTRO") {
        Ok(other) if other != DISTRO => tracing::warn!(
            "ROS_DISTRO is `{other}`, but this build is for `{DISTRO}`: topics work, but `ros2 node` may not list \
             this node; install the build for `{other}`"
        ),
        Ok(_) | Err(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(change: impl FnOnce(&mut RosSettings)) -> String {
        let mut settings = RosSettings::default();
        change(&mut settings);
        RosSession::start(settings).unwrap_err().to_string()
    }

    #[test]
    fn names_and_domains_that_ros_does_not_allow_are_refused() {
        assert!(refusal(|s| s.node = "signal gateway".to_owned()).contains("`signal gateway`"));
        assert!(refusal(|s| s.namespace = "vehicle".to_owned()).contains("`vehicle`"));
        assert!(refusal(|s| s.topics.diagnostics = "diagnostics".to_owned()).contains("`diagnostics`"));
        assert!(refusal(|s| s.topics.hazard_lights = "/a//b".to_owned()).contains("`/a//b`"));
        assert!(refusal(|s| s.domain_id = 233).contains("233"));
        let commands = |name: &str, depth| Subscription {
            name: name.to_owned(),
            kind: SubscriptionKind::Command,
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            depth,
        };
        assert!(refusal(|s| s.subscriptions.push(commands("commands", 1))).contains("`commands`"));
        assert!(refusal(|s| s.subscriptions.push(commands("/c", 0))).contains("depth of 0"));
    }
}
