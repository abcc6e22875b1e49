//! The network side at work: orders to publishers, samples to the gateway.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;
use tokio::time::sleep;
use zenoh::{Session, Wait};

use super::graph::Graph;
use super::keys::{EndpointKind, NextId, NodeKey, TopicKey};
use super::topic_reader::TopicReader;
use super::topic_writer::TopicWriter;
use crate::core::gateway::process_status::LostLines;
use crate::io::process_log;
use crate::io::ros::link::{FromNetwork, Link, NetworkSettings, NetworkStatus, Order, Sample};
use crate::io::ros::network::orders;
use crate::io::ros::network::wakeup::Wakeup;
use crate::io::ros::settings::{Transport, TypeHashes};
use crate::io::ros::zenoh_config;

/// Longest sleep between two looks at what is due.
const TICK: Duration = Duration::from_millis(100);
/// Time between two counts of endpoints and connections.
const COUNT_INTERVAL: Duration = Duration::from_millis(500);
/// Bytes that may wait for the gateway before samples stay in their queues, which keep the newest.
const MAX_WAITING: usize = 256 * 1024;

/// The names of what is written and read.
struct Keys {
    written: Vec<TopicKey>,
    read: Vec<TopicKey>,
}

/// A session with its endpoints.
struct Joined {
    session: Session,
    ids: NextId,
    writers: Vec<TopicWriter>,
    readers: Vec<TopicReader>,
    graph: Graph,
}

/// The network side's state.
pub(super) struct Worker {
    settings: NetworkSettings,
    keys: Keys,
    /// Ends the wait when something was received.
    wakeup: Arc<Wakeup>,
    /// A session that is being opened.
    opening: Option<Receiver<zenoh::Result<Session>>>,
    /// `None` until a session is open.
    joined: Option<Joined>,
    /// What is to be published once it is, of each topic but those delivered once.
    waiting: BTreeMap<u16, Order>,
    write_errors: u64,
    last_count: Option<Instant>,
    lost_lines: LostLines,
    /// The status that was sent last.
    status: NetworkStatus,
    /// Last: the gateway sees its end when everything else is gone.
    link: Link,
}

impl Keys {
    fn new(settings: &NetworkSettings, hashes: TypeHashes) -> Result<Self, String> {
        let key = |name: &str, (package, message): &(String, String)| {
            TopicKey::new(name, (package, message), hashes)
                .ok_or_else(|| format!("the hash of {package}/{message} is not known"))
        };
        let written = settings.written.iter().map(|topic| key(&topic.name, &topic.type_name));
        let read = settings.read.iter().map(|topic| key(&topic.name, &topic.type_name));
        Ok(Self { written: written.collect::<Result<_, _>>()?, read: read.collect::<Result<_, _>>()? })
    }
}

impl Joined {
    /// Declares everything on a session.
    fn new(
        session: Session,
        settings: &NetworkSettings,
        Keys { written, read }: &Keys,
        wakeup: &Arc<Wakeup>,
    ) -> zenoh::Result<Self> {
        let node = NodeKey {
            domain: settings.domain_id,
            session: session.zid().to_string(),
            namespace: if settings.namespace == "/" { String::new() } else { settings.namespace.clone() },
            node: settings.node.clone(),
        };
        let mut ids = NextId::default();
        let graph = Graph::new(&session, &node, settings.graph, written, read)?;
        let writers = settings.written.iter().zip(written);
        let writers =
            writers.map(|(topic, key)| TopicWriter::new(&session, &node, &mut ids, topic, key.clone()));
        let writers = writers.collect::<zenoh::Result<Vec<_>>>()?;
        let readers = settings.read.iter().zip(read);
        let readers = readers
            .map(|(topic, key)| TopicReader::new(&session, &node, &mut ids, topic, key, Arc::clone(wakeup)));
        let readers = readers.collect::<zenoh::Result<Vec<_>>>()?;
        Ok(Self { session, ids, writers, readers, graph })
    }

    /// Does it with the writer at a position, if there is one.
    fn act(
        &mut self,
        position: usize,
        act: impl FnOnce(&mut TopicWriter, &mut NextId) -> zenoh::Result<()>,
    ) -> zenoh::Result<()> {
        self.writers.get_mut(position).map_or(Ok(()), |writer| act(writer, &mut self.ids))
    }
}

impl Worker {
    /// A network side that has not joined the network.
    pub(super) fn new(settings: NetworkSettings, link: Link) -> Self {
        Self {
            settings,
            keys: Keys { written: Vec::new(), read: Vec::new() },
            wakeup: Arc::default(),
            opening: None,
            joined: None,
            waiting: BTreeMap::new(),
            write_errors: 0,
            last_count: None,
            lost_lines: LostLines::default(),
            status: NetworkStatus::default(),
            link,
        }
    }

    /// Gives the link back.
    pub(super) fn into_link(self) -> Link {
        self.link
    }

