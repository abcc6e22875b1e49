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
//! Fast DDS 2.9 ignores RustDDS's dispose messages, which lack the key hash that it needs, so it keeps each
//! replaced writer (some 9 kB) until our participant leaves. Data is unaffected.
//!
//! # Outages
//!
//! RustDDS 0.15 discards repeated participant announcements by their sequence number, so the same participant
//! does not rediscover a peer that was silent for longer than its lease, and RustDDS's interface offers no
//! way to reset this. A peer that announces something new is rediscovered, but its readers and writers are
//! not matched. A new participant discovers the peer at once. But if our participant were simply rebuilt on
//! suspicion, the other peers would lose us for a moment, and a killed peer cannot be distinguished from a
//! peer behind a broken link. Therefore:
//!
//! * A peer that leaves properly, or that we never met, needs no action.
//! * While a peer is missing (its lease expired), a second, bare participant listens as a `DiscoveryProbe`.
//!   To the probe the peer is new, so the probe can discover it.
//! * When it does, and only then, the probe becomes our participant: it gets writers with their current
//!   samples, and readers; the old participant leaves once all its peers have found the new one, which may
//!   itself have been replaced meanwhile. No other peer misses a sample; some receive one twice. Samples
//!   received twice are recognised by their number (`io::ros::reception` of the program).
//! * A killed peer costs the probe's two idle threads until it is given up after a day.
//! * An interface or address that did not exist when the participant was created replaces the participant in
//!   the same way, since sockets join multicast groups, and addresses are announced, only at the start. A
//!   link that comes up while a peer is missing renews the probe, which then announces itself at once instead
//!   of within 10 s.
//! * If hosts have no multicast between them, Cyclone must know our address (`Peers`) and must not forget it
//!   (`PruneDelay="inf"`): RustDDS cannot be given addresses, and a new participant has a new port. Cyclone
//!   polls such ports every 30 s. Within one host this is not needed.
//! * A peer that forgot us while we still know it stops acknowledging; see `ack_timeout.rs`.

mod ack_timeout;
mod discovery_probe;
mod echo;
mod graph;
mod history;
mod interfaces;
mod joining;
mod loopback_announcer;
mod participant;
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
mod witness;

mod worker;

use std::io;

use crate::link::{Link, LostLines, NetworkSettings};
use crate::orders::refuse;
pub use survey::survey;
use worker::DdsWorker;

/// Serves the gateway with a DDS participant until the gateway orders to stop.
pub(crate) async fn serve(
    settings: NetworkSettings,
    link: Link,
    lost_lines: fn() -> LostLines,
) -> io::Result<()> {
    match joining::join(&settings) {
        Ok(joined) => DdsWorker::new(settings, joined, link, lost_lines).run().await,
        Err(reason) => refuse(&reason, link).await,
    }
}
