//! The Zenoh worker: carries out orders to publishers, and sends samples to the gateway.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;
use tokio::time::sleep;
use zenoh::{Session, Wait};

use super::graph::{Graph, Heritage};
use super::keys::{EndpointKind, TopicKey};
use super::node_session::NodeSession;
use super::peer_search::{Answer, PeerSearch};
use super::router_query;
use super::service_server::ZenohServiceServer;
use super::topic_reader::ZenohTopicReader;
use super::topic_writer::ZenohTopicWriter;
use crate::error::TransportError;
use crate::link::{FromNetwork, Link, LostLines, NetworkSettings, NetworkStatus, Order, Sample, ZenohLinks};
use crate::orders;
use crate::qos::Delivery;
use crate::settings::{Transport, TypeHashes};
use crate::wakeup::Wakeup;
use crate::zenoh_config;

/// Longest sleep between two checks for due work.
const TICK: Duration = Duration::from_millis(100);
/// Time between two counts of endpoints and connections.
const COUNT_INTERVAL: Duration = Duration::from_millis(500);
/// Maximum number of bytes waiting for the gateway; beyond this, samples stay in their queues, which keep the
/// newest.
const MAX_WAITING: usize = 256 * 1024;
/// Time for which a replaced session still receives, until all peers have discovered its successor.
const OVERLAP: Duration = Duration::from_secs(1);
/// Maximum number of nodes named in the status, and of characters of each.
const MAX_NAMED: (usize, usize) = (5, 100);

struct SessionKeys {
    hashes: TypeHashes,
    written: Vec<TopicKey>,
    read: Vec<TopicKey>,
}

struct JoinedSession {
    node: NodeSession,
    writers: Vec<ZenohTopicWriter>,
    readers: Vec<ZenohTopicReader>,
    graph: Graph,
    service_server: Option<ZenohServiceServer>,
}

/// A router's answer, with the sessions in the query.
type Answered = (BTreeSet<String>, Option<Answer>);

pub(super) struct ZenohWorker {
    settings: NetworkSettings,
    config: zenoh::Config,
    keys: SessionKeys,
    /// Ends the wait when something was received.
    wakeup: Arc<Wakeup>,
    opening: Option<Receiver<zenoh::Result<Session>>>,
    /// `None` until a session is open.
    joined: Option<JoinedSession>,
    /// A replaced session without its writers, and the time of the replacement.
    replaced: Option<(Instant, JoinedSession)>,
    /// The newest order of each topic, except orders that are delivered once, for the next session.
    current: BTreeMap<u16, Order>,
    search: PeerSearch,
    answers: (Sender<Answered>, Receiver<Answered>),
    write_errors: u64,
    /// Number of unanswered parameter requests.
    unanswered_requests: u64,
    last_count: Option<Instant>,
    /// Returns the losses of this process's log.
    log_losses: fn() -> LostLines,
    lost_lines: LostLines,
    status: NetworkStatus,
    /// Last field: the gateway sees the link end only when everything else is gone.
    link: Link,
}

impl SessionKeys {
    fn new(settings: &NetworkSettings, hashes: TypeHashes) -> Result<Self, TransportError> {
        let written = settings.written.iter();
        let written = written.map(|topic| TopicKey::new(&topic.name, &topic.type_name, hashes));
        let read = settings.read.iter().map(|topic| TopicKey::new(&topic.name, &topic.type_name, hashes));
        Ok(Self {
            hashes,
            written: written.collect::<Result<_, _>>()?,
            read: read.collect::<Result<_, _>>()?,
        })
    }
}

