//! A participant with its node, topics, writers and readers, and their matches.

use std::collections::{BTreeMap, BTreeSet};
use std::pin::Pin;
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use futures_util::Stream as _;
use rustdds::policy::Durability;
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, DomainParticipantStatusListener, EndpointDescription,
    GUID, LostReason, StatusEvented,
};

use super::dds_node::DdsNode;
use super::discovery_probe::{MissingPeers, Prefix, prefix};
use super::echo::{Echo, SignsOfLife};
use super::graph::GraphEntry;
use super::service_server::DdsServiceServer;
use super::silent_writers::ReadWriter;
use super::topic_reader::{DdsTopicReader, TakenSample};
use super::topic_writer::DdsTopicWriter;
use super::type_check::TypeCheck;
use crate::error::TransportError;
use crate::link::{NetworkSettings, Order};
use crate::parameters::Parameters;

/// Maximum number of remembered foreign writers, as a bound against floods.
const MAX_OTHER_WRITERS: usize = 1000;

/// Node, writers and readers on one DDS participant. Dropping it leaves the graph.
pub(super) struct Participant {
    /// Writers, in the order of the settings.
    topic_writers: Vec<DdsTopicWriter>,
    /// Readers, in the order of the settings.
    topic_readers: Vec<DdsTopicReader>,
    /// `None` when the node has no services.
    service_server: Option<DdsServiceServer>,
    /// `None` if the graph does not list the node.
    graph: Option<GraphEntry>,
    echo: Echo,
    /// The matched remote endpoints of each of our writers and readers.
    matched: BTreeMap<GUID, BTreeSet<GUID>>,
    /// Foreign writers on topics that we write, each with the position of the topic among our writers.
    /// RustDDS does not match them.
    other_writers: BTreeMap<GUID, usize>,
    /// Topic names of the writers, then of the readers.
    names: Vec<String>,
    type_check: TypeCheck,
    events: DomainParticipantStatusListener,
    /// Number of replaced writers when the node was last announced.
    announced: u32,
    /// Number of foreign participants present.
    pub(super) peers: u32,
    /// Maximum number of unacknowledged bytes that the writers may hold together.
    max_history: usize,
    /// Last field: RustDDS requires endpoints to be dropped before their participant.
    _node: DdsNode,
}

impl Participant {
    pub(super) fn new(settings: &NetworkSettings, domain: DomainParticipant) -> Result<Self, TransportError> {
        let events = domain.status_listener();
        let node = DdsNode::new(settings, domain)?;
        let topic_writers = settings.written.iter().map(|written| node.writer(written));
        let topic_writers = topic_writers.collect::<Result<Vec<_>, _>>()?;
        let topic_readers = settings.read.iter().map(|read| node.reader(read, read.durability));
        let topic_readers = topic_readers.collect::<Result<Vec<_>, _>>()?;
        let serve = |contents| DdsServiceServer::new(&node, contents);
        let written = settings.written.iter().map(|written| written.name.clone());
        let read = settings.read.iter().map(|read| read.name.clone());
        let participant = Self {
            topic_writers,
            topic_readers,
            service_server: settings.services.clone().map(serve).transpose()?,
            graph: settings.graph.then(|| GraphEntry::new(&node)).transpose()?,
            echo: Echo::new(&node)?,
            matched: BTreeMap::new(),
            other_writers: BTreeMap::new(),
            names: written.chain(read).collect(),
            type_check: TypeCheck::new(settings),
            events,
            announced: 0,
            peers: 0,
            max_history: settings.history_bytes,
            _node: node,
        };
        participant.announce();
        Ok(participant)
    }

    /// Sends a number to itself over the network.
    pub(super) fn send_echo(&self, number: u64) -> Result<(), TransportError> {
        self.echo.send(number)
    }

    /// Returns the signs of life since the last call; `waker` is called when an echo returns.
    pub(super) fn take_signs_of_life(&mut self, waker: &Waker, now: Instant) -> SignsOfLife {
        self.echo.take(waker, now)
    }

