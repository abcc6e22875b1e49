//! One read topic: its subscription, its token, and the queue of arrived samples.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig};

use super::attachment::Attachment;
use super::keys::{EndpointKind, TopicKey, qos};
use super::locked::locked;
use super::node_session::NodeSession;
use super::payload::ReceivedPayload;
use crate::error::SampleError;
use crate::link::{MAX_SAMPLE, ReadTopic};
use crate::qos::Durability;
use crate::wakeup::Wakeup;

pub(super) struct Arrived {
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
        let mut arrivals = locked(&self.arrivals);
        while arrivals.len() >= self.depth {
            arrivals.pop_front();
        }
        arrivals.push_back(arrival);
        drop(arrivals);
        self.wakeup.notify();
    }
}

pub(super) struct ZenohTopicReader {
    queue: SampleQueue,
    /// Dropping it ends the subscription.
    _subscriber: Box<dyn Any + Send>,
    _token: LivelinessToken,
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
        let subscriber: Box<dyn Any + Send> = match settings.durability {
            Durability::Volatile => Box::new(builder.wait()?),
            Durability::TransientLocal => {
                let history = HistoryConfig::default().detect_late_publishers().max_samples(depth);
                Box::new(builder.history(history).wait()?)
            }
        };
        let qos = qos(settings.reliability, settings.durability, settings.depth);
        let token = node.declare(node.endpoint_token(EndpointKind::Subscription, topic, &qos))?;
        Ok(Self { queue, _subscriber: subscriber, _token: token })
    }

    pub(super) fn take(&self) -> Option<Arrival> {
        locked(&self.queue.arrivals).pop_front()
    }
}

fn arrival(sample: &Sample) -> Arrival {
    let attachment = Attachment::of(sample.attachment(), "publisher")?;
    Ok(Arrived { attachment, message: ReceivedPayload::read(sample.payload(), MAX_SAMPLE)? })
}
