//! A bare participant that searches for peers which the real participant can no longer find.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, DomainParticipantStatusListener, LostReason,
    StatusEvented,
};

/// The part of a participant's identity shared by all its endpoints.
pub(super) type Prefix = [u8; 12];

/// Time after which a missing peer is given up.
const GIVE_UP: Duration = Duration::from_secs(24 * 3600);
/// Maximum number of remembered missing peers; the oldest is given up first.
const MAX_MISSING: usize = 256;

/// Returns the prefix of an identity.
pub(super) fn prefix(bytes: &[u8]) -> Prefix {
    std::array::from_fn(|index| bytes.get(index).copied().unwrap_or(0))
}

/// Peers whose lease has expired, with the time of expiry.
#[derive(Debug, Default)]
pub(super) struct MissingPeers(BTreeMap<Prefix, Instant>);

impl MissingPeers {
    /// Adds a peer whose lease has expired.
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
    pub(super) fn give_up(&mut self, now: Instant) {
        self.0.retain(|_, since| now.saturating_duration_since(*since) < GIVE_UP);
    }

    /// Forgets all peers, since a new participant finds every one.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns true if the peer is missing.
    pub(super) fn contains(&self, peer: &Prefix) -> bool {
        self.0.contains_key(peer)
    }

    /// Returns the number of missing peers.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

/// Result of polling the probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProbeResult {
    /// No missing peer was discovered.
    NoneFound,
    /// A missing peer was discovered.
    PeerFound,
    /// The probe itself has lost a peer, which it could not find again.
    PeerLost,
}

/// A participant without writers and readers that only observes discovery.
pub(super) struct DiscoveryProbe {
    participant: DomainParticipant,
    events: DomainParticipantStatusListener,
}

impl DiscoveryProbe {
    /// Starts to observe with a new participant.
    pub(super) fn new(participant: DomainParticipant) -> Self {
        let events = participant.status_listener();
        Self { participant, events }
    }

    /// Handles the discovery events since the last call.
    pub(super) fn poll(&self, missing: &MissingPeers) -> ProbeResult {
        let mut result = ProbeResult::NoneFound;
        while let Some(event) = self.events.try_recv_status() {
            #[allow(clippy::wildcard_enum_match_arm)] // a foreign enum that may grow
            match event {
                DomainParticipantStatusEvent::ParticipantDiscovered { dpd }
                    if missing.contains(&prefix(&dpd.guid.to_bytes())) =>
                {
                    result = ProbeResult::PeerFound;
                }
                DomainParticipantStatusEvent::ParticipantLost {
                    reason: LostReason::Timeout { .. }, ..
                } => {
                    return ProbeResult::PeerLost;
                }
                _ => {}
            }
        }
        result
    }

    /// Returns the participant, for use with writers and readers.
    pub(super) fn into_participant(self) -> DomainParticipant {
        self.participant
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
        assert!(!missing.contains(&prefix(&[])), "the oldest went first");
        missing.give_up(start + GIVE_UP + Duration::from_millis(100));
        assert_eq!(missing.len(), MAX_MISSING - 100);
    }
}