    /// Publishes or withdraws on the topic at a position of the settings.
    pub(super) fn carry_out(&mut self, position: usize, order: &Order) -> Result<(), TransportError> {
        let Some(topic_writer) = self.topic_writers.get_mut(position) else { return Ok(()) };
        let readers = matches(&self.matched, topic_writer.guid());
        match order {
            Order::Publish(samples) => topic_writer.publish(samples, readers),
            Order::Withdraw => topic_writer.withdraw(),
        }?;
        self.announce_new_writers();
        Ok(())
    }

    /// Passes received samples, each with the position of its subscription, to `hand_over` until that returns
    /// false. Returns true if more are waiting.
    pub(super) fn take(&self, waker: &Waker, mut hand_over: impl FnMut(u16, TakenSample) -> bool) -> bool {
        let mut is_more = false;
        for (subscription, topic_reader) in (0..=u16::MAX).zip(&self.topic_readers) {
            is_more |= topic_reader.take(waker, |taken| hand_over(subscription, taken));
        }
        is_more
    }

    /// Replaces the parameters, if the node has services.
    pub(super) fn set_parameters(&mut self, parameters: &Parameters) {
        if let Some(server) = &mut self.service_server {
            server.set_parameters(parameters.clone());
        }
    }

    /// Answers parameter requests; `waker` is called when more arrive. Returns the number of unanswered
    /// requests.
    pub(super) fn serve(&mut self, waker: &Waker) -> u64 {
        let matched = &self.matched;
        self.service_server.as_mut().map_or(0, |server| server.serve(waker, matched, Instant::now()))
    }

    /// Publishes current samples to new readers, and drops the history when no reader is left.
    pub(super) fn settle(&mut self) -> Result<(), TransportError> {
        let mut outcome = Ok(());
        for topic_writer in &mut self.topic_writers {
            outcome = topic_writer.settle(matches(&self.matched, topic_writer.guid())).and(outcome);
        }
        outcome = self.bound_history().and(outcome);
        self.announce_new_writers();
        outcome
    }

    /// Drops the longest history if all together are too long.
    fn bound_history(&mut self) -> Result<(), TransportError> {
        if self.topic_writers.iter().map(DdsTopicWriter::history_bytes).sum::<usize>() <= self.max_history {
            return Ok(());
        }
        tracing::warn!(
            "more than {} MB of samples are kept for readers: the topic with most of them begins anew; raise [ros] \
             memory_limit_mb",
            self.max_history >> 20
        );
        let longest = self.topic_writers.iter_mut().max_by_key(|writer| writer.history_bytes());
        longest.map_or(Ok(()), DdsTopicWriter::begin_anew)
    }

    /// Returns true if each writer had everything acknowledged at some time since the last call; waits some
    /// milliseconds for this.
    pub(super) fn is_acknowledged(&mut self) -> bool {
        let mut is_acknowledged = true;
        // Called for every writer, since the call begins a new interval.
        for topic_writer in &mut self.topic_writers {
            is_acknowledged &= topic_writer.is_acknowledged();
        }
        is_acknowledged
    }

    /// Returns the number of matched readers of each written topic.
    pub(super) fn readers(&self) -> impl Iterator<Item = usize> {
        self.topic_writers.iter().map(|topic_writer| matches(&self.matched, topic_writer.guid()))
    }

    /// Returns true while the writer is matched with the reader of its subscription.
    pub(super) fn reads(&self, (subscription, writer): &ReadWriter) -> bool {
        let reader = self.topic_readers.get(usize::from(*subscription));
        let writers = reader.and_then(|reader| self.matched.get(&reader.guid()));
        writers.is_some_and(|writers| writers.contains(writer))
    }

    /// Returns the number of matched writers of each subscription.
    pub(super) fn writers(&self) -> impl Iterator<Item = usize> {
        self.topic_readers.iter().map(|topic_reader| matches(&self.matched, topic_reader.guid()))
    }

