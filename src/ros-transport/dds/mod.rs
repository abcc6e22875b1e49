//! The network side that speaks DDS.
//!
//! DDS is RustDDS itself. Of `ros2-client` only the names of the ROS graph and `ros_discovery_info` in the
//! layout of the distribution are used, because its node brings endpoints that are not needed here, and
//! cannot take a publisher back.
//!
//! # Withdrawn reports
//!
//! A transient-local writer hands its last sample to whoever comes later. When a report is
//! withdrawn, the writer is therefore replaced by a new, empty one, after its readers have
//! acknowledged what was sent (or 100 ms). The readers meet the new writer during the silence; see
//! `topic_writer.rs` for a resume that comes sooner. A volatile writer hands nothing over and stays.
//!
//! Fast DDS 2.9 ignores RustDDS's dispose messages, which lack the key hash that it needs: it keeps
//! each replaced writer (some 9 kB) until our participant leaves. Data is unaffected.
//!
//! # Outages
//!
//! RustDDS 0.15 discards repeated participant announcements by their sequence number, so a peer
//! that was silent for longer than its lease is not found again by the same participant, and
//! nothing in RustDDS's interface makes it forget. A peer that announces something new is found again,
//! but its readers and writers are not matched. A new participant finds the peer at once. But
//! the other peers would lose us for a moment if ours were simply rebuilt on suspicion, and a
//! peer that was killed looks the same as one behind a broken link. So:
//!
//! * A peer that leaves orderly, or that we never met, needs nothing.
//! * While a peer is missing (its lease ran out), a second, bare participant listens as a
//!   `DiscoveryProbe`. The peer is new to it, so it can find it.
//! * When it does, and only then, the probe becomes our participant: it gets writers with what is
//!   current on them, and readers, and the old participant leaves when all its peers have found the
//!   new one, which may have been replaced in turn meanwhile. No other peer misses a sample; some get one
//!   twice. What we receive twice is recognised by its number (`io::ros::reception` of the program).
//! * A peer that was killed costs the probe's two idle threads until it is given up after a day.
//! * An interface or address that was not there when the participant was made replaces the
//!   participant in the same way: sockets join multicast groups, and addresses are announced, only
//!   at the start. A link that comes up while somebody is missing renews the probe, which then
//!   announces itself at once instead of within 10 s.
//! * Where hosts have no multicast between them, Cyclone must know our address (`Peers`) and not
//!   forget it (`PruneDelay="inf"`): RustDDS cannot be given addresses, and a new participant has a
//!   new port. Cyclone asks such ports every 30 s. Within one host this is not needed.
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

/// Serves the gateway with a participant of DDS until it says stop.
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
