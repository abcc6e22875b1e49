//! A participant without readers and writers that records the endpoints announced by discovery.

use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustdds::policy::{Durability as DdsDurability, Reliability as DdsReliability};
use rustdds::{
    DomainParticipantStatusEvent, EndpointDescription, GUID, QosPolicies, RTPSEntity, StatusEvented,
};

use super::dds_node::participant_of;
use super::discovery_probe::{Prefix, prefix};
use super::loopback_announcer::LoopbackAnnouncer;
use super::type_check::ros_type;
use crate::error::TransportError;
use crate::qos::{Durability, Reliability};
use crate::survey::{DdsEndpoint, DomainSurvey, MAX_ENDPOINTS};

/// Pause between two reads of the events, of which RustDDS keeps 2,048.
const PAUSE: Duration = Duration::from_millis(20);
const MAX_PARTICIPANTS: usize = 1000;

/// DDS implementations by the vendor number at the start of an identity.
const IMPLEMENTATIONS: [([u8; 2], &str); 5] = [
    ([1, 1], "RTI Connext"),
    ([1, 15], "Fast DDS"),
    ([1, 16], "Cyclone DDS"),
    ([1, 18], "RustDDS"),
    ([1, 20], "Dust DDS"),
];

#[derive(Default)]
struct Announced {
    participants: BTreeSet<Prefix>,
    writers: BTreeMap<GUID, DdsEndpoint>,
    readers: BTreeMap<GUID, DdsEndpoint>,
}

/// Joins a domain without readers and writers for `time`, and returns what discovery announced.
///
/// # Errors
/// Returns the reason why the domain cannot be joined.
pub fn survey(
    domain_id: u16,
    only_networks: &[IpAddr],
    topics: &[String],
    time: Duration,
) -> Result<DomainSurvey, TransportError> {
    // Created before the participant, which announces itself at once.
    let announcer = LoopbackAnnouncer::new(domain_id, only_networks);
    let participant = participant_of(domain_id, only_networks)?;
    let own = prefix(&participant.guid().to_bytes());
    let events = participant.status_listener();
    let (end, mut announced) = (Instant::now() + time, Announced::default());
    while Instant::now() < end {
        if let Some(announcer) = &announcer {
            announcer.send_on(&[own]);
        }
        while let Some(event) = events.try_recv_status() {
            announced.take(event, own, topics);
        }
        sleep(PAUSE);
    }
    Ok(DomainSurvey {
        domain_id,
        participants: announced.participants.len(),
        writers: announced.writers.into_values().collect(),
        readers: announced.readers.into_values().collect(),
    })
}

impl Announced {
    fn take(&mut self, event: DomainParticipantStatusEvent, own: Prefix, topics: &[String]) {
        #[allow(clippy::wildcard_enum_match_arm)] // a foreign enum that may grow
        match event {
            DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => {
                let peer = prefix(&dpd.guid.to_bytes());
                if peer != own && self.participants.len() < MAX_PARTICIPANTS {
                    self.participants.insert(peer);
                }
            }
            DomainParticipantStatusEvent::ParticipantLost { id, .. } => {
                self.participants.remove(&prefix(id.as_ref()));
                let is_left = |guid: &GUID, _: &mut DdsEndpoint| guid.prefix != id;
                self.writers.retain(is_left);
                self.readers.retain(is_left);
            }
            DomainParticipantStatusEvent::WriterDetected { writer } => {
                let usual = DdsReliability::Reliable { max_blocking_time: rustdds::Duration::ZERO };
                note(&mut self.writers, writer, usual, own, topics);
            }
            DomainParticipantStatusEvent::ReaderDetected { reader } => {
                note(&mut self.readers, reader, DdsReliability::BestEffort, own, topics);
            }
            DomainParticipantStatusEvent::WriterLost { guid, .. } => _ = self.writers.remove(&guid),
            DomainParticipantStatusEvent::ReaderLost { guid, .. } => _ = self.readers.remove(&guid),
            _ => {}
        }
    }
}

/// Records an endpoint of another participant on one of these topics.
fn note(
    endpoints: &mut BTreeMap<GUID, DdsEndpoint>,
    EndpointDescription { guid, topic_name, type_name, qos, .. }: EndpointDescription,
    unless_announced: DdsReliability,
    own: Prefix,
    topics: &[String],
) {
    let identity = guid.to_bytes();
    let topic = topics.iter().find(|topic| topic_name.strip_prefix("rt") == Some(topic));
    let Some(topic) = topic.filter(|_| prefix(&identity) != own && endpoints.len() < MAX_ENDPOINTS) else {
        return;
    };
    let (reliability, durability) = kinds(&qos, unless_announced);
    let vendor = IMPLEMENTATIONS.iter().find(|(vendor, _)| identity.starts_with(vendor));
    let implementation = vendor.map_or("another DDS", |(_, name)| name).to_owned();
    let (topic, type_name) = (topic.clone(), ros_type(&type_name));
    endpoints.insert(guid, DdsEndpoint { topic, type_name, reliability, durability, implementation });
}

fn kinds(qos: &QosPolicies, unless_announced: DdsReliability) -> (Reliability, Durability) {
    let reliability = match qos.reliability().unwrap_or(unless_announced) {
        DdsReliability::Reliable { .. } => Reliability::Reliable,
        DdsReliability::BestEffort => Reliability::BestEffort,
    };
    let durability = match qos.durability() {
        None | Some(DdsDurability::Volatile) => Durability::Volatile,
        Some(DdsDurability::TransientLocal | DdsDurability::Transient | DdsDurability::Persistent) => {
            Durability::TransientLocal
        }
    };
    (reliability, durability)
}
