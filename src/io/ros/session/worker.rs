//! The session's thread: mailbox to writers, readers to inbox, and a new participant when the old one is
//! of no use.

use std::sync::Arc;
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::RTPSEntity;

use super::deafness::Deafness;
use super::inlet::Taken;
use super::interfaces::Interfaces;
use super::lookout::{Lookout, Missing, Prefix, Sighting, prefix};
use super::mailbox::{Letters, Mailbox};
use super::outgoing::{Delivery, Order, Outgoing, orders, table};
use super::presence::{Presence, participant};
use super::repetition::Repetition;
use super::{IncomingStatus, OutgoingStatus, RosError, RosSettings};
use crate::io::ros::incoming::{Arrival, Inbox, Incoming};

/// The longest sleep; events of DDS are looked at this often.
const TICK: Duration = Duration::from_millis(100);
/// How often interfaces and missing peers are looked at.
const SLOW_TICK: Duration = Duration::from_secs(1);
/// How long a replaced participant stays beside its successor at least.
const OVERLAP: Duration = Duration::from_secs(1);
/// And at most, when some of its readers have not found the successor: without multicast Cyclone
/// asks a port that was silent every 30 s.
const MOST_OVERLAP: Duration = Duration::from_secs(35);
/// Participants are not made more often than this, the first included.
const MIN_INTERVAL: Duration = Duration::from_secs(3);
/// A round that took longer: the process was stopped meanwhile. Peers may have given its participant up,
/// and it does not find them again.
const STANDSTILL: Duration = Duration::from_secs(2);
/// Own participants that are remembered; those of the last lease (50 s) would do.
const MOST_OWN: usize = 32;

/// The thread's state.
pub(super) struct Worker {
    settings: RosSettings,
    table: Vec<Outgoing>,
    mailbox: Arc<Mailbox>,
    inbox: Arc<Inbox>,
    /// Rings the mailbox's bell.
    waker: Waker,
    presence: Presence,
    /// With the time it was replaced.
    predecessor: Option<(Presence, Instant)>,
    /// With the interfaces it was made with.
    lookout: Option<(Lookout, Interfaces)>,
    missing: Missing,
    /// Our own participants, gone or not; nobody to look for.
    own: Vec<Prefix>,
    /// What our participant was made with.
    interfaces: Interfaces,
    /// What was there at the last look.
    last_interfaces: Interfaces,
    last_slow: Instant,
    last_made: Instant,
    deafness: Deafness,
    last_round: Instant,
    stood_still: bool,
    write_failed: bool,
    /// What each topic of the table is to say, but for what is said once.
    current: Vec<Order>,
    /// Of each subscription.
    repetitions: Vec<Repetition>,
}

