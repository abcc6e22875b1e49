//! The process's part of a snapshot, for users and programs that watch the gateway. `docs/status.md`
//! describes its JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::configuration::ConfigurationState;
use super::log::LogState;
use super::network::NetworkFailure;
use super::recordings::RecorderState;
use gateway_core::provenance::ProvenanceSummary;
use ros_transport::link::ZenohLinks;

/// The current state of the gateway and of the process around it.
pub type Snapshot = gateway_core::gateway::snapshot::Snapshot<ProcessSnapshot>;

/// The process that the gateway runs in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ProcessSnapshot {
    /// Name of the vehicle profile.
    pub vehicle: String,
    /// How many facts of the vehicle profile have been verified, and which have not.
    pub provenance: ProvenanceSummary,
    /// Id of the process.
    pub pid: u32,
    /// Time since its start, ms.
    pub uptime_ms: u64,
    /// Version and origin of the binary.
    pub build: Build,
    /// Absolute path of the file that the gateway was started with; `None` from an older version.
    #[serde(default)]
    pub configuration_file: Option<String>,
    /// The configuration; `None` where it cannot be reloaded.
    pub configuration: Option<ConfigurationState>,
    /// Black-box files; `None` without a folder for them.
    pub black_box: Option<RecorderState>,
    /// Number of the next change of the history; a greater one than before means that there are new changes.
    #[serde(default)]
    pub next_change: u64,
    /// Log; `None` without one.
    pub log: Option<LogState>,
    /// ROS 2; `None` while it is off.
    pub ros: Option<RosSnapshot>,
}

/// The origin of a binary.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Build {
    /// Version of the package.
    pub version: String,
    /// Commit that it was built of; `None` where the build did not know it.
    pub commit: Option<String>,
    /// ROS 2 distribution; `None` in a build without ROS 2.
    pub distribution: Option<String>,
}

/// The connection to ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct RosSnapshot {
    /// Number of the domain, `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// True while the network side has joined the network and answers.
    pub is_up: bool,
    /// Times since start that the network side was replaced.
    pub restarts: u64,
    /// Why it ended the last time; `None` if it has not.
    pub last_failure: Option<NetworkFailure>,
    /// Time since it joined the network, ms; `None` while it is not up.
    pub joined_ms: Option<u64>,
    /// Memory in use by its process, bytes; `None` where that is not known.
    pub memory_bytes: Option<u64>,
    /// Topics that are written.
    pub written: Vec<TopicSnapshot>,
    /// Topics that are read.
    pub read: Vec<TopicSnapshot>,
    /// Connections of Zenoh; `None` with DDS, which has none.
    pub links: Option<ZenohLinks>,
    /// Participants whose lease ran out, until a new participant has found them.
    pub missing_peers: u64,
    /// Samples since start that could not be written.
    pub write_errors: u64,
}

/// A topic, and who is on its other end.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct TopicSnapshot {
    /// Absolute name of the topic.
    pub name: String,
    /// Readers of a topic that is written, writers of one that is read.
    pub peers: u64,
    /// Writers of other nodes on a topic that is written; 0 for one that is read.
    pub other_writers: u64,
}

impl TopicSnapshot {
    /// Creates a topic with no one on its other end.
    pub fn unmatched(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }
}
