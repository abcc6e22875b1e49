//! The services of the node. Requests are answered in the network process and never reach the gateway.
//!
//! A response waits until a reader of the client's participant is matched, since it would not be received
//! earlier. Changes after a reload are published on `/parameter_events`.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Display;
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::no_key::{DeserializedCacheChange, SimpleDataReader};
use rustdds::{GUID, RTPSEntity, SampleIdentity, SequenceNumber, TopicKind, WriteOptionsBuilder};

use super::dds_node::{DdsNode, qos};
use super::sample::SampleWriter;
use super::topic_reader::{AsBytes, Copied, EncodedSample};
use crate::error::{SampleError, TransportError};
use crate::parameters::{MAX_REQUEST, Middleware, NodeService, Parameters, ServiceContents};
use crate::qos::{Durability, Reliability};
use crate::wall_clock::now;
use ros_messages::cdr::CdrBytes;
use ros_messages::dds_type;
use ros_messages::rcl_interfaces::ParameterEvent;

/// DDS name of the topic for changes.
const EVENTS: &str = "rt/parameter_events";
/// Maximum number of requests of one service handled before other work.
const MAX_AT_ONCE: usize = 16;
/// Maximum number of responses that wait for their client.
const MAX_WAITING: usize = 64;
/// Longest wait for the client's reader.
const PATIENCE: Duration = Duration::from_secs(2);
/// Depth of readers and writers, samples.
const DEPTH: i32 = 16;
/// Longest sample, bytes: a request with the numbers of client and request before it.
const MAX_SAMPLE: usize = MAX_REQUEST + 16;

pub(super) struct DdsServiceServer {
    contents: ServiceContents,
    /// The node's name with its namespace.
    node: String,
    events: SampleWriter,
    endpoints: Vec<ServiceEndpoint>,
    waiting: VecDeque<PendingResponse>,
}

struct ServiceEndpoint {
    service: NodeService,
    reader: SimpleDataReader<EncodedSample, AsBytes>,
    writer: SampleWriter,
}

/// A response, and its recipient.
struct PendingResponse {
    /// Position of its service among the endpoints.
    endpoint: usize,
    client: GUID,
    request: SampleIdentity,
    reply: CdrBytes,
    since: Instant,
}

impl DdsServiceServer {
    pub(super) fn new(
        DdsNode { name, publisher, subscriber, domain }: &DdsNode,
        contents: ServiceContents,
    ) -> Result<Self, TransportError> {
        let qos = qos(Reliability::Reliable, Durability::Volatile, DEPTH).build();
        let node = format!("{}/{}", name.namespace().trim_end_matches('/'), name.base_name());
        let topic = |service: NodeService, name: String, ending: &str| {
            let type_name = dds_type(&format!("{}_{ending}", service.type_name()));
            domain.create_topic(name, type_name, &qos, TopicKind::NoKey)
        };
        let endpoint = |(service, name): (NodeService, String)| {
            let request = topic(service, format!("rq{name}Request"), "Request")?;
            let reply = topic(service, format!("rr{name}Reply"), "Response")?;
            Ok(ServiceEndpoint {
                service,
                reader: subscriber.create_simple_datareader_no_key(&request, None)?,
                writer: publisher.create_datawriter_no_key(&reply, None)?,
            })
        };
        let endpoints = contents.services(&node).into_iter().map(endpoint);
        let endpoints = endpoints.collect::<Result<_, TransportError>>()?;
        let event = dds_type(ParameterEvent::TYPE_NAME);
        let topic = domain.create_topic(EVENTS.to_owned(), event, &qos, TopicKind::NoKey)?;
        let events = publisher.create_datawriter_no_key(&topic, None)?;
        Ok(Self { contents, node, events, endpoints, waiting: VecDeque::new() })
    }

    /// Replaces the parameters, and publishes the differences.
    pub(super) fn set_parameters(&mut self, parameters: Parameters) {
        let publish = |event| Ok(self.events.write(event, None)?);
        self.contents.set_parameters(parameters, &self.node, now().into(), publish);
    }

    pub(super) fn writers(&self) -> impl Iterator<Item = GUID> {
        self.endpoints.iter().map(|endpoint| &endpoint.writer).chain([&self.events]).map(RTPSEntity::guid)
    }