impl Worker {
    /// Joins the graph.
    pub(super) fn new(
        settings: RosSettings,
        mailbox: Arc<Mailbox>,
        inbox: Arc<Inbox>,
    ) -> Result<Self, RosError> {
        let interfaces = Interfaces::now(&settings.only_networks).unwrap_or_default();
        let table = table(&settings);
        let participant = participant(&settings).map_err(|error| RosError::Dds(error.to_string()))?;
        let presence = Presence::new(&settings, &table, participant)?;
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
            lookout: None,
            missing: Missing::default(),
            own: vec![presence.prefix()],
            presence,
            last_interfaces: interfaces.clone(),
            interfaces,
            last_slow: now,
            last_made: now,
            deafness: Deafness::default(),
            last_round: now,
            stood_still: false,
            write_failed: false,
            current: table.iter().map(|_| Order::Withdraw).collect(),
            repetitions: settings.subscriptions.iter().map(|_| Repetition::default()).collect(),
            table,
            settings,
        })
    }

    /// Works until it is told to stop.
    pub(super) fn run(mut self) {
        loop {
            let letters = self.mailbox.take(TICK);
            let now = Instant::now();
            // Making a participant may take as long.
            let made_one = self.last_made >= self.last_round;
            self.stood_still |= !made_one && now.duration_since(self.last_round) > STANDSTILL;
            self.last_round = now;
            self.deliver(&letters);
            if letters.stop {
                return;
            }
            self.receive();
            let settled = self.presence.settle();
            self.note(settled);
            self.presence.observe(&mut self.missing, &self.own);
            self.look_out();
            if self.last_slow.elapsed() >= SLOW_TICK {
                self.last_slow = Instant::now();
                self.look_around();
            }
            self.retire();
            self.show();
        }
    }

    /// Lets the predecessor go once everybody who reads it reads the successor too.
    fn retire(&mut self) {
        let Some((predecessor, since)) = &mut self.predecessor else { return };
        // Whom it loses is no news: the successor has met them or never will have.
        predecessor.observe(&mut Missing::default(), &self.own);
        let overlap = since.elapsed();
        if overlap >= MOST_OVERLAP || (overlap >= OVERLAP && self.presence.serves_all_of(predecessor)) {
            self.predecessor = None;
        }
    }

    fn deliver(&mut self, letters: &Letters) {
        for (position, order) in orders(&self.table, letters) {
            match order {
                Ok(order) => {
                    self.each(|presence| presence.carry_out(position, &order));
                    self.remember(position, order);
                }
                Err(error) => self.note(Err(error)),
            }
        }
    }

    fn remember(&mut self, position: usize, order: Order) {
        let is_said_once =
            self.table.get(position).is_some_and(|outgoing| outgoing.delivery == Delivery::Once);
        if let Some(current) = self.current.get_mut(position).filter(|_| !is_said_once) {
            *current = order;
        }
    }

    /// Hands on what was received. The predecessor first: it reads on until its successor has met all.
    fn receive(&mut self) {
        let Self { repetitions, inbox, mailbox, waker, .. } = self;
        let mut hand_over = |subscription: usize, taken: Taken| match taken {
            Taken::Sample(writer, number, incoming) => {
                let repetition = repetitions.get_mut(subscription);
                if repetition.is_some_and(|repetition| repetition.is_first(writer, number)) {
                    count(mailbox, subscription, |status| {
                        status.received += 1;
                        status.rejected_groups += rejected(&incoming);
                    });
                    inbox.put(Arrival { subscription, incoming });
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
        is_more |= self.presence.take(waker, &mut hand_over);
        if is_more {
            self.waker.wake_by_ref();
        }
    }

    /// While a participant is being replaced, both speak: some readers know only one of them.
    fn each(&mut self, mut say: impl FnMut(&mut Presence) -> Result<(), String>) {
        if let Some((predecessor, _)) = &mut self.predecessor {
            let _ = say(predecessor);
        }
        let said = say(&mut self.presence);
        self.note(said);
    }

    fn note(&mut self, written: Result<(), String>) {
        if let Err(error) = written {
            if !self.write_failed {
                tracing::warn!("RustDDS did not take a sample: {error}");
            }
            self.write_failed = true;
            self.mailbox.update_status(|status| status.write_errors += 1);
        }
    }

    /// Looks for missing peers, and moves to the lookout when it found one.
    fn look_out(&mut self) {
        let Some((lookout, _)) = &self.lookout else { return };
        match lookout.look(&self.missing) {
            Sighting::Nobody => {}
            Sighting::Blind => self.lookout = None,
            Sighting::Found => {
                if let Some((lookout, interfaces)) = self.lookout.take() {
                    tracing::info!("a DDS peer is back after an outage: continuing with a new participant");
                    self.replace(lookout.into_participant(), interfaces);
                }
            }
        }
    }

    /// What needs no hurry: interfaces, the lookout itself, a participant that stopped working.
    fn look_around(&mut self) {
        self.missing.give_up(Instant::now());
        let now =
            Interfaces::now(&self.settings.only_networks).unwrap_or_else(|| self.last_interfaces.clone());
        let link_came_up = now.has_new_link_since(&self.last_interfaces);
        // An address counts when it was there twice: interfaces get theirs one by one.
        let settled = now == self.last_interfaces;
        self.last_interfaces = now;
        if self.missing.len() == 0 || link_came_up {
            self.lookout = None;
        }
        if self.last_made.elapsed() < MIN_INTERVAL {
            return;
        }
        let new_place = settled && self.last_interfaces.has_new_place_since(&self.interfaces);
        let readers = self.presence.readers().sum();
        let deaf = self.deafness.observe(self.presence.is_acknowledged(), readers, Instant::now());
        let (write_failed, stood_still) = (self.write_failed, self.stood_still);
        if new_place || deaf || write_failed || stood_still {
            if let Some(participant) = self.make() {
                tracing::info!(
                    new_place,
                    deaf,
                    write_failed,
                    stood_still,
                    "continuing with a new DDS participant"
                );
                self.replace(participant, self.last_interfaces.clone());
            }
        } else if self.missing.len() > 0 && self.lookout.is_none() {
            self.lookout =
                self.make().map(|participant| (Lookout::new(participant), self.last_interfaces.clone()));
        }
    }

    fn make(&mut self) -> Option<rustdds::DomainParticipant> {
        self.last_made = Instant::now();
        let made = participant(&self.settings);
        if let Ok(participant) = &made {
            if self.own.len() >= MOST_OWN {
                self.own.remove(0);
            }
            self.own.push(prefix(&participant.guid().to_bytes()));
        }
        made.inspect_err(|error| tracing::warn!("no new participant: {error}")).ok()
    }

    /// Moves to another participant and says there what is current.
    fn replace(&mut self, participant: rustdds::DomainParticipant, interfaces: Interfaces) {
        let mut successor = match Presence::new(&self.settings, &self.table, participant) {
            Ok(successor) => successor,
            Err(error) => {
                tracing::warn!("no new participant: {error}");
                return;
            }
        };
        let say = |(position, order)| successor.carry_out(position, order);
        let said = self.current.iter().enumerate().map(say).fold(Ok(()), Result::and);
        let predecessor = std::mem::replace(&mut self.presence, successor);
        self.predecessor = Some((predecessor, Instant::now()));
        self.interfaces = interfaces;
        self.lookout = None;
        self.missing.clear();
        (self.write_failed, self.stood_still) = (false, false);
        self.note(said);
        self.mailbox.update_status(|status| status.rebuilds += 1);
    }

    fn show(&self) {
        let missing = self.missing.len();
        self.mailbox.update_status(|status| {
            for (outgoing, readers) in status.outgoing.iter_mut().zip(self.presence.readers()) {
                outgoing.readers = readers;
            }
            for (incoming, writers) in status.incoming.iter_mut().zip(self.presence.writers()) {
                incoming.writers = writers;
            }
            status.missing_peers = missing;
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

fn rejected(incoming: &Incoming) -> u64 {
    match incoming {
        Incoming::Groups { groups, .. } => groups.rejected.len() as u64,
        Incoming::Command(_)
        | Incoming::Told(_)
        | Incoming::TurnCommand { .. }
        | Incoming::HazardCommand { .. }
        | Incoming::ControlMode { .. } => 0,
    }
}
