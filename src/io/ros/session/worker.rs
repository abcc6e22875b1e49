//! The session's thread: mailbox to writers, readers to inbox, and a new participant when the old one cannot go on.

use std::sync::Arc;
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::RTPSEntity;

use super::ack_timeout::AckTimeout;
use super::discovery_probe::{DiscoveryProbe, Missing, Prefix, ProbeResult, prefix};
use super::duplicate_filter::DuplicateFilter;
use super::interfaces::Interfaces;
use super::mailbox::{Mailbox, OutgoingMessages};
use super::outgoing::{Delivery, LightsEncoders, Order, Outgoing, orders, table};
use super::participant::{Participant, participant};
use super::topic_reader::Taken;
use super::{IncomingStatus, OutgoingStatus, RosError, RosSettings};
use crate::core::gateway::event::Input;
use crate::core::traffic_light::input::TrafficLightInput;
use crate::io::ros::inbox::Inbox;

/// Longest sleep between two polls of the events of DDS.
const TICK: Duration = Duration::from_millis(100);
/// Shortest time that a replaced participant stays beside its successor.
const OVERLAP: Duration = Duration::from_secs(1);
/// Longest such time, when some of its readers have not found the successor: without multicast Cyclone
/// asks a port that was silent every 30 s.
const MAX_OVERLAP: Duration = Duration::from_secs(35);
/// Writers that a participant replaces before it is itself replaced, see [`Participant::replaced_writers`].
const MAX_REPLACED_WRITERS: u32 = 1000;
/// A round that takes longer means that the process was stopped. Peers may have given its participant up, and it does
/// not find them again.
const STANDSTILL: Duration = Duration::from_secs(2);
/// Own participants that are remembered; those of the last lease (50 s) would do.
const MAX_OWN: usize = 32;

/// The thread's state.
pub(super) struct Worker {
    settings: RosSettings,
    table: Vec<Outgoing>,
    encoders: LightsEncoders,
    mailbox: Arc<Mailbox>,
    inbox: Arc<Inbox>,
    /// Ends the mailbox's wait.
    waker: Waker,
    participant: Participant,
    /// With the time it was replaced.
    predecessor: Option<(Participant, Instant)>,
    /// With the interfaces it was made with.
    probe: Option<(DiscoveryProbe, Interfaces)>,
    missing: Missing,
    /// Our own participants, gone or not, which are never missing.
    own: Vec<Prefix>,
    /// The interfaces that our participant was made with.
    interfaces: Interfaces,
    /// The interfaces at the last check.
    last_interfaces: Interfaces,
    last_slow: Instant,
    last_made: Instant,
    ack_timeout: AckTimeout,
    last_round: Instant,
    stood_still: bool,
    write_failed: bool,
    /// The current order of each topic of the table, but for those delivered once.
    current: Vec<Order>,
    /// One for each subscription.
    duplicate_filters: Vec<DuplicateFilter>,
}

impl Worker {
    /// Joins the graph and starts with an empty status.
    pub(super) fn new(
        settings: RosSettings,
        mailbox: Arc<Mailbox>,
        inbox: Arc<Inbox>,
    ) -> Result<Self, RosError> {
        let interfaces = Interfaces::now(&settings.only_networks).unwrap_or_default();
        let table = table(&settings);
        let participant = participant(&settings).map_err(|error| RosError::Dds(error.to_string()))?;
        let participant = Participant::new(&settings, &table, participant)?;
        mailbox.update_status(|status| {
            status.running = true;
            status.outgoing = table.iter().map(OutgoingStatus::new).collect();
            status.incoming = settings.subscriptions.iter().map(IncomingStatus::new).collect();
        });
        let now = Instant::now();
        Ok(Self {
            waker: Waker::from(Arc::clone(&mailbox)),
            mailbox,
            inbox,
            predecessor: None,
            probe: None,
            missing: Missing::default(),
            own: vec![participant.prefix()],
            participant,
            last_interfaces: interfaces.clone(),
            interfaces,
            last_slow: now,
            last_made: now,
            ack_timeout: AckTimeout::default(),
            last_round: now,
            stood_still: false,
            write_failed: false,
            current: table.iter().map(|_| Order::Withdraw).collect(),
            duplicate_filters: settings.subscriptions.iter().map(|_| DuplicateFilter::default()).collect(),
            table,
            encoders: LightsEncoders::default(),
            settings,
        })
    }

