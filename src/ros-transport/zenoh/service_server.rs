//! The services of the node. Requests are answered in the network process and never reach the gateway.
//!
//! Each service is a queryable with a graph token, as in `rmw_zenoh_cpp`. Changes after a reload are
//! published on `/parameter_events`.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};

use super::attachment::Attachment;
use super::keys::{EndpointKind, TopicKey, qos};
use super::locked::locked;
use super::node_session::NodeSession;
use super::payload::{ReceivedPayload, with_header};
use super::topic_writer::ZenohTopicWriter;
use crate::error::{SampleError, TransportError};
use crate::link::{Order, WrittenTopic};
use crate::parameters::{MAX_REQUEST, NodeService, Parameters, ServiceContents};
use crate::qos::{Delivery, Durability, Reliability};
use crate::settings::TypeHashes;
use crate::wakeup::Wakeup;
use crate::wall_clock::now;
use ros_messages::rcl_interfaces::ParameterEvent;

const EVENTS: &str = "/parameter_events";
/// Maximum number of waiting requests.
const MAX_WAITING: usize = 64;
/// Depth of the services and the topic, as in `rmw_qos_profile_parameters`.
const DEPTH: i32 = 1000;

pub(super) struct ZenohServiceServer {
    contents: ServiceContents,
    /// The node's name with its namespace.
    node: String,
    events: ZenohTopicWriter,
    waiting: Arc<Mutex<WaitingRequests>>,
    /// The services by position; dropping one ends it.
    services: Vec<Service>,
}

struct Service {
    kind: NodeService,
    key: String,
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

#[derive(Default)]
struct WaitingRequests {
    queries: VecDeque<(usize, Query)>,
    /// Number of requests refused for lack of room.
    refused: u64,
}

impl ZenohServiceServer {
    pub(super) fn new(
        node: &NodeSession,
        hashes: TypeHashes,
        contents: ServiceContents,
        wakeup: &Arc<Wakeup>,
    ) -> Result<Self, TransportError> {
        let waiting = Arc::<Mutex<WaitingRequests>>::default();
        let full_name = format!("{}/{}", node.key.namespace, node.key.node);
        let qos = qos(Reliability::Reliable, Durability::Volatile, DEPTH);
        let mut services = Vec::new();
        for (position, (service, name)) in contents.services(&full_name).into_iter().enumerate() {
            let key = TopicKey::new(&name, service.type_name(), hashes)?;
            let (queries, wakeup) = (Arc::clone(&waiting), Arc::clone(wakeup));
            let take = move |query| {
                locked(&queries).put(position, query);
                wakeup.notify();
            };
            // Clients query only servers declared as complete.
            let data = key.data(node.key.domain);
            let queryable = node.session.declare_queryable(&data).complete(true).callback(take);
            let token = node.endpoint_token(EndpointKind::Service, &key, &qos);
            services.push(Service {
                kind: service,
                key: data.clone(),
                _queryable: queryable.wait()?,
                _token: node.declare(token)?,
            });
        }
        let events = WrittenTopic {
            name: EVENTS.to_owned(),
            type_name: ParameterEvent::TYPE_NAME.to_owned(),
            durability: Durability::Volatile,
            depth: DEPTH,
            delivery: Delivery::Once,
        };
        let key = TopicKey::new(EVENTS, ParameterEvent::TYPE_NAME, hashes)?;
        let events = ZenohTopicWriter::new(node, &events, key)?;
        Ok(Self { contents, node: full_name, events, waiting, services })
    }

    /// Replaces the parameters, and publishes the differences.
    pub(super) fn set_parameters(&mut self, parameters: Parameters) {
        let publish = |event| Ok(self.events.carry_out(&Order::Publish(vec![event]))?);
        self.contents.set_parameters(parameters, &self.node, now().into(), publish);
    }

    /// Answers the requests that have arrived. Returns the number of unanswered requests.
    pub(super) fn serve(&self) -> u64 {
        let WaitingRequests { queries, refused } = std::mem::take(&mut *locked(&self.waiting));
        let mut unanswered = refused;
        for (position, query) in queries {
            let Some(service) = self.services.get(position) else { continue };
            if let Err(reason) = service.answer(&query, &self.contents) {
                tracing::warn!("a request to a service was not answered: {reason}");
                unanswered += 1;
                // Sent so that the client does not wait; it may be gone.
                let _ = query.reply_err(reason.to_string()).wait();
            }
        }
        unanswered
    }
}

impl Service {
    fn answer(&self, query: &Query, contents: &ServiceContents) -> Result<(), SampleError> {
        let Attachment { number, gid, .. } = Attachment::of(query.attachment(), "client")?;
        let request = ReceivedPayload::read(query.payload().ok_or(SampleError::Empty)?, MAX_REQUEST)?;
        let response = self.kind.answer(contents, request.bytes(), request.endian)?;
        // The client recognises its request by the number, and by its own identity.
        let attachment = Attachment::now(number, gid).to_bytes();
        let reply = query.reply(self.key.as_str(), with_header(response));
        Ok(reply.attachment(attachment).wait()?)
    }
}

impl WaitingRequests {
    fn put(&mut self, position: usize, query: Query) {
        if self.queries.len() < MAX_WAITING {
            self.queries.push_back((position, query));
        } else {
            self.refused += 1;
        }
    }
}
