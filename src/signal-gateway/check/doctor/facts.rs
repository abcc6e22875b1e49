//! What is known of a set-up before it is judged. The facts are gathered by `cli::doctor`, printed with
//! `--json`, and read again by the tests.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::io::clock_state::ClockState;
use crate::io::ros::own_topics::OwnTopic;
use crate::io::service_state::ServiceState;
use can_signal::can::bus_survey::BusSurvey;
use can_signal::can::interface_state::InterfaceState;
use ros_transport::survey::DomainSurvey;

/// The variables of ROS 2 that are read from the environment.
pub const VARIABLES: [&str; 5] = [
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "RMW_IMPLEMENTATION",
];

/// A set-up.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Facts {
    /// Time for which buses and the domain were watched, ms.
    pub listened_ms: u64,
    /// The configuration file; `None` where only interfaces are examined.
    pub configuration: Option<ConfigurationFacts>,
    /// The configured interfaces, or those that were asked for.
    pub interfaces: Vec<InterfaceFacts>,
    /// All CAN interfaces of this computer, by name.
    pub known_interfaces: Vec<String>,
    /// The variables of ROS 2 that are set in this shell.
    pub environment: BTreeMap<String, String>,
    /// The ROS 2 side; `None` without a configuration that can be used.
    pub ros: Option<RosFacts>,
    /// The packaged service.
    pub service: Known<ServiceState>,
    /// The gateway that serves the status socket.
    pub running: RunningFacts,
    /// What this process and the service may do.
    pub permissions: PermissionFacts,
    /// The wall clock.
    pub clock: ClockState,
}

/// Something that was found out, or the reason why it was not.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Known<T> {
    /// What was found out.
    Yes(T),
    /// The reason why it was not, as the end of "not checked: …".
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
    /// Why it cannot be used; `None` if it can.
    pub problem: Option<ConfigurationProblem>,
}

/// Why a configuration cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConfigurationProblem {
    /// There is no such file.
    Missing,
    /// This user may not read it.
    Denied,
    /// It, or a file that it names, is refused: the first reason.
    Refused(String),
}

/// One interface.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InterfaceFacts {
    /// Name of its bus in the vehicle profile; empty without a configuration.
    #[serde(default)]
    pub bus: String,
    /// Whether the configuration sends commands there; `None` without a configuration.
    pub sends: Option<bool>,
    /// What the kernel reports.
    pub state: InterfaceState,
    /// What its bus shows.
    #[serde(default)]
    pub survey: Known<BusSurvey>,
}

/// The ROS 2 side of the configuration, and of the domain.
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
    /// The variable of the environment that cannot be followed, as text.
    pub problem: Option<String>,
    /// Topics that are written.
    pub written: Vec<OwnTopic>,
    /// Topics that are read.
    pub read: Vec<OwnTopic>,
    /// What discovery told of the domain.
    pub survey: Known<DomainSurvey>,
    /// What discovery told of the domain of this shell, where that is another one.
    pub shell_survey: Option<DomainSurvey>,
}

/// The gateway that runs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunningFacts {
    /// Path of the status socket.
    pub socket: String,
    /// Whether it answers.
    pub reach: Reach,
    /// Its domain; `None` while it publishes nothing.
    pub domain_id: Option<u16>,
    /// Topics that it writes.
    pub written: Vec<String>,
    /// Keys and files in which its configuration differs from the one that is examined; `None` if it does not
    /// tell.
    pub differences: Option<Vec<String>>,
}

/// Whether a status socket answers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// A gateway answers.
    Served,
    /// No gateway serves it.
    #[default]
    Absent,
    /// This user may not use it.
    Denied,
    /// What answers cannot be read.
    Unreadable,
}

/// What this process and the service may do.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PermissionFacts {
    /// The `errno` for a CAN socket; `None` if one can be opened.
    pub can_socket_errno: Option<i32>,
    /// Folders that the gateway writes into.
    pub folders: Vec<FolderFacts>,
    /// Files of the configuration in folders that the unit hides from the service.
    pub hidden_from_service: Vec<String>,
    /// Files of the configuration that the user of the service cannot read; `None` if that cannot be asked.
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
    /// Its path.
    pub path: String,
    /// Why this user cannot write into it; `None` if he can.
    pub problem: Option<String>,
}
