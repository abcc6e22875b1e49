//! One written topic: its publisher, its token, and the current samples.

use std::time::{Duration, Instant};

use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Reliability as Link};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig};

use super::attachment::{Attachment, Gid};
use super::keys::{EndpointKind, TopicKey, gid, qos};
use super::node_session::NodeSession;
use super::payload::with_header;
use crate::link::{Order, WrittenTopic};
use crate::qos::{Delivery, Durability, LOG_LIFESPAN, Reliability};
use ros_messages::cdr::CdrBytes;

/// Time after which a report is resent, see the module's documentation.
const REPEAT: Duration = Duration::from_secs(1);

pub(super) struct ZenohTopicWriter {
    node: NodeSession,
    settings: WrittenTopic,
    topic: TopicKey,
    endpoint: WriterEndpoint,
    /// The current report; empty if there is none, and on other topics.
    current: Vec<CdrBytes>,
    /// Time of the newest sample of this publisher; `None` before its first sample.
    last_write: Option<Instant>,
}

/// A publisher with its token; dropping it ends both.
struct WriterEndpoint {
    publisher: AdvancedPublisher<'static>,
    _token: LivelinessToken,
    gid: Gid,
    number: i64,
}

impl ZenohTopicWriter {
    pub(super) fn new(node: &NodeSession, settings: &WrittenTopic, topic: TopicKey) -> zenoh::Result<Self> {
        Ok(Self {
            endpoint: WriterEndpoint::new(node, settings, &topic)?,
            node: node.clone(),
            settings: settings.clone(),
            topic,
            current: Vec::new(),
            last_write: None,
        })
    }

    pub(super) fn carry_out(&mut self, order: &Order) -> zenoh::Result<()> {
        match order {
            Order::Publish(samples) => {
                if self.settings.delivery == Delivery::Report {
                    self.current.clone_from(samples);
                }
                self.write(samples)
            }
            Order::Withdraw => {
                self.current.clear();
                self.forget()
            }
        }
    }

    /// Repeats a report when due, and drops log samples that are too old for late readers.
    pub(super) fn settle(&mut self) -> zenoh::Result<()> {
        let age = self.last_write.map(|at| at.elapsed());
        match self.settings.delivery {
            Delivery::Report if !self.current.is_empty() && age.is_some_and(|age| age >= REPEAT) => {
                self.write(&self.current.clone())
            }
            Delivery::Log if age.is_some_and(|age| age >= LOG_LIFESPAN) => self.forget(),
            Delivery::Report | Delivery::Stream | Delivery::Live | Delivery::Once | Delivery::Log => Ok(()),
        }
    }

    /// Drops all samples kept for late readers.
    fn forget(&mut self) -> zenoh::Result<()> {
        if self.last_write.is_some() && self.settings.durability == Durability::TransientLocal {
            // Dropping the old endpoint discards its samples.
            self.endpoint = WriterEndpoint::new(&self.node, &self.settings, &self.topic)?;
            self.last_write = None;
        }
        Ok(())
    }

    fn write(&mut self, samples: &[CdrBytes]) -> zenoh::Result<()> {
        for sample in samples {
            self.endpoint.put(sample)?;
            self.last_write = Some(Instant::now());
        }
        Ok(())
    }
}

impl WriterEndpoint {
    fn new(node: &NodeSession, settings: &WrittenTopic, topic: &TopicKey) -> zenoh::Result<Self> {
        let qos = qos(Reliability::Reliable, settings.durability, settings.depth);
        let token = node.endpoint_token(EndpointKind::Publisher, topic, &qos);
        let builder = node
            .session
            .declare_publisher(topic.data(node.key.domain))
            .reliability(Link::Reliable)
            .congestion_control(CongestionControl::Drop)
            .advanced();
        let builder = match settings.durability {
            Durability::TransientLocal => {
                let depth = usize::try_from(settings.depth).unwrap_or_default().max(1);
                builder.cache(CacheConfig::default().max_samples(depth)).publisher_detection()
            }
            Durability::Volatile => builder,
        };
        let (publisher, gid) = (builder.wait()?, gid(&token));
        Ok(Self { publisher, gid, _token: node.declare(token)?, number: 0 })
    }

    fn put(&mut self, sample: &CdrBytes) -> zenoh::Result<()> {
        self.number += 1;
        let attachment = Attachment::now(self.number, self.gid).to_bytes();
        self.publisher.put(with_header(sample.clone())).attachment(attachment).wait()
    }
}
