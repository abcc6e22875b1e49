//! A sample that a participant sends to itself: it comes back only while RustDDS sends and receives.
//!
//! The topic is no ROS topic (its name lacks their prefix), and each participant has its own, so that nobody else reads
//! it. A sample may get lost, as the next comes soon.

use std::task::Waker;

use rustdds::dds::result::CreateResult;
use rustdds::no_key::SimpleDataReaderCdr;
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{DomainParticipant, Publisher, QosPolicyBuilder, RTPSEntity, Subscriber, TopicKind};

use super::sample::SampleWriter;
use crate::io::ros::messages::CdrBytes;

/// Echoes taken at once; more than ever wait.
const MAX_AT_ONCE: usize = 16;

/// A writer and a reader of numbers on one participant.
pub(super) struct Echo {
    writer: SampleWriter,
    reader: SimpleDataReaderCdr<u64>,
}

impl Echo {
    /// Puts the two on a participant.
    pub(super) fn new(
        domain: &DomainParticipant,
        publisher: &Publisher,
        subscriber: &Subscriber,
    ) -> CreateResult<Self> {
        let qos = QosPolicyBuilder::new()
            .reliability(Reliability::BestEffort)
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth: 1 })
            .build();
        let guid = domain.guid().to_bytes();
        let name = guid.iter().take(12).map(|byte| format!("{byte:02x}")).collect::<String>();
        let topic = domain.create_topic(
            format!("signal_gateway/echo/{name}"),
            "signal_gateway::Echo".to_owned(),
            &qos,
            TopicKind::NoKey,
        )?;
        Ok(Self {
            writer: publisher.create_datawriter_no_key(&topic, None)?,
            reader: subscriber.create_simple_datareader_no_key(&topic, None)?,
        })
    }

    /// Sends a number; the error is the text of RustDDS.
    pub(super) fn send(&self, number: u64) -> Result<(), String> {
        let bytes = CdrBytes::from(number.to_le_bytes().to_vec());
        self.writer.write(bytes, None).map_err(|error| error.to_string())
    }

    /// The highest number that came back since the last call; has `waker` called when one does.
    pub(super) fn take(&self, waker: &Waker) -> Option<u64> {
        self.reader.set_waker(Some(waker.clone()));
        self.reader.drain_read_notifications();
        let numbers = (0..MAX_AT_ONCE).map_while(|_| self.reader.try_take_one().ok().flatten());
        numbers.map(|sample| sample.into_value()).max()
    }
}
