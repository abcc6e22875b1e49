//! The network side for Zenoh, in the conventions of `rmw_zenoh` (its design document,
//! "Mapping of ROS 2 to Zenoh"): keys, tokens of the graph, and attachments of samples.
//!
//! Zenoh has its own threads; received data waits in bounded queues for this thread. Zenoh is only called
//! from outside the runtime, because its calls wait for each other, which a single-threaded runtime forbids.
//! It reconnects to routers by itself, and usually to peers; [`peer_search`] handles the other peers.
//!
//! When a report is withdrawn, its publisher is removed, since the publisher holds the cache for late
//! readers. Its graph token is removed as well, and a new publisher is declared at once.
//!
//! On a congested link, Zenoh drops samples of topics that keep their last sample, reliable or not. So a
//! report is repeated each second, with its stamp, and a lost report is missing no longer than that.

mod attachment;
mod graph;
mod keys;
mod locked;
mod node_session;
mod payload;
mod peer_search;
mod router_query;
mod service_server;
mod topic_reader;
mod topic_writer;
mod worker;

use std::io;

use tokio::runtime::Runtime;

use crate::link::{Link, LostLines, NetworkSettings};
use crate::orders::refuse;
use worker::ZenohWorker;

/// Serves the gateway with a Zenoh session until the gateway orders to stop.
pub(crate) fn serve(
    runtime: &Runtime,
    settings: NetworkSettings,
    link: Link,
    log_losses: fn() -> LostLines,
) -> io::Result<()> {
    let mut worker = ZenohWorker::new(settings, link, log_losses);
    match worker.open() {
        Ok(()) => worker.run(runtime),
        Err(reason) => runtime.block_on(refuse(reason, worker.into_link())),
    }
}
