//! State and counts of a session.

use crate::io::ros::reception::IncomingStatus;
use crate::process_status::network::NetworkState;
use crate::process_status::snapshot::TopicSnapshot;
use ros_transport::link::NetworkStatus;

/// State and counts of a session since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RosStatus {
    /// False once the session's thread has ended; nothing is published then.
    pub running: bool,
    /// The published topics: the vehicle's lights, diagnostics, traffic lights in the order of the settings,
    /// the decider, the log.
    pub outgoing: Vec<TopicSnapshot>,
    /// The subscribed topics, in the order of the settings.
    pub incoming: Vec<IncomingStatus>,
    /// The last counts of the network side; all 0 while there is none.
    pub seen: NetworkStatus,
    /// Number of traffic-light emissions replaced by newer ones before they were sent, because DDS did not
    /// keep up.
    pub overtaken_lights: u64,
    /// Number of messages that could not be encoded or sent to the network side. With the samples that
    /// RustDDS did not accept, which `seen` counts, they are the errors of writing.
    pub send_errors: u64,
    /// State of the network side.
    pub network: NetworkState,
}
