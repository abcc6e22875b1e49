//! State and counts of a session.

use std::sync::Arc;

use crate::io::ros::outgoing::Outgoing;
use crate::io::ros::reception::IncomingStatus;
use crate::process_status::network::NetworkState;

/// State and counts of a session since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RosStatus {
    /// False when the session's thread has ended; nothing is published any more.
    pub running: bool,
    /// The topics that are written: the vehicle's lights, diagnostics, traffic lights in the order of the
    /// settings, the decider, the log.
    pub outgoing: Vec<OutgoingStatus>,
    /// The topics that are read, in the order of the settings.
    pub incoming: Vec<IncomingStatus>,
    /// Participants of the network whose lease ran out, until a new participant has found them.
    pub missing_peers: usize,
    /// True while a second participant listens for them.
    pub has_probe: bool,
    /// Times our own participant was replaced.
    pub rebuilds: u32,
    /// Emissions of traffic lights overtaken by a newer one because DDS did not keep up.
    pub overtaken_lights: u64,
    /// Samples that RustDDS did not take, or that could not be sent to it.
    pub write_errors: u64,
    /// Requests for parameters that the present network side did not answer.
    pub unanswered_requests: u64,
    /// State of the network side.
    pub network: NetworkState,
}

/// State of a topic that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutgoingStatus {
    /// Short name for people, e.g. `turn`, `hazard`, `V2I lights`.
    pub label: &'static str,
    /// Absolute name of the topic.
    pub name: Arc<str>,
    /// True for a report on the vehicle, which one node alone publishes.
    pub is_report: bool,
    /// Readers that are matched now.
    pub readers: usize,
    /// Writers of other nodes that are there now.
    pub other_writers: usize,
}

impl OutgoingStatus {
    /// Creates the status of a topic without readers.
    pub(super) fn unread(outgoing: &Outgoing) -> Self {
        let (label, is_report) = (outgoing.label(), outgoing.is_report());
        Self { label, name: outgoing.name.as_str().into(), is_report, readers: 0, other_writers: 0 }
    }
}
