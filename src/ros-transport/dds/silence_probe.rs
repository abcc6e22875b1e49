//! A participant that shows whether writers are silent, or are sending without being received: see
//! [`SilentWriters`].
//!
//! [`SilentWriters`]: super::silent_writers::SilentWriters

use std::task::Waker;
use std::time::{Duration, Instant};

use ros2_client::NodeName;
use rustdds::{DomainParticipant, QosPolicies};

use super::participant::{dds, topic_reader};
use super::silent_writers::ReadWriter;
use super::topic_reader::{DdsTopicReader, TakenSample};
use crate::link::NetworkSettings;
use crate::qos::Durability;

/// Time within which writers are discovered and received.
const LIFE: Duration = Duration::from_secs(3);

/// Readers of the topics of suspected writers, on a separate participant. Samples that writers have kept for
/// late readers are not received here, only samples sent from now on.
pub(super) struct SilenceProbe {
    readers: Vec<(u16, DdsTopicReader)>,
    since: Instant,
    /// Last field: RustDDS requires endpoints to be dropped before their participant.
    domain: DomainParticipant,
}

impl SilenceProbe {
    /// Starts to read the topics of these writers with a new participant.
    pub(super) fn new(
        settings: &NetworkSettings,
        domain: DomainParticipant,
        suspected: &[ReadWriter],
        now: Instant,
    ) -> Result<Self, String> {
        let node = NodeName::new(&settings.namespace, &settings.node).map_err(|why| why.to_string())?;
        let subscriber = domain.create_subscriber(&QosPolicies::default()).map_err(dds)?;
        let topics = (0..=u16::MAX).zip(&settings.read);
        let topics = topics.filter(|(position, _)| suspected.iter().any(|(topic, _)| topic == position));
        let readers = topics.map(|(position, read)| {
            Ok((position, topic_reader((&domain, &subscriber), &node, read, Durability::Volatile)?))
        });
        Ok(Self { readers: readers.collect::<Result<_, String>>()?, since: now, domain })
    }

    /// Reads the samples that have arrived: `heard` receives each sample's writer and number.
    pub(super) fn take(&self, waker: &Waker, mut heard: impl FnMut(ReadWriter, i64)) {
        for (position, reader) in &self.readers {
            let is_more = reader.take(waker, |taken| {
                if let TakenSample::Sample(writer, number, _) = taken {
                    heard((*position, writer), number);
                }
                true
            });
            if is_more {
                waker.wake_by_ref();
            }
        }
    }

    /// Returns true once any writer not received by now counts as silent.
    pub(super) fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= LIFE
    }

    /// Returns the participant, for use as our next one.
    pub(super) fn into_participant(self) -> DomainParticipant {
        drop(self.readers);
        self.domain
    }
}
