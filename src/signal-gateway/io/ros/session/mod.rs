//! The session: a node in the ROS 2 graph that publishes and subscribes to any number of topics.
//!
//! It owns a thread; the caller only puts messages into its mailbox and is never blocked. Received messages
//! wait in an inbox. The thread encodes and decodes messages, and exchanges them with the network side
//! ([`ros_transport`]), the only part that joins DDS. The network side is a process that the session starts
//! (through a [`supervisor`] of another user, if systemd provides one), watches and replaces, or a thread of
//! this process.
//!
//! The network side answers pings after a sample of its own has gone out and come back. It is killed if it is
//! silent for a second in which it could run, or if it breaks the rules of the link. It is told to leave if
//! it answers but its samples no longer arrive at a reader of our own, or if too many peers were announced to
//! it. The next network side starts after a delay, receives the current message of each topic, and announces
//! itself as a new participant.

mod child;
mod confinement_watch;
mod crowd;
mod error;
mod exchange;
mod host;
mod liveness;
mod mailbox;
mod network_settings;
mod processor_watch;
mod rosout;
mod status;
pub mod supervisor;
mod threads;

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

pub use ros_transport::DISTRO;
use ros_transport::identifier_length;
use ros_transport::names::{check_node, check_topic};
use ros_transport::parameters::Parameters;
pub use ros_transport::settings::{Recovery, Transport, TypeHashes, ZenohSettings};
use tokio::runtime::Builder;

use super::inbox::Inbox;
use super::outgoing;
pub use super::reception::IncomingStatus;
pub use super::settings::{Isolation, RosSettings};
pub use super::topics::{
    Durability, LightsTopicSettings, OutgoingTopic, Reliability, Subscription, SubscriptionKind, Topics,
};
use crate::io::awaited_thread::AwaitedThread;
use error::LAST_DOMAIN;
pub use error::RosError;
use exchange::Exchange;
use gateway_core::gateway::event::Output;
use mailbox::Mailbox;
pub use status::RosStatus;

/// Maximum time that [`RosSession::stop`] waits for DDS to leave the graph.
const STOP_PATIENCE: Duration = Duration::from_millis(450);
/// Maximum time that a start waits for the network side; then the session continues without it for now.
const START_PATIENCE: Duration = Duration::from_secs(5);

/// A session, which runs in its own thread.
#[derive(Debug)]
pub struct RosSession {
    mailbox: Arc<Mailbox>,
    inbox: Arc<Inbox>,
    hardware_id: String,
    thread: AwaitedThread,
}

impl RosSession {
    /// Joins the graph. Blocks until DDS is up, usually for about 10 ms and at most for 5 s; then it
    /// continues without DDS for now.
    pub fn start(settings: RosSettings) -> Result<Self, RosError> {
        check(&settings)?;
        let has_other_distribution = warn_of_other_distribution();
        let mailbox = Arc::new(Mailbox::default());
        let hardware_id = settings.hardware_id.clone();
        let (ready_sender, ready) = channel();
        let inbox = Arc::new(Inbox::default());
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let mut exchange = Exchange::new(settings, Arc::clone(&mailbox), Arc::clone(&inbox), ready_sender);
        if has_other_distribution {
            exchange.stay_outside_graph();
        }
        let thread = AwaitedThread::start("ros", move || runtime.block_on(exchange.run()))?;
        match ready.recv_timeout(START_PATIENCE) {
            Ok(Err(error)) => Err(error),
            Ok(Ok(())) | Err(RecvTimeoutError::Timeout) => Ok(Self { mailbox, inbox, hardware_id, thread }),
            Err(RecvTimeoutError::Disconnected) => {
                Err(RosError::Start(io::Error::other("it ended while starting")))
            }
        }
    }

    /// Publishes an output. Never blocks: unsent reports, commands and traffic lights are replaced by newer
    /// ones; diagnostics are queued up to a limit.
    pub fn send(&self, output: &Output) {
        self.mailbox.put(output, &self.hardware_id);
    }

    /// Replaces the parameters of the node, if it has services for them.
    pub fn set_parameters(&self, parameters: Parameters) {
        self.mailbox.put_parameters(parameters);
    }