impl JoinedSession {
    fn new(
        session: Session,
        settings: &NetworkSettings,
        SessionKeys { hashes, written, read }: &SessionKeys,
        wakeup: &Arc<Wakeup>,
        heritage: Heritage,
    ) -> Result<Self, TransportError> {
        let node = NodeSession::new(session, settings);
        let graph = Graph::new(&node, settings.graph, written, read, heritage)?;
        let writers = settings.written.iter().zip(written);
        let writers = writers.map(|(topic, key)| ZenohTopicWriter::new(&node, topic, key.clone()));
        let writers = writers.collect::<zenoh::Result<Vec<_>>>()?;
        let readers = settings.read.iter().zip(read);
        let readers =
            readers.map(|(topic, key)| ZenohTopicReader::new(&node, topic, key, Arc::clone(wakeup)));
        let readers = readers.collect::<zenoh::Result<Vec<_>>>()?;
        let service_server = settings
            .services
            .clone()
            .map(|contents| ZenohServiceServer::new(&node, *hashes, contents, wakeup));
        let service_server = service_server.transpose()?;
        Ok(Self { node, writers, readers, graph, service_server })
    }
}

impl ZenohWorker {
    /// Creates a network side that has not joined the network.
    pub(super) fn new(settings: NetworkSettings, link: Link, log_losses: fn() -> LostLines) -> Self {
        Self {
            settings,
            config: zenoh::Config::default(),
            keys: SessionKeys { hashes: TypeHashes::default(), written: Vec::new(), read: Vec::new() },
            wakeup: Arc::default(),
            opening: None,
            joined: None,
            replaced: None,
            current: BTreeMap::new(),
            search: PeerSearch::default(),
            answers: channel(),
            write_errors: 0,
            unanswered_requests: 0,
            last_count: None,
            log_losses,
            lost_lines: LostLines::default(),
            status: NetworkStatus::default(),
            link,
        }
    }

    pub(super) fn into_link(self) -> Link {
        self.link
    }

    /// Opens a session, with or without a network; a client's session waits for a router, so it is opened in
    /// a separate thread.
    pub(super) fn open(&mut self) -> Result<(), TransportError> {
        let Transport::Zenoh(zenoh) = &self.settings.transport else {
            return Err(TransportError::NotConfigured);
        };
        self.config = zenoh_config::parse(zenoh.config.as_deref())?;
        self.keys = SessionKeys::new(&self.settings, zenoh.type_hashes)?;
        if !zenoh_config::waits_for_router(&self.config) {
            let session = zenoh::open(self.config.clone()).wait()?;
            return self.join(session);
        }
        self.open_later(self.config.clone())
    }

    fn open_later(&mut self, config: zenoh::Config) -> Result<(), TransportError> {
        let (sender, receiver) = channel();
        let wakeup = Arc::clone(&self.wakeup);
        let open = move || {
            // The receiver is gone when the network side has ended.
            let _ = sender.send(zenoh::open(config).wait());
            wakeup.notify();
        };
        thread::Builder::new().name("zenoh open".to_owned()).spawn(open)?;
        self.opening = Some(receiver);
        Ok(())
    }

    /// Declares all endpoints on a session, which replaces any previous one, and publishes the current
    /// samples.
    fn join(&mut self, session: Session) -> Result<(), TransportError> {
        let heritage = self.joined.as_ref().map(|former| former.graph.heritage(&former.node.key.session));
        let is_first = heritage.is_none();
        let joined = JoinedSession::new(
            session,
            &self.settings,
            &self.keys,
            &self.wakeup,
            heritage.unwrap_or_default(),
        )?;
        if let Some(mut former) = self.joined.replace(joined) {
            former.writers.clear();
            former.service_server = None;
            self.replaced = Some((Instant::now(), former));
        }
        for (topic, order) in self.current.clone() {
            let written = self.settings.written.get(usize::from(topic));
            let stands = written.is_some_and(|written| written.delivery == Delivery::Report);
            if is_first || stands {
                self.carry_out(topic, order);
            }
        }
        Ok(())
    }

    /// Closes the replaced session after its overlap, in a separate thread, since closing may take long.
    fn close_replaced(&mut self, now: Instant) {
        if let Some((_, former)) =
            self.replaced.take_if(|(since, _)| now.saturating_duration_since(*since) >= OVERLAP)
        {
            let close = move || drop(former.node.session.close().wait());
            let started = thread::Builder::new().name("zenoh close".to_owned()).spawn(close);
            if let Err(error) = started {
                tracing::warn!("a session of Zenoh was not closed in order: {error}");
            }
        }
    }

