//! The node in the ROS 2 graph: its names, and the `ros_discovery_info` message.
//!
//! DDS knows participants and endpoints; a message published by every ROS 2 participant states which of them
//! form a node. Its identifiers are 24 bytes long up to Humble and 16 bytes since Iron, which is the only
//! difference between the builds.
//!
//! On a network with the other layout our entry cannot be read, and with Cyclone DDS in Humble `ros2 node
//! list` then fails for all users. So the messages of other participants are inspected, and our entry is
//! withdrawn if one of them has the other layout.

use std::task::Waker;

use ros2_client::Gid;
use ros2_client::builtin_topics::ros_discovery::{QOS_PUB, TOPIC_NAME, TYPE_NAME};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::names::NodeName;
use rustdds::dds::result::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::{GUID, RTPSEntity, Timestamp, TopicKind};

use super::dds_node::DdsNode;
use super::topic_reader::{DdsTopicReader, TakenSample};
use crate::distribution::{DISTRO, LENGTHS, identifier_length};
use ros_messages::cdr::Endian;

/// Publishes to the graph the writers and readers of our node.
pub(super) struct GraphEntry {
    participant: GUID,
    node: NodeName,
    writer: DataWriterCdr<ParticipantEntitiesInfo>,
    reader: DdsTopicReader,
}

impl GraphEntry {
    /// Creates an entry that is not announced yet.
    pub(super) fn new(DdsNode { name, publisher, subscriber, domain }: &DdsNode) -> CreateResult<Self> {
        let (topic, type_name) = (TOPIC_NAME.to_owned(), TYPE_NAME.to_owned());
        let topic = domain.create_topic(topic, type_name, &QOS_PUB, TopicKind::NoKey)?;
        let writer = publisher.create_datawriter_no_key_cdr(&topic, None)?;
        let reader = DdsTopicReader::new(subscriber, &topic, None)?;
        Ok(Self { participant: domain.guid(), node: name.clone(), writer, reader })
    }

    /// Returns true if a message with the other layout has arrived since the last call; `waker` is called
    /// when a message arrives.
    pub(super) fn meets_other_layout(&self, waker: &Waker) -> bool {
        let mut is_met = false;
        let has_more = self.reader.take(waker, |taken| {
            if let TakenSample::Sample(_, _, encoded) = taken {
                let own = identifier_length(DISTRO);
                is_met |= layout(&encoded.bytes, encoded.endian).is_some_and(|length| length != own);
            }
            !is_met
        });
        if has_more {
            waker.wake_by_ref();
        }
        is_met
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

/// Returns the length of the identifiers in a message; `None` if the message has neither layout.
fn layout(bytes: &[u8], endian: Endian) -> Option<usize> {
    LENGTHS.into_iter().find(|length| {
        let mut cursor = Cursor { bytes, at: 0, endian };
        cursor.participant(*length).is_some() && bytes.len() - cursor.at < 4
    })
}

/// A read position in a CDR message. Each step returns `None` at the end of the message.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    endian: Endian,
}

impl Cursor<'_> {
    fn participant(&mut self, identifier: usize) -> Option<()> {
        self.skip(identifier)?;
        for _ in 0..self.count()? {
            for _text in ["namespace", "name"] {
                let length = self.count()?;
                self.skip(usize::try_from(length).ok()?)?;
            }
            for _list in ["readers", "writers"] {
                let count = usize::try_from(self.count()?).ok()?;
                self.skip(count.checked_mul(identifier)?)?;
            }
        }
        Some(())
    }

    fn count(&mut self) -> Option<u32> {
        let at = self.at.next_multiple_of(4);
        let bytes = self.bytes.get(at..)?.first_chunk()?;
        self.at = at + 4;
        Some(match self.endian {
            Endian::Little => u32::from_le_bytes(*bytes),
            Endian::Big => u32::from_be_bytes(*bytes),
        })
    }

    fn skip(&mut self, length: usize) -> Option<()> {
        self.at = self.at.checked_add(length).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }
}

fn entities(
    participant: GUID,
    node: &NodeName,
    writers: impl IntoIterator<Item = GUID>,
    readers: impl IntoIterator<Item = GUID>,
) -> ParticipantEntitiesInfo {
    let mut entry = NodeEntitiesInfo::new(node.clone());
    readers.into_iter().for_each(|reader| entry.add_reader(Gid::from(reader)));
    writers.into_iter().for_each(|writer| entry.add_writer(Gid::from(writer)));
    ParticipantEntitiesInfo::new(Gid::from(participant), vec![entry])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A participant's identifier, then a sequence of nodes: namespace, name, readers, writers.
    #[test]
    fn identifiers_have_the_length_of_the_distribution() {
        let long = if DISTRO == "humble" { 24 } else { 16 };
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
        assert_eq!(layout(&bytes, Endian::Little), Some(long));
    }

    #[test]
    fn the_layout_of_a_message_is_recognised() {
        let encoded = |length: usize, nodes: u32, listed: u32| {
            let mut bytes = vec![7; length];
            bytes.extend(nodes.to_be_bytes());
            for _ in 0..nodes {
                bytes.extend([0, 0, 0, 2, b'/', 0, 0, 0, 0, 0, 0, 4, b'g', b'w', b'1', 0]);
                for _ in 0..2 {
                    bytes.extend(listed.to_be_bytes());
                    bytes.extend(vec![9; length * listed as usize]);
                }
            }
            bytes
        };
        for (length, nodes, listed) in
            [(16, 0, 0), (24, 0, 0), (16, 1, 0), (24, 1, 0), (16, 2, 3), (24, 2, 3)]
        {
            let bytes = encoded(length, nodes, listed);
            assert_eq!(layout(&bytes, Endian::Big), Some(length), "{nodes} nodes, {listed}");
            assert_eq!(layout(&bytes[..bytes.len() - 4], Endian::Big), None);
        }
        let endless = [vec![0; 16], vec![255; 20]].concat();
        assert_eq!(layout(&endless, Endian::Little), None);
    }
}
