//! The node in the ROS 2 graph: its names, and the `ros_discovery_info` message.
//!
//! DDS knows participants and endpoints; which of them make up a node is stated by a message that every
//! ROS 2 participant publishes. Its identifiers are 24 bytes long up to Humble and 16 bytes since
//! Iron; that is all that differs between the builds.

use ros2_client::Gid;
use ros2_client::builtin_topics::ros_discovery::{QOS_PUB, TOPIC_NAME, TYPE_NAME};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::names::NodeName;
use rustdds::dds::result::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::{DomainParticipant, GUID, Publisher, RTPSEntity, Timestamp, TopicKind};

/// Publishes to the graph which writers and readers belong to our node.
pub(super) struct GraphEntry {
    participant: GUID,
    node: NodeName,
    writer: DataWriterCdr<ParticipantEntitiesInfo>,
}

impl GraphEntry {
    /// An entry that is not announced yet.
    pub(super) fn new(
        participant: &DomainParticipant,
        publisher: &Publisher,
        node: NodeName,
    ) -> CreateResult<Self> {
        let topic = participant.create_topic(
            TOPIC_NAME.to_owned(),
            TYPE_NAME.to_owned(),
            &QOS_PUB,
            TopicKind::NoKey,
        )?;
        let writer = publisher.create_datawriter_no_key_cdr(&topic, None)?;
        Ok(Self { participant: participant.guid(), node, writer })
    }

    /// Replaces the writers and readers that the graph lists for our node.
    pub(super) fn announce(
        &self,
        writers: impl IntoIterator<Item = GUID>,
        readers: impl IntoIterator<Item = GUID>,
    ) {
        let info = entities(self.participant, &self.node, writers, readers);
        if let Err(error) = self.writer.write(info, Some(Timestamp::now())) {
            tracing::warn!("the node is not shown in the ROS 2 graph: {error}");
        }
    }
}

fn entities(
    participant: GUID,
    node: &NodeName,
    writers: impl IntoIterator<Item = GUID>,
    readers: impl IntoIterator<Item = GUID>,
) -> ParticipantEntitiesInfo {
    let mut entry = NodeEntitiesInfo::new(node.clone());
    for reader in readers {
        entry.add_reader(Gid::from(reader));
    }
    for writer in writers {
        entry.add_writer(Gid::from(writer));
    }
    ParticipantEntitiesInfo::new(Gid::from(participant), vec![entry])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A participant's identifier, then a sequence of nodes: namespace, name, readers, writers.
    #[test]
    fn identifiers_have_the_length_of_the_distribution() {
        let long = if super::super::DISTRO == "humble" { 24 } else { 16 };
        let listed = |first: u8| {
            let mut bytes = vec![0; long];
            bytes[0] = first;
            bytes
        };
        let guid = |first: u8| {
            let mut bytes = [0; 16];
            bytes[0] = first;
            GUID::from_bytes(bytes)
        };
        let node = NodeName::new("/", "gw1").unwrap();
        let info = entities(guid(1), &node, [guid(2), guid(3)], [guid(4)]);
        let bytes = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&info).unwrap();
        let expected = [
            listed(1),
            vec![1, 0, 0, 0],                      // one node
            vec![2, 0, 0, 0, b'/', 0, 0, 0],       // namespace
            vec![4, 0, 0, 0, b'g', b'w', b'1', 0], // name
            vec![1, 0, 0, 0],                      // one reader
            listed(4),
            vec![2, 0, 0, 0], // two writers
            listed(2),
            listed(3),
        ]
        .concat();
        assert_eq!(bytes, expected);
    }
}
