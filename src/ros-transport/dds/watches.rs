//! The watches for the [causes](RebuildCause) to replace our participant.

use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::DomainParticipant;

use super::ack_timeout::AckTimeout;
use super::discovery_probe::PeerWatch;
use super::interfaces::{AddressWatch, Interfaces};
use super::participants::Participants;
use super::set_back::SetBack;
use super::silence_probe::WriterWatch;
use crate::link::NetworkSettings;
use crate::processor_wait::ProcessorWait;
use crate::rebuild_cause::RebuildCause;

/// Number of replaced writers after which a participant is itself replaced, see
/// [`Participant::replaced_writers`](super::participant::Participant::replaced_writers).
const MAX_REPLACED_WRITERS: u32 = 1000;
/// A longer round, without the time for which the worker waited for a processor, means that the process was
/// stopped or hung.
const STANDSTILL: Duration = Duration::from_secs(2);
/// After a longer round peers may have lost us, whatever the reason: RustDDS announces a lease of 50 s every
/// 10 s.
const LEASE: Duration = Duration::from_secs(40);

/// A round of the worker.
#[derive(Debug, Clone, Copy)]
struct Round {
    length: Duration,
    /// For how much of it the worker waited for a processor.
    waited: Duration,
}

impl Round {
    /// Returns true if peers may have lost us, and not only because this computer is busy.
    fn is_standstill(self) -> bool {
        self.length.saturating_sub(self.waited) > STANDSTILL || self.length > LEASE
    }
}

pub(super) struct Watches {
    pub(super) peers: PeerWatch,
    wall_clock: SetBack,
    pub(super) writers: WriterWatch,
    acknowledgements: AckTimeout,
    addresses: AddressWatch,
    /// RustDDS did not take a sample since the last replacement.
    pub(super) write_failed: bool,
    stood_still: bool,
    processor: ProcessorWait,
    /// The worker's wait for a processor until the last round, since its start.
    waited: Duration,
    pub(super) last_round: Instant,
    last_check: Instant,
}

impl Watches {
    pub(super) fn new(participants: &Participants, processor: ProcessorWait) -> Self {
        let now = Instant::now();
        Self {
            peers: PeerWatch::default(),
            wall_clock: SetBack::watch(),
            writers: WriterWatch::new(now),
            acknowledgements: AckTimeout::default(),
            addresses: AddressWatch::new(participants.interfaces.clone()),
            write_failed: false,
            stood_still: false,
            waited: processor.total(),
            processor,
            last_round: now,
            last_check: now,
        }
    }

    /// Begins a round. The length of the last one shows whether the process was stopped or hung.
    pub(super) fn begin_round(&mut self, participants: &Participants) {
        let now = Instant::now();
        // Creating a participant may take as long.
        let made_one = participants.last_made >= self.last_round;
        let waited = self.processor.total();
        let round =
            Round { length: now.duration_since(self.last_round), waited: waited.saturating_sub(self.waited) };
        self.stood_still |= !made_one && round.is_standstill();
        (self.last_round, self.waited) = (now, waited);
    }

    /// Reads the interfaces, and gives up peers and probes, if a check of the network is due; returns true if
    /// it was.
    pub(super) fn check(&mut self, settings: &NetworkSettings) -> bool {
        if self.last_check.elapsed() < settings.recovery.check_interval {
            return false;
        }
        self.last_check = Instant::now();
        let link_came_up = self.addresses.check(&settings.only_networks);
        self.peers.check(link_came_up);
        true
    }

    /// Returns true if the participant must be replaced for this cause.
    pub(super) fn observe(
        &mut self,
        cause: RebuildCause,
        settings: &NetworkSettings,
        waker: &Waker,
        participants: &mut Participants,
    ) -> bool {
        let current = &mut participants.current;
        match cause {
            RebuildCause::PeerReturned => self.peers.is_one_back(),
            RebuildCause::ClockSetBack => self.wall_clock.is_to_follow(),
            RebuildCause::WriterUnheard => {
                self.writers.is_one_unheard(settings, waker, self.last_round, participants)
            }
            RebuildCause::Unacknowledged => {
                let readers = current.readers().sum();
                self.acknowledgements.observe(current.is_acknowledged(), readers, Instant::now())
            }
            RebuildCause::NewAddress => self.addresses.is_new_since(&participants.interfaces),
            RebuildCause::WriteFailed => self.write_failed,
            RebuildCause::StoodStill => self.stood_still,
            RebuildCause::WornOut => current.replaced_writers() >= MAX_REPLACED_WRITERS,
        }
    }

    /// Returns the participant to continue with after this cause, and the interfaces at its creation: the
    /// probe's participant if a probe has found the cause, otherwise a new one. `None` if there is none.
    pub(super) fn successor(
        &mut self,
        cause: RebuildCause,
        settings: &NetworkSettings,
        participants: &mut Participants,
    ) -> Option<(DomainParticipant, Interfaces)> {
        let domain = match cause {
            RebuildCause::PeerReturned => return self.peers.take_probe(),
            RebuildCause::WriterUnheard => self.writers.take_probe()?,
            RebuildCause::ClockSetBack
            | RebuildCause::Unacknowledged
            | RebuildCause::NewAddress
            | RebuildCause::WriteFailed
            | RebuildCause::StoodStill
            | RebuildCause::WornOut => participants.make(settings)?,
        };
        if cause == RebuildCause::ClockSetBack {
            self.wall_clock.note_followed();
        }
        Some((domain, self.addresses.last.clone()))
    }

    /// Starts over after a replacement, since a new participant finds every peer.
    pub(super) fn note_replaced(&mut self) {
        self.peers = PeerWatch::default();
        // Also a probe that has found another cause.
        self.writers.take_probe();
        (self.write_failed, self.stood_still) = (false, false);
    }

    /// Starts a search for missing peers, unless there is one.
    pub(super) fn search_peers(&mut self, settings: &NetworkSettings, participants: &mut Participants) {
        if self.peers.lacks_probe() {
            let domain = participants.make(settings);
            self.peers.search(domain, &self.addresses.last);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worker_without_a_processor_does_not_stand_still_until_its_lease_may_have_ended() {
        let is_standstill = |length_s, waited_s| {
            let [length, waited] = [length_s, waited_s].map(Duration::from_secs_f64);
            Round { length, waited }.is_standstill()
        };
        assert!(!is_standstill(2.0, 0.0));
        assert!(is_standstill(2.1, 0.0), "stopped, or it hung");
        assert!(!is_standstill(12.0, 11.9), "a busy computer");
        assert!(is_standstill(12.0, 9.9), "it had a processor for 2.1 s");
        assert!(is_standstill(40.1, 40.1), "peers may have lost it");
        assert!(!is_standstill(1.0, 3.0), "the sums are read after the clock");
    }
}
