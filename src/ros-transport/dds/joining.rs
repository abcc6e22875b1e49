//! Joins the graph: creates the first participant and its companions.

use std::net::Ipv4Addr;

use super::interfaces::Interfaces;
use super::loopback_announcer::LoopbackAnnouncer;
use super::participant::{Participant, participant};
use crate::link::NetworkSettings;

/// Result of joining the graph.
pub(super) struct JoinedParticipant {
    pub(super) participant: Participant,
    /// The interfaces with which the participant was created.
    pub(super) interfaces: Interfaces,
    /// `None` where the loopback is not used.
    pub(super) announcer: Option<LoopbackAnnouncer>,
}

/// Joins the graph. The error is a text for the user.
pub(super) fn join(settings: &NetworkSettings) -> Result<JoinedParticipant, String> {
    let interfaces = Interfaces::now(&settings.only_networks).unwrap_or_default();
    let only = &settings.only_networks;
    let uses_loopback = only.is_empty() || only.contains(&Ipv4Addr::LOCALHOST.into());
    // Created before the participant, which announces itself at once.
    let announcer = uses_loopback.then(|| LoopbackAnnouncer::new(settings.domain_id)).flatten();
    let domain = participant(settings).map_err(|error| error.to_string())?;
    Ok(JoinedParticipant { participant: Participant::new(settings, domain)?, interfaces, announcer })
}
