//! The view of the graph: endpoints on our topics, known by their tokens, and connections.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

use zenoh::Wait;
use zenoh::config::WhatAmI;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;

use super::keys::{EndpointKind, GraphEndpoint, TopicKey, all_tokens, read_token, session_of};
use super::locked::locked;
use super::node_session::NodeSession;
use crate::link::ZenohLinks;

/// Maximum number of remembered tokens on our topics: enough for a large fleet, and a bound against floods.
const MAX_TOKENS: usize = 20_000;
/// Maximum number of nodes with another hash named in the log.
const MAX_NAMED: usize = 100;
/// Maximum number of remembered peers whose connection is lost.
const MAX_MISSING: usize = 1000;

/// State that outlives a session.
#[derive(Default)]
pub(super) struct Heritage {
    /// Id of the replaced session, which is not a foreign session.
    session: Option<String>,
    history: LinkHistory,
}

#[derive(Default, Clone)]
struct LinkHistory {
    lost: u64,
    /// Peers whose connection is lost and which have shown no sign since: neither another connection nor a
    /// token, which would come through a router, like samples.
    missing: BTreeSet<String>,
    /// Endpoints with a hash other than ours that were named in the log.
    named: BTreeSet<String>,
}

/// State shared with Zenoh's threads, which call back.
#[derive(Default)]
struct SeenToken {
    /// Foreign endpoints on our topics, by their tokens.
    endpoints: BTreeMap<String, GraphEndpoint>,
    /// Connections, and whether the other end is a router.
    links: BTreeMap<String, bool>,
    history: LinkHistory,
}

/// The graph as far as it concerns our topics.
pub(super) struct Graph {
    seen: Arc<Mutex<SeenToken>>,
    _token: Option<LivelinessToken>,
}

impl Graph {
    /// Declares our node, unless the graph must not list it, and subscribes to declarations on these topics.
    pub(super) fn new(
        node: &NodeSession,
        shows_node: bool,
        written: &[TopicKey],
        read: &[TopicKey],
        Heritage { session: former, history }: Heritage,
    ) -> zenoh::Result<Self> {
        let seen = Arc::new(Mutex::new(SeenToken { history, ..SeenToken::default() }));
        let (links, not_a_peer) = (Arc::clone(&seen), former.clone());
        node.session
            .info()
            .transport_events_listener()
            .history(true)
            .callback(move |event| {
                let is_router = event.transport().whatami() == WhatAmI::Router;
                let peer = event.transport().zid().to_string();
                if not_a_peer.as_ref() != Some(&peer) {
                    locked(&links).note_link(&peer, is_router, event.kind());
                }
            })
            .background()
            .wait()?;
        let (tokens, own) = (Arc::clone(&seen), node.key.session.clone());
        // Readers matter on the topics that we write, and writers on all our topics.
        let topics = [
            (EndpointKind::Subscription, written.to_vec()),
            (EndpointKind::Publisher, [written, read].concat()),
        ];
        node.session
            .liveliness()
            .declare_subscriber(all_tokens(node.key.domain))
            .history(true)
            .callback(move |sample| {
                let token = sample.key_expr().as_str();
                let Some(session) = session_of(token) else { return };
                if session == own || former.as_deref() == Some(session) {
                    return;
                }
                if sample.kind() == SampleKind::Put {
                    locked(&tokens).history.missing.remove(session);
                }
                let Some(endpoint) = read_token(token) else { return };
                let is_on = |(kind, topics): &(EndpointKind, Vec<TopicKey>)| {
                    *kind == endpoint.kind && topics.iter().any(|topic| topic.name == endpoint.topic.name)
                };
                if topics.iter().any(is_on) {
                    let topics = topics.iter().flat_map(|(_, topics)| topics);
                    locked(&tokens).note_token(token, endpoint, sample.kind(), topics);
                }
            })
            .background()
            .wait()?;
        let token = shows_node.then(|| node.declare(node.key.token())).transpose()?;
        Ok(Self { seen, _token: token })
    }