    /// Works until the mailbox holds a stop.
    pub(super) fn run(mut self) {
        loop {
            let messages = self.mailbox.take(TICK);
            let now = Instant::now();
            // Making a participant may take as long.
            let made_one = self.last_made >= self.last_round;
            self.stood_still |= !made_one && now.duration_since(self.last_round) > STANDSTILL;
            self.last_round = now;
            self.deliver(&messages);
            if messages.stop {
                return;
            }
            self.receive();
            let settled = self.participant.settle();
            self.count_write_error(settled);
            self.participant.observe(&mut self.missing, &self.own);
            self.probe_discovery();
            if self.last_slow.elapsed() >= self.settings.recovery.check_interval {
                self.last_slow = Instant::now();
                self.check_network();
            }
            self.retire();
            self.update_status();
        }
    }

    /// Drops the predecessor once all its readers read the successor too.
    fn retire(&mut self) {
        let Some((predecessor, since)) = &mut self.predecessor else { return };
        // Peers that it loses are not missing: the successor has met them or never will.
        predecessor.observe(&mut Missing::default(), &self.own);
        let overlap = since.elapsed();
        if overlap >= MAX_OVERLAP || (overlap >= OVERLAP && self.participant.serves_all_of(predecessor)) {
            self.predecessor = None;
        }
    }

    fn deliver(&mut self, messages: &OutgoingMessages) {
        for (position, order) in orders(&self.table, &mut self.encoders, messages) {
            match order {
                Ok(order) => {
                    self.each(|participant| participant.carry_out(position, &order));
                    self.remember(position, order);
                }
                Err(error) => self.count_write_error(Err(error)),
            }
        }
    }

    fn remember(&mut self, position: usize, order: Order) {
        let is_once = self.table.get(position).is_some_and(|outgoing| outgoing.delivery == Delivery::Once);
        if let Some(current) = self.current.get_mut(position).filter(|_| !is_once) {
            *current = order;
        }
    }

    /// Hands received samples on to the inbox, those of the predecessor first: it reads on until its successor has met
    /// all writers.
    fn receive(&mut self) {
        let Self { duplicate_filters, inbox, mailbox, waker, .. } = self;
        let mut hand_over = |subscription: usize, taken: Taken| match taken {
            Taken::Sample(writer, number, input) => {
                let duplicate_filter = duplicate_filters.get_mut(subscription);
                if duplicate_filter.is_some_and(|duplicate_filter| duplicate_filter.is_first(writer, number))
                {
                    count(mailbox, subscription, |status| {
                        status.received += 1;
                        status.rejected_groups += rejected(&input);
                    });
                    inbox.put(subscription, input);
                }
            }
            Taken::Undecodable(error) => count(mailbox, subscription, |status| {
                if status.undecodable == 0 {
                    tracing::warn!("{}: a sample is not of the topic's type: {error}", status.name);
                }
                status.undecodable += 1;
            }),
        };
        let mut is_more = false;
        if let Some((predecessor, _)) = &self.predecessor {
            is_more |= predecessor.take(waker, &mut hand_over);
        }
        is_more |= self.participant.take(waker, &mut hand_over);
        if is_more {
            self.waker.wake_by_ref();
        }
    }

    /// Does it with our participant and, while that is being replaced, with its predecessor: some readers know only one
    /// of them.
    fn each(&mut self, mut act: impl FnMut(&mut Participant) -> Result<(), String>) {
        if let Some((predecessor, _)) = &mut self.predecessor {
            let _ = act(predecessor);
        }
        let done = act(&mut self.participant);
        self.count_write_error(done);
    }

    fn count_write_error(&mut self, written: Result<(), String>) {
        if let Err(error) = written {
            if !self.write_failed {
                tracing::warn!("RustDDS did not take a sample: {error}");
            }
            self.write_failed = true;
            self.mailbox.update_status(|status| status.write_errors += 1);
        }
    }

    /// Looks for missing peers, and moves to the probe when it has found one.
    fn probe_discovery(&mut self) {
        let Some((probe, _)) = &self.probe else { return };
        match probe.poll(&self.missing) {
            ProbeResult::NoneFound => {}
            ProbeResult::PeerLost => self.probe = None,
            ProbeResult::PeerFound => {
                if let Some((probe, interfaces)) = self.probe.take() {
                    tracing::info!("a DDS peer is back after an outage: continuing with a new participant");
                    self.replace(probe.into_participant(), interfaces);
                }
            }
        }
    }

