//! Facts about a set-up, the input of all checks. They are gathered by `cli::doctor`, printed with `--json`,
//! and read by the tests.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::io::clock_state::ClockState;
use crate::io::ros::own_topics::OwnTopic;
use crate::io::service_state::ServiceState;
use can_signal::can::bus_survey::BusSurvey;
use can_signal::can::interface_state::InterfaceState;
use ros_transport::survey::DomainSurvey;

/// Environment variables of ROS 2 that are read.
pub const VARIABLES: [&str; 5] = [
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "RMW_IMPLEMENTATION",
];

/// The facts about a set-up.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Facts {
    /// Time for which buses and the domain were observed, ms.
    pub listened_ms: u64,
    /// The configuration file; `None` if only interfaces are examined.
    pub configuration: Option<ConfigurationFacts>,
    /// The configured interfaces, or the requested interfaces.
    pub interfaces: Vec<InterfaceFacts>,
    /// All CAN interfaces of this computer, by name.
    pub known_interfaces: Vec<String>,
    /// Environment variables of ROS 2 that are set in this shell.
    pub environment: BTreeMap<String, String>,
    /// The ROS 2 side; `None` without a usable configuration.
    pub ros: Option<RosFacts>,
    /// The packaged service.
    pub service: Known<ServiceState>,
    /// The gateway that serves the status socket.
    pub running: RunningFacts,
    /// Permissions of this process and the service.
    pub permissions: PermissionFacts,
    /// The wall clock.
    pub clock: ClockState,
}

/// A fact, or the reason why it could not be determined.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Known<T> {
    /// The fact.
    Yes(T),
    /// Reason why it could not be determined, as the end of "not checked: …".
    No(String),
}

impl<T> Default for Known<T> {
    fn default() -> Self {
        Self::No("it was not asked".to_owned())
    }
}

/// The configuration file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConfigurationFacts {
    /// Path of the file.
    pub path: String,
    /// Name of its vehicle profile; empty if it cannot be used.
    pub vehicle: String,
    /// Reason why it cannot be used; `None` if it can.
    pub problem: Option<ConfigurationProblem>,
}

/// Reason why a configuration cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConfigurationProblem {
    /// The file does not exist.
    Missing,
    /// This user may not read it.
    Denied,
    /// The file, or a file that it names, is refused, for this first reason.
    Refused(String),
}

/// One interface.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InterfaceFacts {
    /// Name of its bus in the vehicle profile; empty without a configuration.
    #[serde(default)]
    pub bus: String,
    /// True if the configuration sends commands on the interface; `None` without a configuration.
    pub sends: Option<bool>,
    /// State as reported by the kernel.
    pub state: InterfaceState,
    /// Observed traffic of its bus.
    #[serde(default)]
    pub survey: Known<BusSurvey>,
}

/// Facts about ROS 2 in the configuration and in the domain.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RosFacts {
    /// False if nothing is published, `[ros] enabled = false`.
    pub enabled: bool,
    /// True with `transport = "zenoh"`.
    pub is_zenoh: bool,
    /// The domain of a gateway that is started from this shell.
    pub domain_id: u16,
    /// True if the configuration gives the domain.
    pub is_domain_configured: bool,
    /// Own addresses that are used; all if empty.
    pub only_networks: Vec<String>,
    /// Description of an environment variable with an unsupported value.
    pub problem: Option<String>,
    /// Published topics.
    pub written: Vec<OwnTopic>,
    /// Subscribed topics.
    pub read: Vec<OwnTopic>,
    /// Result of discovery in the domain.
    pub survey: Known<DomainSurvey>,
    /// Result of discovery in the domain of this shell, if it is a different domain.
    pub shell_survey: Option<DomainSurvey>,
}

/// Facts about the running gateway.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunningFacts {
    /// Path of the status socket.
    pub socket: String,
    /// Whether the socket answers.
    pub reach: Reach,
    /// Domain of the gateway; `None` while it publishes nothing.
    pub domain_id: Option<u16>,
    /// Topics that it publishes.
    pub written: Vec<String>,
    /// Keys and files in which its configuration differs from the examined configuration; `None` if it does
    /// not report them.
    pub differences: Option<Vec<String>>,
}

/// Whether a status socket answers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// A gateway answers.
    Served,
    /// No gateway serves the socket.
    #[default]
    Absent,
    /// This user may not use the socket.
    Denied,
    /// The answer cannot be read.
    Unreadable,
}

/// Permissions of this process and the service.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PermissionFacts {
    /// The `errno` for a CAN socket; `None` if one can be opened.
    pub can_socket_errno: Option<i32>,
    /// Folders that the gateway writes into.
    pub folders: Vec<FolderFacts>,
    /// Files of the configuration in folders that the unit hides from the service.
    pub hidden_from_service: Vec<String>,
    /// Files of the configuration that the user of the service cannot read; `None` if this cannot be
    /// determined.
    pub unreadable_for_service: Option<Vec<String>>,
    /// Interfaces on which some process sends commands.
    pub locked_interfaces: Vec<String>,
}

/// A folder that the gateway writes into.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FolderFacts {
    /// The key that names it, e.g. `[black_box] folder`.
    pub key: String,
    /// Path of the folder.
    pub path: String,
    /// Reason why this user cannot write into it; `None` if writing is possible.
    pub problem: Option<String>,
}