    /// Opens a session, whether there is a network or not; that of a client waits for a router, so that it is opened by a
    /// thread of its own. The error is a text for people.
    pub(super) fn open(&mut self) -> Result<(), String> {
        let Transport::Zenoh(zenoh) = &self.settings.transport else {
            return Err("not configured".to_owned());
        };
        let config = zenoh_config::parse(zenoh.config.as_deref()).map_err(|error| error.to_string())?;
        self.keys = Keys::new(&self.settings, zenoh.type_hashes)?;
        if !zenoh_config::waits_for_router(&config) {
            let session = zenoh::open(config).wait().map_err(|error| error.to_string())?;
            return self.join(session).map_err(|error| error.to_string());
        }
        let (sender, receiver) = channel();
        let wakeup = Arc::clone(&self.wakeup);
        let open = move || {
            // Nobody waits any more when the network side has ended.
            let _ = sender.send(zenoh::open(config).wait());
            wakeup.notify();
        };
        thread::Builder::new()
            .name("zenoh open".to_owned())
            .spawn(open)
            .map_err(|error| error.to_string())?;
        self.opening = Some(receiver);
        Ok(())
    }

    /// Declares everything on a session, and publishes what is current.
    fn join(&mut self, session: Session) -> zenoh::Result<()> {
        self.joined = Some(Joined::new(session, &self.settings, &self.keys, &self.wakeup)?);
        for (topic, order) in std::mem::take(&mut self.waiting) {
            self.carry_out(topic, order);
        }
        Ok(())
    }

    /// Works until the gateway says stop; an error is that of the link, whose other end is gone, or of a session that
    /// cannot be opened.
    pub(super) fn run(mut self, runtime: &Runtime) -> io::Result<()> {
        self.link.answer(&FromNetwork::Ready);
        self.link.flush()?;
        loop {
            runtime.block_on(self.wait())?;
            if let Some(opened) = self.opening.as_ref().and_then(|opening| opening.try_recv().ok()) {
                self.opening = None;
                opened.and_then(|session| self.join(session)).map_err(|error| {
                    tracing::warn!("no session of Zenoh can be opened: {error}");
                    io::Error::other(error.to_string())
                })?;
            }
            if self.obey()? {
                if let Some(joined) = &self.joined {
                    // What is left undeclared ends with the process.
                    let _ = joined.session.close().wait();
                }
                return Ok(());
            }
            self.receive();
            for position in 0..self.keys.written.len() {
                let settled = self.joined.as_mut().map(|joined| joined.act(position, TopicWriter::settle));
                self.count_write_error(settled.unwrap_or(Ok(())));
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

    /// Carries out what the gateway has ordered since the last call. Services for parameters are those of DDS. True if it
    /// says stop.
    fn obey(&mut self) -> io::Result<bool> {
        let received = orders::receive(&mut self.link, &self.settings)?;
        for number in received.pings {
            self.link.answer(&FromNetwork::Pong { number, has_echo: true });
        }
        for (topic, order) in received.orders {
            self.carry_out(topic, order);
        }
        Ok(received.stop)
    }

    /// Carries out an order, or keeps it until there is a session.
    fn carry_out(&mut self, topic: u16, order: Order) {
        if let Some(joined) = &mut self.joined {
            let done = joined.act(usize::from(topic), |writer, ids| writer.carry_out(&order, ids));
            self.count_write_error(done);
        } else if !self.settings.counts_each(topic) {
            self.waiting.insert(topic, order);
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

    /// Hands received samples on to the gateway while it takes them.
    fn receive(&mut self) {
        let readers = self.joined.iter().flat_map(|joined| &joined.readers);
        for (subscription, reader) in (0..=u16::MAX).zip(readers) {
            while self.link.waiting() < MAX_WAITING {
                let Some(arrival) = reader.take() else { break };
                match &arrival {
                    Ok(arrived) => self.link.answer(&FromNetwork::Sample(Sample {
                        subscription,
                        writer: arrived.attachment.gid,
                        number: arrived.attachment.number,
                        encoding: arrived.encoding,
                        bytes: arrived.bytes(),
                    })),
                    Err(reason) => self.link.answer(&FromNetwork::Unreadable(subscription, reason)),
                };
            }
        }
    }

    /// Tells the gateway what has changed.
    fn update_status(&mut self) {
        if self.last_count.is_some_and(|at| at.elapsed() < COUNT_INTERVAL) {
            return;
        }
        self.last_count = Some(Instant::now());
        // Asked for regularly, since that also writes the lines on what was left out.
        self.lost_lines = process_log::state().unwrap_or_default().lost_lines();
        let count = |kind, topics: &[TopicKey]| {
            let count = |topic| self.joined.as_ref().map_or(0, |joined| joined.graph.count(kind, topic));
            topics.iter().map(count).collect()
        };
        let status = NetworkStatus {
            readers: count(EndpointKind::Subscription, &self.keys.written),
            writers: count(EndpointKind::Publisher, &self.keys.read),
            write_errors: self.write_errors,
            lost_lines: self.lost_lines,
            links: Some(self.joined.as_ref().map(|joined| joined.graph.links()).unwrap_or_default()),
            ..NetworkStatus::default()
        };
        if status != self.status {
            self.link.answer(&FromNetwork::Status(status.clone()));
            self.status = status;
        }
    }
}