    pub(super) fn readers(&self) -> impl Iterator<Item = GUID> {
        self.endpoints.iter().map(|endpoint| endpoint.reader.guid())
    }

    /// Answers the requests that have arrived; `waker` is called when more arrive. Returns the number of
    /// unanswered requests.
    pub(super) fn serve(
        &mut self,
        waker: &Waker,
        matched: &BTreeMap<GUID, BTreeSet<GUID>>,
        now: Instant,
    ) -> u64 {
        let Self { contents, endpoints, waiting, .. } = self;
        let mut unanswered = 0;
        for (position, endpoint) in endpoints.iter().enumerate() {
            unanswered += endpoint.take(position, contents, waiting, waker, now);
        }
        let mut later = VecDeque::new();
        for response in waiting.drain(..) {
            let Some(ServiceEndpoint { writer, .. }) = endpoints.get(response.endpoint) else { continue };
            let mut readers = matched.get(&writer.guid()).into_iter().flatten();
            if readers.any(|reader| reader.prefix == response.client.prefix) {
                let options = WriteOptionsBuilder::new().related_sample_identity(response.request).build();
                if let Err(error) = writer.write_with_options(response.reply, options) {
                    unanswered += refuse(error);
                }
            } else if now.saturating_duration_since(response.since) < PATIENCE {
                later.push_back(response);
            } else {
                unanswered += refuse("its client does not read the response");
            }
        }
        self.waiting = later;
        unanswered
    }
}

impl ServiceEndpoint {
    /// Reads the requests of the service at this position; returns the number of unanswered requests.
    fn take(
        &self,
        position: usize,
        contents: &ServiceContents,
        waiting: &mut VecDeque<PendingResponse>,
        waker: &Waker,
        now: Instant,
    ) -> u64 {
        let Self { service, reader, .. } = self;
        // Set first, so that any sample arriving from now on wakes the task.
        reader.set_waker(Some(waker.clone()));
        reader.drain_read_notifications();
        let mut unanswered = 0;
        for _ in 0..MAX_AT_ONCE {
            let sample = match reader.try_take_one_with(Copied { limit: MAX_SAMPLE }) {
                Ok(Some(sample)) => sample,
                Ok(None) => return unanswered,
                Err(error) => {
                    unanswered += refuse(error);
                    continue;
                }
            };
            match answer(*service, contents, &sample) {
                Ok(reply) if waiting.len() < MAX_WAITING => waiting.push_back(PendingResponse {
                    endpoint: position,
                    client: sample.writer_guid(),
                    request: identity(&sample),
                    reply,
                    since: now,
                }),
                Ok(_) => unanswered += refuse("too many wait"),
                Err(reason) => unanswered += refuse(reason),
            }
        }
        // More requests may be waiting.
        waker.wake_by_ref();
        unanswered
    }
}

fn answer(
    service: NodeService,
    contents: &ServiceContents,
    sample: &DeserializedCacheChange<EncodedSample>,
) -> Result<CdrBytes, SampleError> {
    let EncodedSample { endian, bytes } = &sample.sample;
    let middleware = Middleware::of(sample.writer_guid().to_bytes());
    let call = middleware.call(bytes, *endian).ok_or(SampleError::CutOff)?;
    let response = service.answer(contents, call.request, *endian)?;
    Ok(call.reply(response))
}

/// Returns the identity by which the client recognises its request. Fast DDS expects an answer to its
/// reader's identity; the number is the sample's.
fn identity(sample: &DeserializedCacheChange<EncodedSample>) -> SampleIdentity {
    let own = SampleIdentity { writer_guid: sample.writer_guid(), sequence_number: sample.sequence_number };
    let Some(given) =
        sample.related_sample_identity().filter(|given| given.writer_guid != GUID::GUID_UNKNOWN)
    else {
        return own;
    };
    let is_numbered = given.sequence_number > SequenceNumber::zero();
    SampleIdentity {
        sequence_number: if is_numbered { given.sequence_number } else { own.sequence_number },
        ..given
    }
}

/// Logs that a request was not answered, and returns 1 for the count.
fn refuse(reason: impl Display) -> u64 {
    tracing::warn!("a request to a service was not answered: {reason}");
    1
}