    /// Returns the inbox in which received messages wait.
    pub fn inbox(&self) -> Arc<Inbox> {
        Arc::clone(&self.inbox)
    }

    /// Returns true until the session's thread has ended; nothing is published then.
    pub fn is_running(&self) -> bool {
        self.mailbox.update_status(|status| status.running)
    }

    /// Returns state and counts of the session.
    pub fn status(&self) -> RosStatus {
        self.mailbox.status()
    }

    /// Sends the messages in the mailbox and leaves the graph, within half a second. If DDS takes longer, it
    /// is left to end by itself.
    pub fn stop(self) {
        self.mailbox.stop();
        let _ = self.thread.ends_within(STOP_PATIENCE);
    }
}

impl Drop for RosSession {
    fn drop(&mut self) {
        self.mailbox.stop();
    }
}

fn check(settings: &RosSettings) -> Result<(), RosError> {
    check_node(&settings.namespace, &settings.node).map_err(|why| RosError::Node {
        node: settings.node.clone(),
        namespace: settings.namespace.clone(),
        why: why.to_string(),
    })?;
    let written =
        outgoing::table(&settings.topics, settings.durability).into_iter().map(|outgoing| outgoing.name);
    let read = settings.subscriptions.iter().map(|subscription| subscription.name.clone());
    for topic in written.chain(read) {
        check_topic(&topic).map_err(|why| RosError::Topic { topic, why: why.to_string() })?;
    }
    if let Some(subscription) = settings.subscriptions.iter().find(|subscription| subscription.depth < 1) {
        return Err(RosError::Depth { topic: subscription.name.clone(), depth: subscription.depth });
    }
    if settings.domain_id > LAST_DOMAIN {
        return Err(RosError::Domain(settings.domain_id));
    }
    Ok(())
}

/// Warns if the environment names a distribution other than this build's; returns true if its graph differs.
/// The data is the same in every distribution, but the graph is not (see `graph.rs`).
fn warn_of_other_distribution() -> bool {
    match std::env::var("ROS_DISTRO") {
        Ok(other) if other != DISTRO => {
            tracing::warn!(
                "ROS_DISTRO is `{other}`, but this build is for `{DISTRO}`: topics work, but `ros2 node` may not list \
                 this node; install the build for `{other}`"
            );
            identifier_length(&other) != identifier_length(DISTRO)
        }
        Ok(_) | Err(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use tokio::task::yield_now;

    use super::*;

    fn refusal(change: impl FnOnce(&mut RosSettings)) -> String {
        let mut settings = RosSettings::default();
        change(&mut settings);
        RosSession::start(settings).unwrap_err().to_string()
    }

    #[test]
    fn names_and_domains_that_ros_does_not_allow_are_refused() {
        let rename = |settings: &mut RosSettings, topic, name: &str| {
            settings.topics = settings.topics.clone().with(topic, name);
        };
        assert!(refusal(|s| s.node = "signal gateway".to_owned()).contains("`signal gateway`"));
        assert!(refusal(|s| s.namespace = "vehicle".to_owned()).contains("`vehicle`"));
        assert!(refusal(|s| rename(s, OutgoingTopic::Diagnostics, "diagnostics")).contains("`diagnostics`"));
        assert!(refusal(|s| rename(s, OutgoingTopic::HazardLightsReport, "/a//b")).contains("`/a//b`"));
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

    #[test]
    fn a_network_that_is_refused_when_the_start_waits_no_more_is_joined_again() {
        let (starter, start) = channel();
        drop(start);
        let zenoh =
            ZenohSettings { config: Some("no configuration".to_owned()), type_hashes: TypeHashes::Rihs01 };
        let settings = RosSettings {
            transport: Transport::Zenoh(zenoh),
            isolation: Isolation::Thread,
            ..RosSettings::default()
        };
        let mailbox = Arc::new(Mailbox::default());
        let exchange = Exchange::new(settings, Arc::clone(&mailbox), Arc::default(), starter);
        let runtime = Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let restarted = async {
                while mailbox.status().network.restarts == 0 {
                    yield_now().await;
                }
            };
            tokio::select! {
                () = exchange.run() => panic!("it has ended: {:?}", mailbox.status()),
                () = restarted => {}
            }
        });
    }
}
