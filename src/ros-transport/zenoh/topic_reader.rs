//! One read topic: its subscription, its token, and the queue of arrived samples.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use zenoh::liveliness::LivelinessToken;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use super::attachment::Attachment;
use super::keys::{EndpointKind, NextId, NodeKey, TopicKey, qos};
use super::payload::ReceivedPayload;
use crate::link::{MAX_SAMPLE, ReadTopic};
use crate::qos::Durability;
use crate::wakeup::Wakeup;

/// A sample that has arrived.
pub(super) struct Arrived {
    /// The attachment of the sample.
    pub(super) attachment: Attachment,
    /// The message with its header.
    pub(super) message: ReceivedPayload,
}

/// A sample, or the reason why it cannot be read.
pub(super) type Arrival = Result<Arrived, String>;

/// The newest arrivals, at most as many as the topic's depth.
#[derive(Clone)]
struct SampleQueue {
    arrivals: Arc<Mutex<VecDeque<Arrival>>>,
    depth: usize,
    wakeup: Arc<Wakeup>,
}

impl SampleQueue {
    fn put(&self, arrival: Arrival) {
        let mut arrivals = self.lock();
        while arrivals.len() >= self.depth {
            arrivals.pop_front();
        }
        arrivals.push_back(arrival);
        drop(arrivals);
        self.wakeup.notify();
    }

    /// A panic cannot leave the data behind this lock half changed.
    fn lock(&self) -> MutexGuard<'_, VecDeque<Arrival>> {
        self.arrivals.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A subscription of our session.
pub(super) struct ZenohTopicReader {
    queue: SampleQueue,
    /// Dropping it ends the subscription.
    _subscriber: Subscriber,
    _token: LivelinessToken,
}

/// Held until dropped.
enum Subscriber {
    Plain { _held: zenoh::pubsub::Subscriber<()> },
    WithHistory { _held: AdvancedSubscriber<()> },
}

impl ZenohTopicReader {
    /// Reads a topic from now on, and also its current samples if so configured.
    pub(super) fn new(
        session: &Session,
        node: &NodeKey,
        ids: &mut NextId,
        settings: &ReadTopic,
        topic: &TopicKey,
        wakeup: Arc<Wakeup>,
    ) -> zenoh::Result<Self> {
        let depth = usize::try_from(settings.depth).unwrap_or_default().max(1);
        let queue = SampleQueue { arrivals: Arc::default(), depth, wakeup };
        let arrivals = queue.clone();
        let receive = move |sample: Sample| {
            if sample.kind() == SampleKind::Put {
                arrivals.put(arrival(&sample));
            }
        };
        let builder = session.declare_subscriber(topic.data(node.domain)).callback(receive);
        let subscriber = match settings.durability {
            Durability::Volatile => Subscriber::Plain { _held: builder.wait()? },
            Durability::TransientLocal => {
                let history = HistoryConfig::default().detect_late_publishers().max_samples(depth);
                Subscriber::WithHistory { _held: builder.history(history).wait()? }
            }
        };
        let qos = qos(settings.reliability, settings.durability, settings.depth);
        let token = node.endpoint_token(ids.next(), EndpointKind::Subscription, topic, &qos);
        let token = session.liveliness().declare_token(token).wait()?;
        Ok(Self { queue, _subscriber: subscriber, _token: token })
    }

    /// Removes and returns the oldest arrival.
    pub(super) fn take(&self) -> Option<Arrival> {
        self.queue.lock().pop_front()
    }
}

/// Reads attachment and header of a sample.
fn arrival(sample: &Sample) -> Arrival {
    let attached = sample.attachment().and_then(|attached| Attachment::read(&attached.to_bytes()));
    let attachment =
        attached.ok_or("it has no number and no publisher attached, as rmw_zenoh attaches them")?;
    Ok(Arrived { attachment, message: ReceivedPayload::read(sample.payload(), MAX_SAMPLE)? })
}
