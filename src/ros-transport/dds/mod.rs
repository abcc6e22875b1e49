//! The network side that speaks DDS.
//!
//! The DDS implementation is RustDDS itself. From `ros2-client` only the names of the ROS graph and
//! `ros_discovery_info` in the layout of the distribution are used, because its node adds unneeded endpoints
//! and cannot remove a publisher.
//!
//! # Withdrawn reports
//!
//! A transient-local writer sends its last sample to late readers. When a report is withdrawn, the writer is
//! therefore replaced by a new, empty one, after its readers have acknowledged all samples (or after 100 ms).
//! The readers discover the new writer during the silence; `topic_writer.rs` covers a resume that comes
//! sooner. A volatile writer sends no old samples, and stays.
//!
//! # Outages
//!
//! Most defects of RustDDS (`docs/development/rustdds.md`) are survived by a new participant, see
//! [`rebuild_cause`](crate::rebuild_cause). But if our participant were simply rebuilt on suspicion, the
//! other peers would lose us for a moment, and a killed peer cannot be distinguished from a peer behind a
//! broken link. Therefore:
//!
//! * A peer that leaves properly, or that we never met, needs no action.
//! * While a peer is missing (its lease expired), a second, bare participant listens as a `DiscoveryProbe`.
//!   When it discovers the peer, and only then, the probe becomes our participant: it gets writers with their
//!   current samples, and readers.
//! * A killed peer costs the probe's two idle threads until it is given up after a day.
//! * If hosts have no multicast between them, Cyclone must know our address (`Peers`) and must not forget it
//!   (`PruneDelay="inf"`): RustDDS cannot be given addresses, and a new participant has a new port. Cyclone
//!   polls such ports every 30 s. Within one host this is not needed.

mod ack_timeout;
mod dds_node;
mod discovery_probe;
mod echo;
mod graph;
mod history;
mod interfaces;
mod loopback_announcer;
mod participant;
mod participants;
mod pings;
mod recent_samples;
mod sample;
mod service_server;
mod set_back;
mod silence_probe;
mod silent_writers;
mod survey;
mod topic_reader;
mod topic_writer;
mod type_check;
mod watches;
mod witness;
mod worker;

use std::io;

use crate::link::{Link, LostLines, NetworkSettings};
use crate::orders::refuse;
use crate::processor_wait::ProcessorWait;
use participants::Participants;
pub use survey::survey;
use worker::DdsWorker;

/// Serves the gateway with a DDS participant until the gateway orders to stop. `processor` is that of the
/// calling thread.
pub(crate) async fn serve(
    settings: NetworkSettings,
    link: Link,
    lost_lines: fn() -> LostLines,
    processor: ProcessorWait,
) -> io::Result<()> {
    match Participants::join(&settings) {
        Ok(participants) => DdsWorker::new(settings, participants, link, lost_lines, processor).run().await,
        Err(reason) => refuse(reason, link).await,
    }
}
