//! The network side that speaks Zenoh, in the conventions of `rmw_zenoh` (its design document, "Mapping of
//! ROS 2 to Zenoh"): keys, tokens of the graph, and what is attached to each sample.
//!
//! Zenoh has threads of its own; what they receive waits in bounded queues for this one. It is only called
//! from outside of the runtime, because its calls wait for each other, which a runtime of one thread forbids.
//! It finds routers again by itself, and peers mostly; [`peer_search`] is about the others.
//!
//! A report that is withdrawn takes its publisher along: the cache for late readers belongs to it. The token
//! of the graph goes with it, and a new publisher is declared at once.
//!
//! Where a link is congested, Zenoh drops samples of topics that keep their last one, reliable or not. So a
//! report is repeated each second, with its stamp, and one that is lost is not missing for longer.

mod attachment;
mod graph;
mod keys;
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

/// Serves the gateway with a session of Zenoh until it says stop.
pub(crate) fn serve(
    runtime: &Runtime,
    settings: NetworkSettings,
    link: Link,
    log_losses: fn() -> LostLines,
) -> io::Result<()> {
    let mut worker = ZenohWorker::new(settings, link, log_losses);
    match worker.open() {
        Ok(()) => worker.run(runtime),
        Err(reason) => runtime.block_on(refuse(&reason, worker.into_link())),
    }
}
