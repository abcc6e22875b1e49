//! A bare participant that searches for peers which the real participant can no longer find.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, DomainParticipantStatusListener, LostReason,
    StatusEvented,
};

use super::interfaces::Interfaces;

/// The part of a participant's identity shared by all its endpoints.
pub(super) type Prefix = [u8; 12];

/// Time after which a missing peer is given up.
const GIVE_UP: Duration = Duration::from_secs(24 * 3600);
/// Maximum number of remembered missing peers; the oldest is given up first.
const MAX_MISSING: usize = 256;

pub(super) fn prefix(bytes: &[u8]) -> Prefix {
    std::array::from_fn(|index| bytes.get(index).copied().unwrap_or(0))
}

/// Peers whose lease has expired, with the time of expiry.
#[derive(Debug, Default)]
pub(super) struct MissingPeers(BTreeMap<Prefix, Instant>);

impl MissingPeers {
    pub(super) fn insert(&mut self, peer: Prefix, now: Instant) {
        if self.0.len() >= MAX_MISSING
            && let Some(oldest) = self.0.iter().min_by_key(|(_, since)| **since).map(|(peer, _)| *peer)
        {
            self.0.remove(&oldest);
        }
        self.0.insert(peer, now);
    }

    /// Removes a peer that has left properly.
    pub(super) fn remove(&mut self, peer: &Prefix) {
        self.0.remove(peer);
    }

    /// Forgets the peers that have been missing for too long.
    fn give_up(&mut self, now: Instant) {
        self.0.retain(|_, since| now.saturating_duration_since(*since) < GIVE_UP);
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

/// The search for missing peers.
#[derive(Default)]
pub(super) struct PeerWatch {
    pub(super) missing: MissingPeers,
    /// The probe, with the interfaces at its creation.
    pub(super) probe: Option<(DiscoveryProbe, Interfaces)>,
}

impl PeerWatch {
    /// Gives up peers that have been missing for too long. Drops the probe if none is left, or if a link has
    /// come up: a new probe announces itself at once instead of within 10 s.
    pub(super) fn check(&mut self, link_came_up: bool) {
        self.missing.give_up(Instant::now());
        if self.missing.len() == 0 || link_came_up {
            self.probe = None;
        }
    }

    pub(super) fn lacks_probe(&self) -> bool {
        self.missing.len() > 0 && self.probe.is_none()
    }

    /// Starts a probe with this participant, if any, which was created with these interfaces.
    pub(super) fn search(&mut self, participant: Option<DomainParticipant>, interfaces: &Interfaces) {
        self.probe = participant.map(|participant| (DiscoveryProbe::new(participant), interfaces.clone()));
    }

    /// Returns true if the probe has discovered a missing peer. Drops a probe that has lost a peer, which it
    /// could not find again.
    pub(super) fn is_one_back(&mut self) -> bool {
        let found = self.probe.as_ref().and_then(|(probe, _)| probe.finds_one_of(&self.missing));
        if found.is_none() {
            self.probe = None;
        }
        found == Some(true)
    }

    /// Removes the probe; returns its participant, and the interfaces at its creation.
    pub(super) fn take_probe(&mut self) -> Option<(DomainParticipant, Interfaces)> {
        self.probe.take().map(|(probe, interfaces)| (probe.participant, interfaces))
    }
}

/// A participant without writers and readers that only observes discovery.
pub(super) struct DiscoveryProbe {
    participant: DomainParticipant,
    events: DomainParticipantStatusListener,
}

impl DiscoveryProbe {
    fn new(participant: DomainParticipant) -> Self {
        let events = participant.status_listener();
        Self { participant, events }
    }

    /// Handles the discovery events since the last call; returns true if one of these peers was discovered,
    /// and `None` if the probe itself has lost a peer.
    fn finds_one_of(&self, missing: &MissingPeers) -> Option<bool> {
        let mut is_found = false;
        while let Some(event) = self.events.try_recv_status() {
            #[allow(clippy::wildcard_enum_match_arm)] // a foreign enum that may grow
            match event {
                DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => {
                    is_found |= missing.0.contains_key(&prefix(&dpd.guid.to_bytes()));
                }
                DomainParticipantStatusEvent::ParticipantLost {
                    reason: LostReason::Timeout { .. }, ..
                } => return None,
                _ => {}
            }
        }
        Some(is_found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_peers_are_bounded_and_given_up_after_a_day() {
        let start = Instant::now();
        let mut missing = MissingPeers::default();
        for number in 0..=MAX_MISSING {
            let peer = prefix(&u64::try_from(number).unwrap().to_be_bytes());
            missing.insert(peer, start + Duration::from_millis(u64::try_from(number).unwrap()));
        }
        assert_eq!(missing.len(), MAX_MISSING);
        assert!(!missing.0.contains_key(&prefix(&[])), "the oldest went first");
        missing.give_up(start + GIVE_UP + Duration::from_millis(100));
        assert_eq!(missing.len(), MAX_MISSING - 100);
    }
}
