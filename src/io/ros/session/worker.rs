//! The session's thread: mailbox to writers, and a new participant when the old one is of no use.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rustdds::RTPSEntity;

use super::deafness::Deafness;
use super::interfaces::Interfaces;
use super::lookout::{Lookout, Missing, Prefix, Sighting, prefix};
use super::mailbox::{Letters, Mailbox, Wish};
use super::presence::{Presence, participant};
use super::{RosError, RosSettings};
use crate::io::ros::messages::{HazardLightsReport, TurnIndicatorsReport};

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
/// Own participants that are remembered; those of the last lease (50 s) would do.
const MOST_OWN: usize = 32;

/// The thread's state.
pub(super) struct Worker {
    settings: RosSettings,
    mailbox: Arc<Mailbox>,
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
    write_failed: bool,
    turn: Wish<TurnIndicatorsReport>,
    hazard: Wish<HazardLightsReport>,
}

impl Worker {
    /// Joins the graph.
    pub(super) fn new(settings: RosSettings, mailbox: Arc<Mailbox>) -> Result<Self, RosError> {
        let interfaces = Interfaces::now(&settings.only_networks).unwrap_or_default();
        let participant = participant(&settings).map_err(|error| RosError::Dds(error.to_string()))?;
        let presence = Presence::new(&settings, participant)?;
        mailbox.update_status(|status| status.running = true);
        let now = Instant::now();
        Ok(Self {
            settings,
            mailbox,
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
            write_failed: false,
            turn: Wish::Withdraw,
            hazard: Wish::Withdraw,
        })
    }

    /// Works until it is told to stop.
    pub(super) fn run(mut self) {
        loop {
            let letters = self.mailbox.take(TICK);
            let stop = letters.stop;
            self.deliver(letters);
            if stop {
                return;
            }
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

    fn deliver(&mut self, letters: Letters) {
        if let Some(wish) = letters.turn {
            self.turn = wish;
            self.each(|presence| presence.turn(wish));
        }
        if let Some(wish) = letters.hazard {
            self.hazard = wish;
            self.each(|presence| presence.hazard(wish));
        }
        for array in letters.diagnostics {
            self.each(|presence| presence.diagnostics(array.clone()));
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
        let readers = self.presence.readers().iter().sum();
        let deaf = self.deafness.observe(self.presence.is_acknowledged(), readers, Instant::now());
        if new_place || deaf || self.write_failed {
            if let Some(participant) = self.make() {
                let write_failed = self.write_failed;
                tracing::info!(new_place, deaf, write_failed, "continuing with a new DDS participant");
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
        let mut successor = match Presence::new(&self.settings, participant) {
            Ok(successor) => successor,
            Err(error) => {
                tracing::warn!("no new participant: {error}");
                return;
            }
        };
        let said = successor.turn(self.turn).and(successor.hazard(self.hazard));
        let predecessor = std::mem::replace(&mut self.presence, successor);
        self.predecessor = Some((predecessor, Instant::now()));
        self.interfaces = interfaces;
        self.lookout = None;
        self.missing.clear();
        self.write_failed = false;
        self.note(said);
        self.mailbox.update_status(|status| status.rebuilds += 1);
    }

    fn show(&self) {
        let [turn, hazard, diagnostics] = self.presence.readers();
        let missing = self.missing.len();
        self.mailbox.update_status(|status| {
            status.turn_readers = turn;
            status.hazard_readers = hazard;
            status.diagnostics_readers = diagnostics;
            status.missing_peers = missing;
        });
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.mailbox.update_status(|status| status.running = false);
    }
}
