//! The session's thread: passes messages from mailbox to network side and from network side to inbox, and
//! replaces a network side that ends.

mod show;

use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;
use std::time::{Duration, Instant};

use tokio::time::{sleep, timeout};

use super::crowd::Crowd;
use super::error::RosError;
use super::host::{Host, Hosts};
use super::liveness::{Liveness, ReturnPath};
use super::mailbox::Mailbox;
use super::network_settings::network_settings;
use super::processor_watch::ProcessorWatch;
use super::rosout::Rosout;
use crate::io::optional_future::or_never;
use crate::io::process_log::take_warnings;
use crate::io::ros::inbox::Inbox;
use crate::io::ros::outgoing::messages::{OutgoingMessages, Publication};
use crate::io::ros::outgoing::{LightsEncoders, Outgoing, orders, table};
use crate::io::ros::reception::{TopicReception, not_started};
use crate::io::ros::settings::RosSettings;
use crate::io::ros::topics::OutgoingTopic;
use crate::process_status::network::{NetworkFailure, NetworkState};
use crate::process_status::snapshot::TopicSnapshot;
use ros_transport::link::{
    FromNetwork, Link, LostLines, NetworkSettings, NetworkStatus, Order, ToNetwork, Violation, ZenohLinks,
};
use ros_transport::settings::Transport;

/// Maximum sleep between two checks of the network side.
const TICK: Duration = Duration::from_millis(100);
/// Sleep between two checks of a network side that is ending.
const END_TICK: Duration = Duration::from_millis(5);
/// Time after which a killed network side that has not ended is no longer waited for.
const END_PATIENCE: Duration = Duration::from_secs(1);
/// Maximum time for the network side to leave the graph.
const GOODBYE: Duration = Duration::from_millis(400);

/// The state of the session's thread.
pub(super) struct Exchange {
    hosts: Hosts,
    settings: NetworkSettings,
    table: Vec<Outgoing>,
    encoders: LightsEncoders,
    /// The current order of each topic of the table, except for topics whose messages are delivered only
    /// once.
    current: Vec<Order>,
    mailbox: Arc<Mailbox>,
    /// `None` if nothing goes to `/rosout`.
    rosout: Option<Rosout>,
    reception: TopicReception,
    phase: NetworkPhase,
    /// Killed network sides whose end has not been observed yet.
    unended: Vec<Host>,
    /// The way of an echo sample from the network side back to itself.
    echo_way: ReturnPath,
    /// The way of a sample from the network side to a separate reader.
    witness_way: ReturnPath,
    crowd: Crowd,
    /// Times at which network sides ended within the last minute.
    ends: Vec<Instant>,
    processor: ProcessorWatch,
    state: NetworkState,
    /// Log lines lost by network sides that have ended.
    lost_lines: LostLines,
    /// True if the environment names a distribution whose graph this build cannot enter.
    has_other_distribution: bool,
    /// The last recorded state, with its time.
    noted: Option<(NetworkState, Instant)>,
    /// Number of messages that could not be encoded or sent.
    send_errors: u64,
    /// Receiver of the result of the start, while it waits.
    starter: Option<Sender<Result<(), RosError>>>,
}

/// Phase of the network side's life.
enum NetworkPhase {
    /// The network side runs.
    Active(Box<Active>),
    /// The network side was killed, told to leave, or has closed its end of the link; with the cause, if
    /// known, and its age.
    Ending {
        host: Host,
        since: Instant,
        failure: Option<NetworkFailure>,
        age: Option<Duration>,
        /// Time at which it is killed if it was told to leave and has not left.
        leaves_until: Option<Instant>,
    },
    /// There is no network side until this time.
    Down { until: Instant },
    /// The first network side could not be started.
    Refused,
}

/// A running network side.
struct Active {
    host: Host,
    link: Link,
    liveness: Liveness,
    /// Time at which it joined the network.
    joined: Option<Instant>,
    /// True once a sample of its own has come back.
    had_echo: bool,
    /// True once a sample of it has arrived at a separate reader.
    was_heard: bool,
    status: NetworkStatus,
}

/// The end of the communication with a network side, with its failure; `None` if its end of the link is
/// closed.
struct Over(Option<NetworkFailure>);

impl From<NetworkFailure> for Over {
    fn from(failure: NetworkFailure) -> Self {
        Self(Some(failure))
    }
}

impl From<Violation> for Over {
    fn from(violation: Violation) -> Self {
        NetworkFailure::Violation(violation.to_string()).into()
    }
}

