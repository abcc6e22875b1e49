//! The session: a node in the ROS 2 graph that publishes reports and diagnostics.
//!
//! It owns a thread; the caller only puts things into its mailbox and is never held up. DDS is
//! RustDDS itself. Of `ros2-client` only the vocabulary of the ROS graph is used (names, and
//! `ros_discovery_info` in the layout of the distribution), because its node brings endpoints
//! nobody needs here and cannot take a publisher back.
//!
//! # Withdrawn reports
//!
//! A transient-local writer hands its last sample to whoever comes later. When a report is
//! withdrawn, the writer is therefore replaced by a new, empty one, after its readers have
//! acknowledged what was sent (or 100 ms). The readers meet the new writer during the silence; see
//! `report.rs` for a resume that comes sooner. A volatile writer hands nothing over and stays.
//!
//! Fast DDS 2.9 does not understand RustDDS's goodbyes, which lack the key hash it looks for: it keeps
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
//!   `Lookout`. It has never heard of the peer, so it can find it.
//! * When it does, and only then, the lookout becomes our participant: it gets writers and the
//!   current reports, and the old participant leaves when all its readers have found the new one.
//!   Nobody else misses a sample; some get one twice.
//! * A peer that was killed costs the lookout's two idle threads until it is given up after a day.
//! * An interface or address that was not there when the participant was made replaces the
//!   participant in the same way: sockets join multicast groups, and addresses are announced, only
//!   at the start. A link that comes up while somebody is missing renews the lookout, which then
//!   announces itself at once instead of within 10 s.
//! * Where hosts have no multicast between them, Cyclone must know our address (`Peers`) and not
//!   forget it (`PruneDelay="inf"`): RustDDS cannot be given addresses, and a new participant has a
//!   new port. Cyclone asks such ports every 30 s. Within one host this is not needed.
//! * A peer that forgot us while we still know it stops acknowledging; see `deafness.rs`.

mod deafness;
mod graph;
mod interfaces;
mod lookout;
mod mailbox;
mod presence;
mod report;
mod worker;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use ros2_client::names::{Name, NameError};

use super::messages::{DiagnosticArray, HazardLightsReport, TurnIndicatorsReport};
pub use super::settings::RosSettings;
pub use super::topics::{Durability, Topics};
use crate::core::event::Output;
use mailbox::{Letter, Mailbox, Wish};
use worker::Worker;

#[cfg(all(feature = "humble", feature = "jazzy"))]
compile_error!("choose one ROS 2 distribution: `humble` needs --no-default-features");
#[cfg(not(any(feature = "humble", feature = "jazzy")))]
compile_error!("`ros` is internal: choose the feature `humble` or `jazzy`");

/// The distribution whose graph this build joins.
pub const DISTRO: &str = if cfg!(feature = "humble") { "humble" } else { "jazzy" };

/// How long [`RosSession::stop`] waits for DDS to say goodbye.
const STOP_PATIENCE: Duration = Duration::from_millis(450);
/// The highest domain whose ports exist.
const LAST_DOMAIN: u16 = 232;

/// Why a session cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A node name or namespace ROS 2 does not allow.
    #[error(
        "node `{node}` in namespace `{namespace}`: {why}; use letters, digits and `_`, and a namespace like `/` or `/vehicle`"
    )]
    Node {
        /// The name asked for.
        node: String,
        /// The namespace asked for.
        namespace: String,
        /// What is wrong.
        why: NameError,
    },
    /// A topic name ROS 2 does not allow.
    #[error("topic `{topic}`: {why}; use an absolute name like `/diagnostics`")]
    Topic {
        /// The name asked for.
        topic: String,
        /// What is wrong.
        why: String,
    },
    /// A domain without UDP ports.
    #[error("ROS_DOMAIN_ID {0} is out of range; use 0 to {LAST_DOMAIN}")]
    Domain(u16),
    /// DDS could not be set up.
    #[error("DDS could not be set up: {0}; are the UDP ports of the domain free?")]
    Dds(String),
    /// The thread could not be started.
    #[error("no thread for ROS 2: {0}")]
    Thread(#[from] std::io::Error),
}

