//! A bare participant, on which writers and readers are created.

use std::net::IpAddr;

use ros2_client::names::{Name, NodeName};
use rustdds::dds::result::CreateResult;
use rustdds::policy::{self, History};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher, QosPolicies, QosPolicyBuilder, Subscriber, Topic,
    TopicKind,
};

use super::topic_reader::DdsTopicReader;
use super::topic_writer::DdsTopicWriter;
use crate::error::TransportError;
use crate::link::{NetworkSettings, ReadTopic, WrittenTopic};
use crate::qos::{Delivery, Durability, LOG_LIFESPAN, Reliability};
use ros_messages::dds_type;

/// Creates a participant in a domain, which announces itself at once. It uses only these addresses of this
/// host, or all if the list is empty.
pub(super) fn participant_of(domain_id: u16, only_networks: &[IpAddr]) -> CreateResult<DomainParticipant> {
    let builder = DomainParticipantBuilder::new(domain_id);
    if only_networks.is_empty() {
        builder.build()
    } else {
        builder.with_only_networks(only_networks.iter().copied()).build()
    }
}

/// A participant with the name of our node, a publisher and a subscriber.
pub(super) struct DdsNode {
    pub(super) name: NodeName,
    pub(super) publisher: Publisher,
    pub(super) subscriber: Subscriber,
    /// Last field: RustDDS requires endpoints to be dropped before their participant.
    pub(super) domain: DomainParticipant,
}

impl DdsNode {
    pub(super) fn new(settings: &NetworkSettings, domain: DomainParticipant) -> Result<Self, TransportError> {
        Ok(Self {
            name: NodeName::new(&settings.namespace, &settings.node)?,
            publisher: domain.create_publisher(&QosPolicies::default())?,
            subscriber: domain.create_subscriber(&QosPolicies::default())?,
            domain,
        })
    }

    pub(super) fn writer(&self, written: &WrittenTopic) -> Result<DdsTopicWriter, TransportError> {
        let mut qos = qos(Reliability::Reliable, written.durability, written.depth);
        if written.delivery == Delivery::Log {
            qos = qos.lifespan(policy::Lifespan { duration: LOG_LIFESPAN.into() });
        }
        let topic = self.topic(&written.name, &written.type_name, &qos.build())?;
        Ok(DdsTopicWriter::new(&self.publisher, topic, written)?)
    }

    /// Creates a reader of a topic, with this durability.
    pub(super) fn reader(
        &self,
        read: &ReadTopic,
        durability: Durability,
    ) -> Result<DdsTopicReader, TransportError> {
        let qos = |durability| qos(read.reliability, durability, read.depth).build();
        let topic = self.topic(&read.name, &read.type_name, &qos(read.durability))?;
        Ok(DdsTopicReader::new(&self.subscriber, &topic, Some(qos(durability)))?)
    }

    fn topic(&self, name: &str, type_name: &str, qos: &QosPolicies) -> Result<Topic, TransportError> {
        let parsed =
            Name::parse(name).map_err(|why| TransportError::Topic { topic: name.to_owned(), why })?;
        let name = parsed.to_dds_name("rt", &self.name, "");
        Ok(self.domain.create_topic(name, dds_type(type_name), qos, TopicKind::NoKey)?)
    }
}

/// Returns this quality of service; a writer waits for at most 10 ms.
pub(super) fn qos(reliability: Reliability, durability: Durability, depth: i32) -> QosPolicyBuilder {
    let durability = match durability {
        Durability::TransientLocal => policy::Durability::TransientLocal,
        Durability::Volatile => policy::Durability::Volatile,
    };
    let reliability = match reliability {
        Reliability::Reliable => {
            policy::Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(10) }
        }
        Reliability::BestEffort => policy::Reliability::BestEffort,
    };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
}