impl Exchange {
    /// Creates an exchange, which starts the first network side when it runs, and sends the result to
    /// `starter`.
    pub(super) fn new(
        settings: RosSettings,
        mailbox: Arc<Mailbox>,
        inbox: Arc<Inbox>,
        starter: Sender<Result<(), RosError>>,
    ) -> Self {
        let table = table(&settings.topics, settings.durability);
        let reception = TopicReception::new(&settings.subscriptions, table.len(), inbox);
        mailbox.update_status(|status| {
            status.running = true;
            status.outgoing = table.iter().map(|outgoing| TopicSnapshot::unmatched(&outgoing.name)).collect();
            status.incoming = reception.statuses().cloned().collect();
        });
        Self {
            settings: network_settings(&settings, &table),
            rosout: settings
                .topics
                .name(OutgoingTopic::Log)
                .map(|_| Rosout::new(&settings.namespace, &settings.node)),
            hosts: Hosts::new(settings.isolation),
            current: table.iter().map(|_| Order::Withdraw).collect(),
            table,
            encoders: LightsEncoders::default(),
            mailbox,
            reception,
            phase: NetworkPhase::Down { until: Instant::now() },
            unended: Vec::new(),
            echo_way: ReturnPath::default(),
            witness_way: ReturnPath::default(),
            crowd: Crowd::new(Instant::now()),
            ends: Vec::new(),
            processor: ProcessorWatch::default(),
            state: NetworkState {
                links: matches!(settings.transport, Transport::Zenoh(_)).then(ZenohLinks::default),
                ..NetworkState::default()
            },
            lost_lines: LostLines::default(),
            has_other_distribution: false,
            noted: None,
            send_errors: 0,
            starter: Some(starter),
        }
    }

    /// Leaves the node out of the graph on DDS, which belongs to another distribution.
    pub(super) fn stay_outside_graph(&mut self) {
        // Zenoh's graph has no such message.
        if self.state.links.is_none() && self.settings.graph {
            self.settings.graph = false;
            self.has_other_distribution = true;
        }
    }

    /// Runs until the mailbox contains a stop, or the first network side cannot be started.
    pub(super) async fn run(mut self) {
        while !self.mailbox.is_stopping() {
            let now = Instant::now();
            match &mut self.phase {
                NetworkPhase::Active(_) => self.exchange(now),
                NetworkPhase::Ending { .. } => self.see_end(now),
                NetworkPhase::Down { until } if now >= *until => self.start(now),
                NetworkPhase::Down { .. } => {}
                NetworkPhase::Refused => return,
            }
            // Without a network side, messages are recorded as current or lost.
            if !matches!(self.phase, NetworkPhase::Active(_)) {
                self.deliver(&self.mailbox.take());
            }
            self.show(now);
            self.wait(now).await;
        }
        self.leave().await;
    }

    /// Waits for a message, the network side, or a deadline.
    async fn wait(&self, now: Instant) {
        let (link, pause) = match &self.phase {
            NetworkPhase::Active(active) => (Some(&active.link), TICK),
            NetworkPhase::Ending { .. } => (None, END_TICK),
            NetworkPhase::Down { until } => (None, until.saturating_duration_since(now).min(TICK)),
            NetworkPhase::Refused => (None, Duration::ZERO),
        };
        tokio::select! {
            () = self.mailbox.arrived() => {}
            // An error shows when it is read.
            _ = or_never(link.map(Link::ready)) => {}
            () = sleep(pause) => {}
        }
    }

    fn start(&mut self, now: Instant) {
        let is_first = self.state.last_failure.is_none();
        match self.hosts.start().and_then(|(host, socket)| Ok((host, Link::new(socket)?))) {
            Ok((host, mut link)) => {
                self.state.place = host.place();
                self.state.restarts += u64::from(!is_first);
                self.settings.echo_is_proven = self.echo_way.is_proven;
                link.queue(&ToNetwork::Start(Box::new(self.settings.clone())));
                self.phase = NetworkPhase::Active(Box::new(Active {
                    host,
                    link,
                    liveness: Liveness::new(self.witness_way.is_proven, now),
                    joined: None,
                    had_echo: false,
                    was_heard: false,
                    status: NetworkStatus::default(),
                }));
            }
            Err(error) => {
                let failure = NetworkFailure::NotStarted(error.to_string());
                if !self.refuse(error.into()) {
                    self.note_end(failure, None, now);
                }
            }
        }
    }

    /// Reports this error if the start still waits for the first network side. Otherwise returns false, since
    /// the next one may succeed.
    fn refuse(&mut self, error: RosError) -> bool {
        let is_refused = self.starter.take().is_some_and(|starter| starter.send(Err(error)).is_ok());
        if is_refused {
            self.phase = NetworkPhase::Refused;
        }
        is_refused
    }