    /// Searches for peers that are present although their connection is lost.
    fn seek_peers(&mut self, now: Instant) {
        while let Ok((asked, answer)) = self.answers.1.try_recv() {
            let findings = self.search.answered(&asked, answer.as_ref(), now);
            if let Some(joined) = &self.joined {
                joined.graph.forget(&findings.ended);
            }
            for node in &findings.unreachable {
                let node = shown(node);
                tracing::warn!("node {node} is there, but the connection with it is lost; connecting again");
            }
            if findings.replace && self.opening.is_none() && self.replaced.is_none() {
                let opened = zenoh_config::with_another_id(self.config.clone())
                    .map_err(TransportError::from)
                    .and_then(|config| self.open_later(config));
                if let Err(reason) = opened {
                    tracing::warn!("no other session of Zenoh can be opened: {reason}");
                }
            }
        }
        let Some(joined) = self.joined.as_ref().filter(|_| zenoh_config::is_peer(&self.config)) else {
            return;
        };
        for (nodes, after) in self.search.observe(&joined.graph.missing(), now) {
            for node in nodes {
                let node = shown(&node);
                tracing::info!("node {node} is connected again, {:.1} s later", after.as_secs_f64());
            }
        }
        let has_router = || joined.graph.links().routers > 0;
        if let Some(sessions) = self.search.question(has_router, now) {
            let (sender, wakeup) = (self.answers.0.clone(), Arc::clone(&self.wakeup));
            let unasked = sessions.clone();
            let then = move |asked, answer| {
                // The receiver is gone when the network side has ended.
                let _ = sender.send((asked, answer));
                wakeup.notify();
            };
            let asked = router_query::ask(self.config.clone(), self.settings.domain_id, sessions, then);
            if asked.is_err() {
                // Without a thread there is no answer, as if there were no router.
                self.search.answered(&unasked, None, now);
            }
        }
    }

    /// Runs until the gateway orders to stop. Fails with the error of the link if its other end is gone, or
    /// of a session that cannot be opened.
    pub(super) fn run(mut self, runtime: &Runtime) -> io::Result<()> {
        self.link.answer(&FromNetwork::Ready);
        self.link.flush()?;
        loop {
            runtime.block_on(self.wait())?;
            if let Some(opened) = self.opening.as_ref().and_then(|opening| opening.try_recv().ok()) {
                self.opening = None;
                // Samples received by the previous session come first.
                self.receive();
                let joined = opened.map_err(TransportError::from).and_then(|session| self.join(session));
                if let Err(error) = joined {
                    tracing::warn!("no session of Zenoh can be opened: {error}");
                    if self.joined.is_none() {
                        return Err(io::Error::other(error));
                    }
                }
            }
            let now = Instant::now();
            self.close_replaced(now);
            self.seek_peers(now);
            if self.obey()? {
                if let Some(joined) = &self.joined {
                    // Remaining declarations end with the process.
                    let _ = joined.node.session.close().wait();
                }
                return Ok(());
            }
            self.receive();
            let server = self.joined.as_ref().and_then(|joined| joined.service_server.as_ref());
            self.unanswered_requests += server.map_or(0, ZenohServiceServer::serve);
            let writers = self.joined.iter_mut().flat_map(|joined| &mut joined.writers);
            let settled: Vec<_> = writers.map(ZenohTopicWriter::settle).collect();
            for outcome in settled {
                self.count_write_error(outcome);
            }
            self.update_status();
            self.link.flush()?;
        }
    }

    async fn wait(&self) -> io::Result<()> {
        tokio::select! {
            ready = self.link.ready() => ready,
            () = self.wakeup.arrived() => Ok(()),
            () = sleep(TICK) => Ok(()),
        }
    }

