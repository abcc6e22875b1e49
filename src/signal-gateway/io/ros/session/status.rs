//! State and counts of a session.

use std::sync::Arc;

use crate::io::ros::outgoing::Outgoing;
use crate::io::ros::reception::IncomingStatus;
use crate::process_status::network::NetworkState;

/// State and counts of a session since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RosStatus {
    /// False once the session's thread has ended; nothing is published then.
    pub running: bool,
    /// The published topics: the vehicle's lights, diagnostics, traffic lights in the order of the settings,
    /// the decider, the log.
    pub outgoing: Vec<OutgoingStatus>,
    /// The subscribed topics, in the order of the settings.
    pub incoming: Vec<IncomingStatus>,
    /// Number of participants whose lease ran out and that have not been found again.
    pub missing_peers: usize,
    /// True while a second participant of ours searches for them.
    pub has_probe: bool,
    /// Number of times our own participant was replaced.
    pub rebuilds: u32,
    /// Number of traffic-light emissions replaced by newer ones before they were sent, because DDS did not
    /// keep up.
    pub overtaken_lights: u64,
    /// Number of samples that RustDDS did not accept, or that could not be sent to it.
    pub write_errors: u64,
    /// Number of parameter requests that the present network side did not answer.
    pub unanswered_requests: u64,
    /// State of the network side.
    pub network: NetworkState,
}

/// State of a published topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutgoingStatus {
    /// Short name for texts, e.g. `turn`, `hazard`, `V2I lights`.
    pub label: &'static str,
    /// Absolute name of the topic.
    pub name: Arc<str>,
    /// True for a report on the vehicle, which only one node may publish.
    pub is_report: bool,
    /// Number of currently matched readers.
    pub readers: usize,
    /// Number of writers of other nodes at present.
    pub other_writers: usize,
}

impl OutgoingStatus {
    /// Creates the status of a topic without readers.
    pub(super) fn unread(outgoing: &Outgoing) -> Self {
        let (label, is_report) = (outgoing.label(), outgoing.is_report());
        Self { label, name: outgoing.name.as_str().into(), is_report, readers: 0, other_writers: 0 }
    }
}
