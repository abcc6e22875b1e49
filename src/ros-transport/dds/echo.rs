//! A sample that a participant sends to itself: it returns only while RustDDS sends and receives.
//!
//! It does not return without a network, nor on a loopback without multicast, where RustDDS sends nothing to
//! itself. In that case RustDDS's thread still reports that no sample arrived within the deadline requested
//! by the reader.
//!
//! The topic is not a ROS topic, and each participant has its own, so that no one else reads it. Its name
//! begins with `DCPS`, like DDS's own topics: ROS 2 omits such topics from its lists and from its search for
//! type hashes. A lost sample does no harm, as the next follows soon.

use std::task::Waker;
use std::time::Instant;

use rustdds::dds::result::CreateResult;
use rustdds::no_key::{DeserializedCacheChange, SimpleDataReaderCdr};
use rustdds::policy::Deadline;
use rustdds::{DataReaderStatus, RTPSEntity, StatusEvented, TopicKind};

use super::dds_node::{DdsNode, qos};
use super::discovery_probe::Prefix;
use super::sample::SampleWriter;
use super::witness::Witness;
use crate::error::TransportError;
use crate::qos::{Durability, Reliability};

/// Maximum number of echoes and events read at once; there are never more waiting.
const MAX_AT_ONCE: usize = 16;
/// Time after which a missing echo is noticed.
const DEADLINE: rustdds::Duration = rustdds::Duration::from_millis(200);

/// Signs of life of RustDDS.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SignsOfLife {
    /// The highest number that returned since the last call.
    pub(super) echo: Option<u64>,
    /// RustDDS's thread has reported a missing sample since the last call.
    pub(super) noticed_silence: bool,
    /// Samples received since the last call by a reader outside the participant.
    pub(super) witnessed: u64,
}

/// A writer and a reader of numbers on one participant.
pub(super) struct Echo {
    writer: SampleWriter,
    reader: SimpleDataReaderCdr<u64>,
    /// `None` where the loopback cannot be used.
    witness: Option<Witness>,
}

impl Echo {
    pub(super) fn new(DdsNode { publisher, subscriber, domain, .. }: &DdsNode) -> CreateResult<Self> {
        let qos = qos(Reliability::BestEffort, Durability::Volatile, 1).deadline(Deadline(DEADLINE)).build();
        let guid = domain.guid().to_bytes();
        let name = guid.iter().take(12).map(|byte| format!("{byte:02x}")).collect::<String>();
        let (name, type_name) = (format!("DCPS_signal_gateway/echo/{name}"), "signal_gateway::Echo");
        let witness = Witness::new(domain, &name, type_name, Instant::now());
        let topic = domain.create_topic(name, type_name.to_owned(), &qos, TopicKind::NoKey)?;
        Ok(Self {
            witness,
            writer: publisher.create_datawriter_no_key(&topic, None)?,
            reader: subscriber.create_simple_datareader_no_key(&topic, None)?,
        })
    }

    /// Returns true for the identity of the witness next to the participant.
    pub(super) fn is_witness(&self, peer: &Prefix) -> bool {
        self.witness.as_ref().is_some_and(|witness| witness.prefix == *peer)
    }

    pub(super) fn send(&self, number: u64) -> Result<(), TransportError> {
        Ok(self.writer.write(number.to_le_bytes().to_vec().into(), None)?)
    }

    /// Returns the signs of life since the last call; `waker` is called when an echo returns.
    pub(super) fn take(&mut self, waker: &Waker, now: Instant) -> SignsOfLife {
        self.reader.set_waker(Some(waker.clone()));
        self.reader.drain_read_notifications();
        let numbers = (0..MAX_AT_ONCE).map_while(|_| self.reader.try_take_one().ok().flatten());
        let echo = numbers.map(DeserializedCacheChange::into_value).max();
        let events = (0..MAX_AT_ONCE).map_while(|_| self.reader.try_recv_status());
        let is_missed =
            |event: &DataReaderStatus| matches!(event, DataReaderStatus::RequestedDeadlineMissed { .. });
        // Every event is consumed, so that none is mistaken for a later one.
        let noticed_silence = events.filter(|event| is_missed(event)).count() > 0;
        let witnessed = self.witness.as_mut().map_or(0, |witness| witness.look(now));
        SignsOfLife { echo, noticed_silence, witnessed }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::sync::Arc;

    use ros2_client::names::NodeName;
    use rustdds::{DomainParticipantBuilder, QosPolicies};

    use super::*;
    use crate::dds::discovery_probe::prefix;
    use crate::waiting::wait_for;
    use crate::wakeup::Wakeup;

    /// A domain that no other test uses.
    const DOMAIN: u16 = 230;

    #[test]
    fn samples_arrive_at_a_reader_beside_the_participant_and_at_the_one_after_it() {
        let builder = DomainParticipantBuilder::new(DOMAIN).with_only_networks([Ipv4Addr::LOCALHOST]);
        let domain = builder.build().unwrap();
        let publisher = domain.create_publisher(&QosPolicies::default()).unwrap();
        let subscriber = domain.create_subscriber(&QosPolicies::default()).unwrap();
        let name = NodeName::new("/", "node").unwrap();
        let node = DdsNode { name, publisher, subscriber, domain };
        let mut echo = Echo::new(&node).unwrap();
        let waker = Waker::from(Arc::new(Wakeup::default()));
        let (mut now, mut number) = (Instant::now(), 0);
        // Later increases come from other readers.
        for _ in 0..4 {
            now += std::time::Duration::from_secs(3);
            let mut is_first = true;
            wait_for("a sample", || {
                number += 1;
                now += std::time::Duration::from_millis(5);
                echo.send(number).unwrap();
                let witnessed = echo.take(&waker, now).witnessed;
                // Samples from before belong to the previous reader.
                (!std::mem::take(&mut is_first) && witnessed > 0).then_some(())
            });
        }
        let witness = echo.witness.as_ref().unwrap().prefix;
        assert!(echo.is_witness(&witness) && !echo.is_witness(&prefix(&node.domain.guid().to_bytes())));
    }
}