    fn exchange(&mut self, now: Instant) {
        let Err(Over(failure)) = self.converse(now) else { return };
        let NetworkPhase::Active(active) =
            std::mem::replace(&mut self.phase, NetworkPhase::Down { until: now })
        else {
            return;
        };
        self.lost_lines = self.lost_lines.plus(active.lost_lines());
        let Active { mut host, mut link, joined, had_echo, was_heard, .. } = *active;
        if let Some(NetworkFailure::NotStarted(reason)) = &failure {
            let error = match self.settings.transport {
                Transport::Dds => RosError::Dds(reason.clone()),
                Transport::Zenoh(_) => RosError::Zenoh(reason.clone()),
            };
            if self.refuse(error) {
                return;
            }
        }
        if failure == Some(NetworkFailure::NoAnswer) && !had_echo {
            self.echo_way.note_in_vain();
        }
        if failure == Some(NetworkFailure::Unheard) && !was_heard {
            self.witness_way.note_in_vain();
        }
        // A network side that still works can tell its peers that it leaves.
        let can_leave = matches!(failure, Some(NetworkFailure::Unheard | NetworkFailure::Crowded))
            && link.queue(&ToNetwork::Stop)
            && link.flush().is_ok()
            && link.waiting() == 0;
        if !can_leave {
            host.kill();
        }
        let leaves_until = can_leave.then_some(now + GOODBYE);
        let age = joined.map(|joined| now.saturating_duration_since(joined));
        self.phase = NetworkPhase::Ending { host, since: now, failure, age, leaves_until };
    }

    /// Reads the network side's messages, and writes as many of ours as it accepts.
    fn converse(&mut self, now: Instant) -> Result<(), Over> {
        let NetworkPhase::Active(active) = &mut self.phase else { return Ok(()) };
        let read = active.link.read();
        while let Some(frame) = active.link.next_frame()? {
            let message = FromNetwork::decode(frame)?;
            self.reception.take(&message, now)?;
            match (message, active.joined) {
                (FromNetwork::Ready, None) => {
                    active.joined = Some(now);
                    active.liveness.joined();
                    (self.state.is_up, self.state.has_echo) = (true, true);
                    for (topic, order) in (0..=u16::MAX).zip(&self.current) {
                        if matches!(order, Order::Publish(_)) {
                            active.link.queue(&ToNetwork::Order(topic, order.clone()));
                        }
                    }
                    if let Some(starter) = self.starter.take() {
                        let _ = starter.send(Ok(()));
                    }
                }
                (FromNetwork::Failed(reason), None) => {
                    return Err(not_started(reason).into());
                }
                (FromNetwork::Status(status), Some(_)) => {
                    let unheard = status.unheard_writers.saturating_sub(active.status.unheard_writers);
                    if unheard > 0 {
                        self.reception.note_taken_anew(unheard, now);
                    }
                    active.status = status;
                }
                (FromNetwork::Pong { number, has_echo, is_heard }, Some(_)) => {
                    active.liveness.pong(number, is_heard)?;
                    if is_heard {
                        active.was_heard = true;
                        self.witness_way.note_come();
                    }
                    self.state.has_echo = has_echo;
                    if has_echo {
                        active.had_echo = true;
                        self.echo_way.note_come();
                    }
                }
                (FromNetwork::Sample(_) | FromNetwork::Unreadable(..), Some(_)) => {}
                (FromNetwork::Ready | FromNetwork::Failed(_), Some(_)) | (_, None) => {
                    return Err(Violation::OutOfTurn.into());
                }
            }
        }
        read.map_err(|_| Over(None))?;
        let Active { host, liveness, status, .. } = &mut **active;
        let looked = liveness.look(now, || host.look().threads);
        // A thread cannot be killed, and may be in a debugger.
        if host.is_isolated() {
            looked?;
            if self.crowd.look(status.peers(), now) {
                return Err(NetworkFailure::Crowded.into());
            }
        }
        if active.link.waiting() == 0 {
            self.deliver(&self.take_messages());
        }
        let NetworkPhase::Active(active) = &mut self.phase else { return Ok(()) };
        if let Some(number) = active.joined.and_then(|_| active.liveness.next_ping(now)) {
            active.link.queue(&ToNetwork::Ping(number));
        }
        active.link.flush().map_err(|_| Over(None))
    }