    /// Returns the peers whose connection is lost and which have shown no sign since.
    pub(super) fn missing(&self) -> BTreeSet<String> {
        locked(&self.seen).history.missing.clone()
    }

    pub(super) fn forget(&self, ended: &BTreeSet<String>) {
        locked(&self.seen).history.missing.retain(|session| !ended.contains(session));
    }

    /// Returns the state for the graph of the session that replaces this one, of this id.
    pub(super) fn heritage(&self, session: &str) -> Heritage {
        Heritage { session: Some(session.to_owned()), history: locked(&self.seen).history.clone() }
    }

    /// Returns the number of foreign endpoints that receive this topic from us, or send it to us.
    pub(super) fn count(&self, kind: EndpointKind, topic: &TopicKey) -> u32 {
        let seen = locked(&self.seen);
        let heard =
            seen.endpoints.values().filter(|endpoint| endpoint.kind == kind && endpoint.topic == *topic);
        u32::try_from(heard.count()).unwrap_or(u32::MAX)
    }

    pub(super) fn links(&self) -> ZenohLinks {
        let seen = locked(&self.seen);
        let count = |wanted| {
            let links = seen.links.values().filter(|is_router| **is_router == wanted);
            u32::try_from(links.count()).unwrap_or(u32::MAX)
        };
        ZenohLinks {
            routers: count(true),
            peers: count(false),
            lost: seen.history.lost,
            unreachable: Vec::new(),
        }
    }
}

impl SeenToken {
    /// Records a connection. Peers come and go with each `ros2` command, which is not worth a log line.
    fn note_link(&mut self, session: &str, is_router: bool, kind: SampleKind) {
        match kind {
            SampleKind::Put => {
                if is_router {
                    tracing::info!("connected with Zenoh router {session}");
                } else {
                    tracing::debug!("connected with Zenoh peer {session}");
                }
                self.links.insert(session.to_owned(), is_router);
                self.history.missing.remove(session);
            }
            SampleKind::Delete => {
                if is_router {
                    tracing::warn!("the connection with Zenoh router {session} is lost");
                } else {
                    tracing::debug!("the connection with Zenoh peer {session} has ended");
                }
                self.links.remove(session);
                self.history.lost += 1;
                if !is_router && self.history.missing.len() < MAX_MISSING {
                    self.history.missing.insert(session.to_owned());
                }
            }
        }
    }

    fn note_token<'a>(
        &mut self,
        token: &str,
        endpoint: GraphEndpoint,
        kind: SampleKind,
        ours: impl Iterator<Item = &'a TopicKey>,
    ) {
        if kind == SampleKind::Delete {
            self.endpoints.remove(token);
            return;
        }
        if self.endpoints.len() >= MAX_TOKENS {
            return;
        }
        let mut same_name = ours.filter(|topic| topic.name == endpoint.topic.name);
        if let Some(ours) = same_name.next().filter(|ours| **ours != endpoint.topic) {
            self.warn(&endpoint, ours);
        }
        self.endpoints.insert(token.to_owned(), endpoint);
    }

    /// Warns once about an endpoint that will not receive from us, or from which we will not receive.
    fn warn(&mut self, endpoint: &GraphEndpoint, ours: &TopicKey) {
        let GraphEndpoint { node, topic: TopicKey { name, type_name, hash }, .. } = endpoint;
        let named = &mut self.history.named;
        if named.len() >= MAX_NAMED || !named.insert(format!("{node} {name} {type_name} {hash}")) {
            return;
        }
        let (theirs, own) =
            if *type_name == ours.type_name { (hash, &ours.hash) } else { (type_name, &ours.type_name) };
        // The declaring node chooses the characters of its token.
        let (node, theirs, subject) = (node.escape_debug(), theirs.escape_debug(), name.as_str());
        let name = name.escape_debug();
        tracing::warn!(
            log.subject = subject,
            "{name}: node {node} has another definition of the message and no sample passes between us: its type is {theirs}, ours {own}"
        );
    }
}