    /// Carries out the gateway's orders since the last call. Returns true if one of them is to stop.
    fn obey(&mut self) -> io::Result<bool> {
        let received = orders::receive(&mut self.link, &self.settings)?;
        for number in received.pings {
            self.link.answer(&FromNetwork::Pong { number, has_echo: true, is_heard: true });
        }
        for (topic, order) in received.orders {
            self.carry_out(topic, order);
        }
        if let Some(parameters) = received.parameters {
            if let Some(JoinedSession { service_server: Some(server), .. }) = &mut self.joined {
                server.set_parameters(parameters.clone());
            }
            self.settings.set_parameters(parameters);
        }
        Ok(received.stop)
    }

    /// Carries out an order once there is a session, and stores it for the next session.
    fn carry_out(&mut self, topic: u16, order: Order) {
        let joined = self.joined.as_mut();
        if let Some(writer) = joined.and_then(|joined| joined.writers.get_mut(usize::from(topic))) {
            let done = writer.carry_out(&order);
            self.count_write_error(done);
        }
        if self.settings.is_kept(topic) {
            self.current.insert(topic, order);
        }
    }

    fn count_write_error(&mut self, written: zenoh::Result<()>) {
        if let Err(error) = written {
            if self.write_errors == 0 {
                tracing::warn!("Zenoh did not take a sample: {error}");
            }
            self.write_errors += 1;
        }
    }

    /// Passes received samples to the gateway while the link accepts them.
    fn receive(&mut self) {
        let former = self.replaced.iter().map(|(_, joined)| joined);
        let readers = former.chain(&self.joined).flat_map(|joined| (0..=u16::MAX).zip(&joined.readers));
        for (subscription, reader) in readers {
            while self.link.waiting() < MAX_WAITING {
                let Some(arrival) = reader.take() else { break };
                match &arrival {
                    Ok(arrived) => self.link.answer(&FromNetwork::Sample(Sample {
                        subscription,
                        writer: arrived.attachment.gid,
                        number: arrived.attachment.number,
                        endian: arrived.message.endian,
                        bytes: arrived.message.bytes(),
                    })),
                    Err(reason) => {
                        self.link.answer(&FromNetwork::Unreadable(subscription, &reason.to_string()))
                    }
                };
            }
        }
    }

    /// Sends changes of the status to the gateway.
    fn update_status(&mut self) {
        if self.last_count.is_some_and(|at| at.elapsed() < COUNT_INTERVAL) {
            return;
        }
        self.last_count = Some(Instant::now());
        // Called regularly, since it also writes the lines about omitted lines.
        self.lost_lines = (self.log_losses)();
        let count = |kind, topics: &[TopicKey]| {
            let count = |topic| self.joined.as_ref().map_or(0, |joined| joined.graph.count(kind, topic));
            topics.iter().map(count).collect()
        };
        let status = NetworkStatus {
            readers: count(EndpointKind::Subscription, &self.keys.written),
            writers: count(EndpointKind::Publisher, &self.keys.read),
            other_writers: count(EndpointKind::Publisher, &self.keys.written),
            write_errors: self.write_errors,
            unanswered_requests: self.unanswered_requests,
            lost_lines: self.lost_lines,
            links: Some(ZenohLinks {
                unreachable: self.unreachable(),
                ..self.joined.as_ref().map(|joined| joined.graph.links()).unwrap_or_default()
            }),
            ..NetworkStatus::default()
        };
        if status != self.status {
            self.link.answer(&FromNetwork::Status(status.clone()));
            self.status = status;
        }
    }

    /// Returns the printable names of nodes that are present and not connected.
    fn unreachable(&self) -> Vec<String> {
        let mut names: Vec<_> = self.search.unreachable().take(MAX_NAMED.0).map(shown).collect();
        let others = self.search.unreachable().count() - names.len();
        if others > 0 {
            names.push(format!("{others} others"));
        }
        names
    }
}

/// Returns an untrusted name without control characters, and shortened.
fn shown(name: &str) -> String {
    name.escape_debug().take(MAX_NAMED.1).collect()
}