/// What a session is doing; all counts since its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RosStatus {
    /// False when the session's thread has ended; nothing is published any more.
    pub running: bool,
    /// Matched readers of the turn-indicators topic, now.
    pub turn_readers: usize,
    /// Matched readers of the hazard-lights topic, now.
    pub hazard_readers: usize,
    /// Matched readers of the diagnostics topic, now.
    pub diagnostics_readers: usize,
    /// Participants of the network that fell silent and were not found again yet.
    pub missing_peers: usize,
    /// Times our own participant was replaced.
    pub rebuilds: u32,
    /// Diagnostics dropped because DDS did not keep up.
    pub dropped_diagnostics: u64,
    /// Samples RustDDS did not take.
    pub write_errors: u64,
}

/// A running session.
#[derive(Debug)]
pub struct RosSession {
    mailbox: Arc<Mailbox>,
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
        let letters = Arc::clone(&mailbox);
        thread::Builder::new().name("ros".to_owned()).spawn(move || {
            // Dropped last, also by a panic: whoever waits for the end hears of it.
            let _end = end_sender;
            match Worker::new(settings, letters) {
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
            Ok(Ok(())) => Ok(Self { mailbox, hardware_id, ended }),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(RosError::Dds("the thread ended while starting".to_owned())),
        }
    }

    /// Publishes. Never blocks: reports not yet sent are overtaken by newer ones, diagnostics
    /// queue up to a bound.
    pub fn send(&self, output: &Output) {
        self.mailbox.put(match output {
            Output::TurnIndicators { report, stamp } => {
                Letter::Turn(Wish::Publish(TurnIndicatorsReport::new(*report, *stamp)))
            }
            Output::HazardLights { report, stamp } => {
                Letter::Hazard(Wish::Publish(HazardLightsReport::new(*report, *stamp)))
            }
            Output::WithdrawTurnIndicators => Letter::Turn(Wish::Withdraw),
            Output::WithdrawHazardLights => Letter::Hazard(Wish::Withdraw),
            Output::Diagnostics { diagnostics, stamp } => {
                Letter::Diagnostics(DiagnosticArray::new(diagnostics, *stamp, &self.hardware_id))
            }
        });
    }

    /// What the session is doing.
    pub fn status(&self) -> RosStatus {
        self.mailbox.status()
    }

    /// Sends what is still in the mailbox and leaves the graph, within half a second. When DDS
    /// takes longer, it is left to end by itself.
    pub fn stop(self) {
        self.mailbox.put(Letter::Stop);
        // Either way it is over: the sender is gone, or patience is.
        let _ = self.ended.recv_timeout(STOP_PATIENCE);
    }
}

impl Drop for RosSession {
    fn drop(&mut self) {
        self.mailbox.put(Letter::Stop);
    }
}

fn check(settings: &RosSettings) -> Result<(), RosError> {
    graph::node_name(settings)?;
    let topics = &settings.topics;
    for topic in [&topics.turn_indicators, &topics.hazard_lights, &topics.diagnostics] {
        let refused = |why: String| RosError::Topic { topic: topic.clone(), why };
        let name = Name::parse(topic).map_err(|why| refused(why.to_string()))?;
        if !name.is_absolute() {
            return Err(refused("does not start with `/`".to_owned()));
        }
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
    fn names_and_domains_ros_does_not_allow_are_refused_by_name() {
        assert!(refusal(|s| s.node = "signal gateway".to_owned()).contains("`signal gateway`"));
        assert!(refusal(|s| s.namespace = "vehicle".to_owned()).contains("`vehicle`"));
        assert!(refusal(|s| s.topics.diagnostics = "diagnostics".to_owned()).contains("`diagnostics`"));
        assert!(refusal(|s| s.topics.hazard_lights = "/a//b".to_owned()).contains("`/a//b`"));
        assert!(refusal(|s| s.domain_id = 233).contains("233"));
    }
}