    /// Checks interfaces, the probe itself, and whether our participant still works.
    fn check_network(&mut self) {
        self.missing.give_up(Instant::now());
        let now =
            Interfaces::now(&self.settings.only_networks).unwrap_or_else(|| self.last_interfaces.clone());
        let link_came_up = now.has_new_link_since(&self.last_interfaces);
        // An address counts when it was there at two checks: interfaces get theirs one by one.
        let settled = now == self.last_interfaces;
        self.last_interfaces = now;
        if self.missing.len() == 0 || link_came_up {
            self.probe = None;
        }
        if self.last_made.elapsed() < self.settings.recovery.min_rebuild_interval {
            return;
        }
        let new_address = settled && self.last_interfaces.has_new_address_since(&self.interfaces);
        let readers = self.participant.readers().sum();
        let unacknowledged =
            self.ack_timeout.observe(self.participant.is_acknowledged(), readers, Instant::now());
        let (write_failed, stood_still) = (self.write_failed, self.stood_still);
        let worn_out = self.participant.replaced_writers() >= MAX_REPLACED_WRITERS;
        if new_address || unacknowledged || write_failed || stood_still || worn_out {
            if let Some(participant) = self.make() {
                tracing::info!(
                    new_address,
                    unacknowledged,
                    write_failed,
                    stood_still,
                    worn_out,
                    "continuing with a new DDS participant"
                );
                self.replace(participant, self.last_interfaces.clone());
            }
        } else if self.missing.len() > 0 && self.probe.is_none() {
            self.probe = self
                .make()
                .map(|participant| (DiscoveryProbe::new(participant), self.last_interfaces.clone()));
        }
    }

    fn make(&mut self) -> Option<rustdds::DomainParticipant> {
        self.last_made = Instant::now();
        let made = participant(&self.settings);
        if let Ok(participant) = &made {
            if self.own.len() >= MAX_OWN {
                self.own.remove(0);
            }
            self.own.push(prefix(&participant.guid().to_bytes()));
        }
        made.inspect_err(|error| tracing::warn!("no new participant: {error}")).ok()
    }

    /// Moves to another participant and publishes there what is current.
    fn replace(&mut self, participant: rustdds::DomainParticipant, interfaces: Interfaces) {
        let mut successor = match Participant::new(&self.settings, &self.table, participant) {
            Ok(successor) => successor,
            Err(error) => {
                tracing::warn!("no new participant: {error}");
                return;
            }
        };
        let carry_out = |(position, order)| successor.carry_out(position, order);
        let done = self.current.iter().enumerate().map(carry_out).fold(Ok(()), Result::and);
        let predecessor = std::mem::replace(&mut self.participant, successor);
        self.predecessor = Some((predecessor, Instant::now()));
        self.interfaces = interfaces;
        self.probe = None;
        self.missing.clear();
        (self.write_failed, self.stood_still) = (false, false);
        self.count_write_error(done);
        self.mailbox.update_status(|status| status.rebuilds += 1);
    }

    fn update_status(&self) {
        let (missing, has_probe) = (self.missing.len(), self.probe.is_some());
        self.mailbox.update_status(|status| {
            for (outgoing, readers) in status.outgoing.iter_mut().zip(self.participant.readers()) {
                outgoing.readers = readers;
            }
            for (incoming, writers) in status.incoming.iter_mut().zip(self.participant.writers()) {
                incoming.writers = writers;
            }
            status.missing_peers = missing;
            status.has_probe = has_probe;
        });
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.mailbox.update_status(|status| status.running = false);
        self.inbox.close();
    }
}

fn count(mailbox: &Mailbox, subscription: usize, change: impl FnOnce(&mut IncomingStatus)) {
    mailbox.update_status(|status| status.incoming.get_mut(subscription).map(change).unwrap_or_default());
}

/// Groups of the input that could not be read.
fn rejected(input: &Input) -> u64 {
    if let Input::TrafficLight(TrafficLightInput::States { rejected, .. }) = input {
        u64::from(*rejected)
    } else {
        0
    }
}
