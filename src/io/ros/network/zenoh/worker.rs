//! The network side at work: orders to publishers, samples to the gateway.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
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
use crate::io::ros::link::{FromNetwork, Link, NetworkSettings, NetworkStatus, Sample, ToNetwork};
use crate::io::ros::network::orders::{add, next_message};
use crate::io::ros::network::wakeup::Wakeup;
use crate::io::ros::settings::Transport;
use crate::io::ros::zenoh_config;

/// Longest sleep between two looks at what is due.
const TICK: Duration = Duration::from_millis(100);
/// Time between two counts of endpoints and connections.
const COUNT_INTERVAL: Duration = Duration::from_millis(500);
/// Bytes that may wait for the gateway before samples stay in their queues, which keep the newest.
const MAX_WAITING: usize = 256 * 1024;

/// A session with its endpoints.
pub(super) struct Joined {
    session: Session,
    ids: NextId,
    written: Vec<TopicKey>,
    read: Vec<TopicKey>,
    writers: Vec<TopicWriter>,
    readers: Vec<TopicReader>,
    graph: Graph,
    wakeup: Arc<Wakeup>,
}

/// The network side's state.
pub(super) struct Worker {
    settings: NetworkSettings,
    joined: Joined,
    write_errors: u64,
    last_count: Option<Instant>,
    lost_lines: LostLines,
    /// The status that was sent last.
    status: NetworkStatus,
    /// Last: the gateway sees its end when everything else is gone.
    link: Link,
}

/// Opens a session, whether there is a network or not. The error is a text for people.
pub(super) fn join(settings: &NetworkSettings) -> Result<Joined, String> {
    let Transport::Zenoh(zenoh) = &settings.transport else { return Err("not configured".to_owned()) };
    let config = zenoh_config::parse(zenoh.config.as_deref()).map_err(|error| error.to_string())?;
    let key = |name: &str, (package, message): &(String, String)| {
        TopicKey::new(name, (package, message), zenoh.type_hashes)
            .ok_or_else(|| format!("the hash of {package}/{message} is not known"))
    };
    let written = settings.written.iter().map(|topic| key(&topic.name, &topic.type_name));
    let written = written.collect::<Result<Vec<_>, _>>()?;
    let read = settings.read.iter().map(|topic| key(&topic.name, &topic.type_name));
    let read = read.collect::<Result<Vec<_>, _>>()?;
    open(settings, config, written, read).map_err(|error| error.to_string())
}

fn open(
    settings: &NetworkSettings,
    config: zenoh::Config,
    written: Vec<TopicKey>,
    read: Vec<TopicKey>,
) -> zenoh::Result<Joined> {
    let session = zenoh::open(config).wait()?;
    let node = NodeKey {
        domain: settings.domain_id,
        session: session.zid().to_string(),
        namespace: if settings.namespace == "/" { String::new() } else { settings.namespace.clone() },
        node: settings.node.clone(),
    };
    let (wakeup, mut ids) = (Arc::new(Wakeup::default()), NextId::default());
    let graph = Graph::new(&session, &node, settings.graph, &written, &read)?;
    let writers = settings.written.iter().zip(&written);
    let writers = writers.map(|(topic, key)| TopicWriter::new(&session, &node, &mut ids, topic, key.clone()));
    let writers = writers.collect::<zenoh::Result<Vec<_>>>()?;
    let readers = settings.read.iter().zip(&read);
    let readers = readers
        .map(|(topic, key)| TopicReader::new(&session, &node, &mut ids, topic, key, Arc::clone(&wakeup)));
    let readers = readers.collect::<zenoh::Result<Vec<_>>>()?;
    Ok(Joined { session, ids, written, read, writers, readers, graph, wakeup })
}

impl Worker {
    /// A network side that has joined the network.
    pub(super) fn new(settings: NetworkSettings, joined: Joined, link: Link) -> Self {
        Self {
            settings,
            joined,
            write_errors: 0,
            last_count: None,
            lost_lines: LostLines::default(),
            status: NetworkStatus::default(),
            link,
        }
    }

    /// Works until the gateway says stop; an error is that of the link, whose other end is gone.
    pub(super) fn run(mut self, runtime: &Runtime) -> io::Result<()> {
        self.link.answer(&FromNetwork::Ready);
        self.link.flush()?;
        loop {
            runtime.block_on(self.wait())?;
            if self.obey()? {
                // What is left undeclared ends with the process.
                let _ = self.joined.session.close().wait();
                return Ok(());
            }
            self.receive();
            for position in 0..self.joined.writers.len() {
                self.act(position, TopicWriter::settle);
            }
            self.update_status();
            self.link.flush()?;
        }
    }

    async fn wait(&self) -> io::Result<()> {
        tokio::select! {
            ready = self.link.ready() => ready,
            () = self.joined.wakeup.arrived() => Ok(()),
            () = sleep(TICK) => Ok(()),
        }
    }

    /// Carries out what the gateway has ordered since the last call, of each topic the newest unless each counts.
    /// True if it says stop.
    fn obey(&mut self) -> io::Result<bool> {
        self.link.read()?;
        let (mut orders, mut stop) = (BTreeMap::new(), false);
        while let Some(message) = next_message(&mut self.link)? {
            match message {
                ToNetwork::Order(topic, order) => add(&mut orders, topic, order, self.counts_each(topic)),
                // Services for parameters are those of DDS.
                ToNetwork::Parameters(_) => {}
                ToNetwork::Ping(number) => {
                    self.link.answer(&FromNetwork::Pong { number, has_echo: true });
                }
                ToNetwork::Stop => stop = true,
                ToNetwork::Start(_) => return Err(io::ErrorKind::InvalidData.into()),
            }
        }
        for (topic, order) in &orders {
            self.act(usize::from(*topic), |writer, ids| writer.carry_out(order, ids));
        }
        Ok(stop)
    }

    fn counts_each(&self, topic: u16) -> bool {
        let written = self.settings.written.get(usize::from(topic));
        written.is_some_and(|written| written.delivery.counts_each())
    }

    /// Does it with the writer at a position, if there is one, and counts an error.
    fn act(&mut self, position: usize, act: impl FnOnce(&mut TopicWriter, &mut NextId) -> zenoh::Result<()>) {
        let Joined { writers, ids, .. } = &mut self.joined;
        if let Some(Err(error)) = writers.get_mut(position).map(|writer| act(writer, ids)) {
            if self.write_errors == 0 {
                tracing::warn!("Zenoh did not take a sample: {error}");
            }
            self.write_errors += 1;
        }
    }

    /// Hands received samples on to the gateway while it takes them.
    fn receive(&mut self) {
        for (subscription, reader) in (0..=u16::MAX).zip(&self.joined.readers) {
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
        let Joined { written, read, graph, .. } = &self.joined;
        let status = NetworkStatus {
            readers: written.iter().map(|topic| graph.count(EndpointKind::Subscription, topic)).collect(),
            writers: read.iter().map(|topic| graph.count(EndpointKind::Publisher, topic)).collect(),
            write_errors: self.write_errors,
            lost_lines: self.lost_lines,
            links: Some(graph.links()),
            ..NetworkStatus::default()
        };
        if status != self.status {
            self.link.answer(&FromNetwork::Status(status.clone()));
            self.status = status;
        }
    }
}
