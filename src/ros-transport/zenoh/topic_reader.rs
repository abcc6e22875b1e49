//! One read topic: its subscription, its token, and the queue of arrived samples.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use super::attachment::Attachment;
use super::keys::{EndpointKind, TopicKey, qos};
use super::node_session::NodeSession;
use super::payload::ReceivedPayload;
use crate::error::SampleError;
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
pub(super) type Arrival = Result<Arrived, SampleError>;

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
        node: &NodeSession,
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
        let builder = node.session.declare_subscriber(topic.data(node.key.domain)).callback(receive);
        let subscriber = match settings.durability {
            Durability::Volatile => Subscriber::Plain { _held: builder.wait()? },
            Durability::TransientLocal => {
                let history = HistoryConfig::default().detect_late_publishers().max_samples(depth);
                Subscriber::WithHistory { _held: builder.history(history).wait()? }
            }
        };
        let qos = qos(settings.reliability, settings.durability, settings.depth);
        let token = node.declare(node.endpoint_token(EndpointKind::Subscription, topic, &qos))?;
        Ok(Self { queue, _subscriber: subscriber, _token: token })
    }

    /// Removes and returns the oldest arrival.
    pub(super) fn take(&self) -> Option<Arrival> {
        self.queue.lock().pop_front()
    }
}

/// Reads attachment and header of a sample.
fn arrival(sample: &Sample) -> Arrival {
    let attachment = Attachment::of(sample.attachment(), "publisher")?;
    Ok(Arrived { attachment, message: ReceivedPayload::read(sample.payload(), MAX_SAMPLE)? })
}
