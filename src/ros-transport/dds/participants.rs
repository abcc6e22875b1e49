//! Our participant, and the participants that it has replaced.
//!
//! A replaced participant remains until all its peers have discovered its successor, which may itself have
//! been replaced meanwhile. So no peer misses a sample; some receive one twice. The gateway recognises
//! samples received twice by their numbers.

use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::{DomainParticipant, RTPSEntity as _};

use super::dds_node::participant_of;
use super::discovery_probe::{MissingPeers, Prefix, prefix};
use super::interfaces::Interfaces;
use super::loopback_announcer::LoopbackAnnouncer;
use super::participant::Participant;
use crate::error::TransportError;
use crate::link::{NetworkSettings, Order};

/// Minimum time for which a replaced participant remains next to its successor.
const OVERLAP: Duration = Duration::from_secs(1);
/// Maximum such time, if some of its readers have not found the successor: without multicast Cyclone polls a
/// silent port every 30 s.
const MAX_OVERLAP: Duration = Duration::from_secs(35);
/// Maximum number of replaced participants at the same time; usually few, since most leave within a second.
const MAX_PREDECESSORS: usize = 3;
/// Maximum number of own participants that are remembered; those of the last lease (50 s) would suffice.
const MAX_OWN: usize = 32;

/// All participants of this process, except probes.
pub(super) struct Participants {
    pub(super) current: Participant,
    /// The interfaces at the creation of the current participant.
    pub(super) interfaces: Interfaces,
    /// Replaced participants, oldest first, each with the time of its replacement.
    pub(super) predecessors: Vec<(Participant, Instant)>,
    /// Our own participants, present or gone, which never count as missing.
    pub(super) own: Vec<Prefix>,
    /// `None` where the loopback is not used.
    pub(super) announcer: Option<LoopbackAnnouncer>,
    /// Time of the last attempt to create a participant, also one for a probe.
    pub(super) last_made: Instant,
}

impl Participants {
    /// Joins the graph with the first participant.
    pub(super) fn join(settings: &NetworkSettings) -> Result<Self, TransportError> {
        let interfaces = Interfaces::now(&settings.only_networks).unwrap_or_default();
        // Created before the participant, which announces itself at once.
        let announcer = LoopbackAnnouncer::new(settings.domain_id, &settings.only_networks);
        let domain = participant_of(settings.domain_id, &settings.only_networks)?;
        let own = vec![prefix(&domain.guid().to_bytes())];
        let current = Participant::new(settings, domain)?;
        Ok(Self { current, interfaces, predecessors: Vec::new(), own, announcer, last_made: Instant::now() })
    }

    /// Creates a bare participant, for a probe or as our next one; logs why it cannot.
    pub(super) fn make(&mut self, settings: &NetworkSettings) -> Option<DomainParticipant> {
        self.last_made = Instant::now();
        let made = participant_of(settings.domain_id, &settings.only_networks);
        if let Ok(participant) = &made {
            if self.own.len() >= MAX_OWN {
                self.own.remove(0);
            }
            self.own.push(prefix(&participant.guid().to_bytes()));
        }
        made.inspect_err(|error| tracing::warn!("no new participant: {error}")).ok()
    }

    /// Returns true if the last attempt to create a participant was long enough ago for another one.
    pub(super) fn may_rebuild(&self, settings: &NetworkSettings) -> bool {
        self.last_made.elapsed() >= settings.recovery.min_rebuild_interval
    }

    /// Moves to another participant, created with these interfaces, and publishes the current samples there.
    /// Returns the outcome of publishing; `None` if the participant cannot be used, which is logged.
    pub(super) fn replace(
        &mut self,
        settings: &NetworkSettings,
        domain: DomainParticipant,
        interfaces: Interfaces,
        samples: &[Order],
    ) -> Option<Result<(), TransportError>> {
        let made = Participant::new(settings, domain);
        let mut successor = made.inspect_err(|error| tracing::warn!("no new participant: {error}")).ok()?;
        let carry_out = |(position, order)| successor.carry_out(position, order);
        let done = samples.iter().enumerate().map(carry_out).fold(Ok(()), Result::and);
        if self.predecessors.len() >= MAX_PREDECESSORS {
            self.predecessors.remove(0);
        }
        self.predecessors.push((std::mem::replace(&mut self.current, successor), Instant::now()));
        self.interfaces = interfaces;
        Some(done)
    }

    /// Returns the predecessors, oldest first, then our participant: some readers know only one of them.
    pub(super) fn all_mut(&mut self) -> impl Iterator<Item = &mut Participant> {
        self.predecessors.iter_mut().map(|(predecessor, _)| predecessor).chain([&mut self.current])
    }

    /// Drops each predecessor once all its peers have discovered our participant too.
    pub(super) fn retire(&mut self) {
        let Self { current, predecessors, own, .. } = self;
        predecessors.retain_mut(|(predecessor, since)| {
            // Peers that it loses are not missing: our participant has discovered them or never will. It is
            // polled, since it leaves soon; its errors do not matter.
            let _ = predecessor.observe(Waker::noop(), &mut MissingPeers::default(), own);
            let overlap = since.elapsed();
            overlap < OVERLAP || (overlap < MAX_OVERLAP && !current.serves_all_of(predecessor))
        });
    }
}