    /// Takes the waiting messages. Warnings continue to wait until the network has been joined.
    fn take_messages(&self) -> OutgoingMessages {
        let mut messages = self.mailbox.take();
        let has_joined = matches!(&self.phase, NetworkPhase::Active(active) if active.joined.is_some());
        if let Some(rosout) = self.rosout.as_ref().filter(|_| has_joined) {
            for message in rosout.messages(take_warnings()) {
                messages.put_publication(OutgoingTopic::Log, Publication::of(message));
            }
        }
        messages
    }

    /// Queues the orders of the messages if the network has been joined, and records the current ones.
    fn deliver(&mut self, messages: &OutgoingMessages) {
        if let Some(parameters) = &messages.parameters {
            self.settings.set_parameters(parameters.as_ref().clone());
            if let NetworkPhase::Active(active) = &mut self.phase {
                active.link.queue(&ToNetwork::Parameters(parameters.clone()));
            }
        }
        for (position, order) in orders(&self.table, &mut self.encoders, messages) {
            match order {
                Ok(order) => self.send(position, order),
                Err(error) => self.count_send_error(&error.to_string()),
            }
        }
    }

    fn send(&mut self, position: usize, order: Order) {
        let is_kept = self.table.get(position).is_some_and(|outgoing| outgoing.delivery.is_kept());
        let message = ToNetwork::Order(u16::try_from(position).unwrap_or(u16::MAX), order);
        if let NetworkPhase::Active(active) = &mut self.phase
            && active.joined.is_some()
            && !active.link.queue(&message)
        {
            self.count_send_error("it is too large");
        }
        if let (ToNetwork::Order(_, order), Some(current)) = (message, self.current.get_mut(position))
            && is_kept
        {
            *current = order;
        }
    }

    fn count_send_error(&mut self, error: &str) {
        if self.send_errors == 0 {
            tracing::warn!("a message cannot be sent: {error}");
        }
        self.send_errors += 1;
    }

    /// Waits for a killed network side to end.
    fn see_end(&mut self, now: Instant) {
        let NetworkPhase::Ending { host, since, leaves_until, .. } = &mut self.phase else { return };
        let end = host.end();
        if leaves_until.is_some_and(|until| now >= until) {
            host.kill();
            (*since, *leaves_until) = (now, None);
        }
        if end.is_none() && now.duration_since(*since) < END_PATIENCE {
            return;
        }
        let ended = std::mem::replace(&mut self.phase, NetworkPhase::Down { until: now });
        let NetworkPhase::Ending { host, failure, age, .. } = ended else { return };
        if end.is_none() {
            self.unended.push(host);
        }
        self.note_end(failure.or(end).unwrap_or(NetworkFailure::NoAnswer), age, now);
    }

    /// Records an end with its cause, and schedules the start of the next network side.
    fn note_end(&mut self, failure: NetworkFailure, age: Option<Duration>, now: Instant) {
        let delay = self.hosts.note_end(&failure, age);
        let ends = self.state.restarts + 1;
        self.ends.push(now);
        // Not every end in a series with the same cause is worth a line.
        if self.state.last_failure.as_ref() != Some(&failure) || ends.is_power_of_two() {
            tracing::warn!(
                "the network side of ROS 2 has ended ({failure}), {ends} in all; starting it anew"
            );
        }
        self.reception.lose_writers();
        (self.state.is_up, self.state.last_failure) = (false, Some(failure));
        self.phase = NetworkPhase::Down { until: now + delay };
        // If the first network side ends, the start has not failed, since the next one may succeed.
        if let Some(starter) = self.starter.take() {
            let _ = starter.send(Ok(()));
        }
    }

    /// Sends the remaining messages, and waits for the network side to leave.
    async fn leave(&mut self) {
        self.deliver(&self.take_messages());
        if let NetworkPhase::Active(active) = &mut self.phase {
            active.link.queue(&ToNetwork::Stop);
            // Done in either case: it has ended, or the time is up.
            let _ = timeout(GOODBYE, active.end()).await;
        }
    }
}

impl Drop for Exchange {
    fn drop(&mut self) {
        let host = match &mut self.phase {
            NetworkPhase::Active(active) => Some(&mut active.host),
            NetworkPhase::Ending { host, .. } => Some(host),
            NetworkPhase::Down { .. } | NetworkPhase::Refused => None,
        };
        if let Some(host) = host.filter(|host| host.is_isolated()) {
            host.kill();
            for _ in 0..10 {
                if host.end().is_some() {
                    break;
                }
                thread::sleep(END_TICK);
            }
        }
        self.mailbox.update_status(|status| status.running = false);
        self.reception.inbox.close();
    }
}
