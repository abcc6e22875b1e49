//! One written topic: its publisher, its token, and the current samples.

use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Reliability as Link};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig};

use super::attachment::{Attachment, Gid};
use super::keys::{EndpointKind, NextId, NodeKey, TopicKey, gid, qos};
use super::payload::with_header;
use crate::link::{Order, WrittenTopic};
use crate::qos::{Delivery, Durability, LOG_LIFESPAN, Reliability};
use ros_messages::cdr::CdrBytes;

/// Time after which a report is resent, see the module's documentation.
const REPEAT: Duration = Duration::from_secs(1);

/// A topic of our session.
pub(super) struct ZenohTopicWriter {
    session: Session,
    node: NodeKey,
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
    /// Number of samples sent so far.
    number: i64,
}

impl ZenohTopicWriter {
    /// Creates a topic without publications.
    pub(super) fn new(
        session: &Session,
        node: &NodeKey,
        ids: &mut NextId,
        settings: &WrittenTopic,
        topic: TopicKey,
    ) -> zenoh::Result<Self> {
        Ok(Self {
            endpoint: endpoint(session, node, ids, settings, &topic)?,
            session: session.clone(),
            node: node.clone(),
            settings: settings.clone(),
            topic,
            current: Vec::new(),
            last_write: None,
        })
    }

    /// Publishes, or withdraws the current report.
    pub(super) fn carry_out(&mut self, order: &Order, ids: &mut NextId) -> zenoh::Result<()> {
        match order {
            Order::Publish(samples) => {
                if self.settings.delivery == Delivery::Report {
                    self.current.clone_from(samples);
                }
                self.write(samples)
            }
            Order::Withdraw => {
                self.current.clear();
                self.forget(ids)
            }
        }
    }

    /// Repeats a report when due, and drops log samples that are too old for late readers.
    pub(super) fn settle(&mut self, ids: &mut NextId) -> zenoh::Result<()> {
        let age = self.last_write.map(|at| at.elapsed());
        match self.settings.delivery {
            Delivery::Report if !self.current.is_empty() && age.is_some_and(|age| age >= REPEAT) => {
                self.write(&self.current.clone())
            }
            Delivery::Log if age.is_some_and(|age| age >= LOG_LIFESPAN) => self.forget(ids),
            Delivery::Report | Delivery::Stream | Delivery::Live | Delivery::Once | Delivery::Log => Ok(()),
        }
    }

    /// Drops all samples kept for late readers.
    fn forget(&mut self, ids: &mut NextId) -> zenoh::Result<()> {
        if self.last_write.is_some() && self.settings.durability == Durability::TransientLocal {
            // Dropping the old endpoint discards its samples.
            self.endpoint = endpoint(&self.session, &self.node, ids, &self.settings, &self.topic)?;
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
    fn put(&mut self, sample: &CdrBytes) -> zenoh::Result<()> {
        self.number += 1;
        let attachment = Attachment::now(self.number, self.gid).to_bytes();
        self.publisher.put(with_header(sample.clone())).attachment(attachment).wait()
    }
}

/// Declares a publisher and its token.
fn endpoint(
    session: &Session,
    node: &NodeKey,
    ids: &mut NextId,
    settings: &WrittenTopic,
    topic: &TopicKey,
) -> zenoh::Result<WriterEndpoint> {
    let qos = qos(Reliability::Reliable, settings.durability, settings.depth);
    let token = node.endpoint_token(ids.next(), EndpointKind::Publisher, topic, &qos);
    let builder = session
        .declare_publisher(topic.data(node.domain))
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
    Ok(WriterEndpoint {
        publisher: builder.wait()?,
        gid: gid(&token),
        _token: session.liveliness().declare_token(token).wait()?,
        number: 0,
    })
}