    /// Returns the number of foreign writers on each written topic.
    pub(super) fn other_writers(&self) -> impl Iterator<Item = usize> {
        let on = |position| self.other_writers.values().filter(|at| **at == position).count();
        (0..self.topic_writers.len()).map(on)
    }

    /// Returns true if all remote endpoints matched with `other` are matched with this participant too.
    pub(super) fn serves_all_of(&self, other: &Self) -> bool {
        let served: BTreeSet<&GUID> = self.matched.values().flatten().collect();
        other.matched.values().flatten().all(|peer| served.contains(peer))
    }

    /// Handles the discovery events since the last call; `waker` is called when more occur. Peers whose lease
    /// expired are added to `missing`, except those in `own`.
    pub(super) fn observe(
        &mut self,
        waker: &Waker,
        missing: &mut MissingPeers,
        own: &[Prefix],
    ) -> Result<(), TransportError> {
        let mut outcome = Ok(());
        while let Some(event) = self.next_event(waker) {
            #[allow(clippy::wildcard_enum_match_arm)] // a foreign enum that may grow
            match event {
                DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, remote_reader } => {
                    self.matched.entry(local_writer).or_default().insert(remote_reader);
                }
                DomainParticipantStatusEvent::RemoteWriterMatched { local_reader, remote_writer } => {
                    self.matched.entry(local_reader).or_default().insert(remote_writer);
                }
                DomainParticipantStatusEvent::ReaderLost { guid, .. }
                | DomainParticipantStatusEvent::WriterLost { guid, .. } => {
                    self.forget(|peer| *peer == guid);
                }
                DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => {
                    let peer = prefix(&dpd.guid.to_bytes());
                    // A missing peer stays missing: RustDDS does not match the endpoints of a peer that it
                    // rediscovers.
                    self.peers += u32::from(!own.contains(&peer) && !self.echo.is_witness(&peer));
                }
                DomainParticipantStatusEvent::ParticipantLost { id, reason } => {
                    let peer = prefix(id.as_ref());
                    let is_own = own.contains(&peer) || self.echo.is_witness(&peer);
                    self.peers = self.peers.saturating_sub(u32::from(!is_own));
                    self.forget(|peer| peer.prefix == id);
                    match reason {
                        LostReason::Disposed => missing.remove(&peer),
                        LostReason::Timeout { lease, .. } if !is_own => {
                            tracing::warn!("a DDS peer was silent for longer than its lease of {lease:?}");
                            missing.insert(peer, Instant::now());
                        }
                        LostReason::Timeout { .. } => {}
                    }
                }
                DomainParticipantStatusEvent::ReaderDetected { reader } => {
                    self.type_check.reader(&reader.topic_name, &reader.type_name);
                    outcome = outcome.and(self.meet_reader(&reader));
                }
                DomainParticipantStatusEvent::WriterDetected { writer } => {
                    self.type_check.writer(&writer.topic_name, &writer.type_name);
                    self.note_other_writer(writer.guid, &writer.topic_name, own);
                }
                DomainParticipantStatusEvent::RemoteReaderQosIncompatible { local_writer, .. } => {
                    tracing::warn!(
                        "a reader of {} requests more than this writer offers, e.g. transient_local from volatile; \
                         it receives nothing",
                        self.topic_of(local_writer)
                    );
                }
                DomainParticipantStatusEvent::RemoteWriterQosIncompatible { local_reader, .. } => {
                    tracing::warn!(
                        "a writer of {} offers less than this reader requests, e.g. best effort instead of \
                         reliable; it is not read",
                        self.topic_of(local_reader)
                    );
                }
                _ => {}
            }
        }
        let ours: Vec<GUID> = self.endpoints().collect();
        self.matched.retain(|local, _| ours.contains(local));
        outcome
    }

    fn next_event(&self, waker: &Waker) -> Option<DomainParticipantStatusEvent> {
        let mut events = self.events.as_async_status_stream();
        match Pin::new(&mut events).poll_next(&mut Context::from_waker(waker)) {
            Poll::Ready(event) => event,
            Poll::Pending => None,
        }
    }

    /// Prevents a reader of one of our topics that requests history from receiving outdated samples.
    fn meet_reader(&mut self, reader: &EndpointDescription) -> Result<(), TransportError> {
        let asks_for_history =
            reader.qos.durability().is_some_and(|durability| durability > Durability::Volatile);
        let Some(position) = self.written_position(&reader.topic_name).filter(|_| asks_for_history) else {
            return Ok(());
        };
        let Some(topic_writer) = self.topic_writers.get_mut(position) else { return Ok(()) };
        let is_met = self.matched.get(&topic_writer.guid()).is_some_and(|peers| peers.contains(&reader.guid));
        if !is_met {
            topic_writer.meet_late_reader()?;
            self.announce_new_writers();
        }
        Ok(())
    }

    /// Returns the position of the writer of a topic with this DDS name.
    fn written_position(&self, dds_name: &str) -> Option<usize> {
        let written = self.names.iter().take(self.topic_writers.len());
        written.into_iter().position(|name| dds_name.strip_prefix("rt") == Some(name))
    }

    /// Remembers a foreign writer on a topic that we write. The writer of a killed gateway is not among them:
    /// it no longer announces itself, and its successor receives only announcements.
    fn note_other_writer(&mut self, writer: GUID, topic: &str, own: &[Prefix]) {
        let position = self.written_position(topic);
        let is_own = own.contains(&prefix(&writer.to_bytes()));
        if let Some(position) = position.filter(|_| !is_own && self.other_writers.len() < MAX_OTHER_WRITERS) {
            self.other_writers.insert(writer, position);
        }
    }

    fn forget(&mut self, gone: impl Fn(&GUID) -> bool) {
        self.other_writers.retain(|writer, _| !gone(writer));
        for peers in self.matched.values_mut() {
            peers.retain(|peer| !gone(peer));
        }
    }

    fn endpoints(&self) -> impl Iterator<Item = GUID> {
        let writers = self.topic_writers.iter().map(DdsTopicWriter::guid);
        let readers = self.topic_readers.iter().map(DdsTopicReader::guid);
        let services = self.service_server.iter();
        writers.chain(readers).chain(services.flat_map(|server| server.writers().chain(server.readers())))
    }

    fn topic_of(&self, local: GUID) -> &str {
        let position = self.endpoints().position(|endpoint| endpoint == local);
        position.and_then(|position| self.names.get(position)).map_or("a topic", String::as_str)
    }

    /// Removes our node from the graph if the other nodes' graph has the other layout; returns true if it
    /// did.
    pub(super) fn leave_other_graph(&mut self, waker: &Waker) -> bool {
        let left = self.graph.take_if(|graph| graph.meets_other_layout(waker));
        left.is_some()
    }

    pub(super) fn leave_graph(&mut self) {
        self.graph = None;
    }

    /// Returns the number of writers that were replaced. RustDDS keeps a few kilobytes of each for as long as
    /// the participant lives.
    pub(super) fn replaced_writers(&self) -> u32 {
        self.topic_writers.iter().map(|writer| writer.replaced).sum()
    }

    fn announce_new_writers(&mut self) {
        let replaced = self.replaced_writers();
        if replaced > std::mem::replace(&mut self.announced, replaced) {
            self.announce();
        }
    }

    fn announce(&self) {
        if let Some(graph) = &self.graph {
            let services = || self.service_server.iter();
            let writers = self.topic_writers.iter().map(DdsTopicWriter::guid);
            let readers = self.topic_readers.iter().map(DdsTopicReader::guid);
            graph.announce(
                writers.chain(services().flat_map(DdsServiceServer::writers)),
                readers.chain(services().flat_map(DdsServiceServer::readers)),
            );
        }
    }
}

fn matches(matched: &BTreeMap<GUID, BTreeSet<GUID>>, local: GUID) -> usize {
    matched.get(&local).map_or(0, BTreeSet::len)
}
