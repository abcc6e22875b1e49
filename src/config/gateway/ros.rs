//! `[ros]`: the node, its network, and the topics of the reports.

use std::net::IpAddr;
use std::ops::RangeInclusive;
use std::path::Path;

use super::reports::Durability;
use crate::config::files::Files;
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::config::reading::problem::cannot_read;
use crate::config::ros_names::RosOverrides;
use crate::config::ros_names::{Remapping, is_namespace};
use crate::io::ros::settings::{Transport, TypeHashes, ZenohSettings};
use crate::io::ros::zenoh_config;

/// Name of the node unless it is configured.
pub const DEFAULT_NODE: &str = "signal_gateway";
/// The topic of all nodes' logs; tools know it by this name only.
const LOG_TOPIC: &str = "/rosout";
/// The process needs a tenth of it, and the rest for what readers have not acknowledged.
const DEFAULT_MEMORY_MB: u32 = 384;
/// What serves a vehicle without traffic lights, and more than any map needs.
const MEMORY_LIMIT_MB: RangeInclusive<u32> = 128..=16_384;

/// Settings of the ROS 2 node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosConfig {
    /// False if `run` and `demo` publish nothing.
    pub enabled: bool,
    /// True if DDS runs in a process of its own; not a key of the file, since only debuggers want it otherwise.
    pub isolated: bool,
    /// The most private writable memory of that process, MB.
    pub memory_limit_mb: u32,
    /// Namespace, `/` or `/name`.
    pub namespace: String,
    /// Topics under other names, from the command line.
    pub remappings: Vec<Remapping>,
    /// Domain, when the configuration overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<u16>,
    /// False if the node is left out of the ROS 2 graph.
    pub graph: bool,
    /// Topic of warnings and errors; `None` if they are not published.
    pub rosout: Option<String>,
    /// Own addresses to use; all when empty.
    pub only_networks: Vec<IpAddr>,
    /// What carries the messages.
    pub transport: Transport,
    /// Durability of the two reports.
    pub durability: Durability,
    /// Topic of `TurnIndicatorsReport`.
    pub turn_indicators_status: String,
    /// Topic of `HazardLightsReport`.
    pub hazard_lights_status: String,
    /// Topic of `DiagnosticArray`.
    pub diagnostics: String,
}

/// True for Zenoh.
const TRANSPORTS: Keywords<bool> = &[("dds", false), ("zenoh", true)];
const TYPE_HASHES: Keywords<TypeHashes> =
    &[("rihs01", TypeHashes::Rihs01), ("not_supported", TypeHashes::NotSupported)];

/// Reads what carries the messages. Without Zenoh its section is looked at, but its file is not.
fn transport(files: &dyn Files, fields: &Fields<'_>) -> Transport {
    let is_zenoh = fields.keyword("transport", TRANSPORTS) == Some(true);
    let section = fields.section("zenoh");
    let path = section.path("config");
    let type_hashes = section.keyword("type_hashes", TYPE_HASHES).unwrap_or_default();
    let transport = if is_zenoh {
        if fields.has("only_networks") {
            let reason = "Zenoh has no own addresses to choose from";
            fields.refuse(
                "only_networks",
                reason,
                "remove it; `listen` and `connect` in the file of [ros.zenoh] config choose",
            );
        }
        let config = path.and_then(|path| zenoh_config(files, &section, &path));
        if let Err(error) = zenoh_config::check(config.as_deref()) {
            let key = if config.is_some() { "zenoh" } else { "transport" };
            fields.refuse(key, error.to_string(), error.remedy());
        }
        Transport::Zenoh(ZenohSettings { config, type_hashes })
    } else {
        Transport::Dds
    };
    section.done();
    transport
}

/// Reads Zenoh's own configuration.
fn zenoh_config(files: &dyn Files, section: &Fields<'_>, path: &Path) -> Option<String> {
    let text = files.read(path).map_err(|error| cannot_read(&error));
    let text = text.and_then(|bytes| {
        String::from_utf8(bytes).map_err(|error| format!("not UTF-8: {}", error.utf8_error()))
    });
    text.inspect_err(|reason| {
        let reason = format!("{}: {reason}", path.display());
        section.refuse(
            "config",
            reason,
            "give the path of a Zenoh configuration in JSON5, relative to this file",
        );
    })
    .ok()
}

/// Reads the section: the name of the node, and the rest; `durability` is that of the two reports.
pub(super) fn ros(
    files: &dyn Files,
    fields: Fields<'_>,
    durability: Durability,
    overrides: &RosOverrides,
) -> (String, RosConfig) {
    let node = fields.ros_name("node", DEFAULT_NODE);
    let namespace = fields.string("namespace");
    if let Some(given) = namespace.as_ref().filter(|given| !is_namespace(&given.text)) {
        let reason = format!("{:?} is not a namespace", given.text);
        fields.refuse("namespace", reason, "write it as / or /vehicle");
    }
    let namespace = namespace.map_or("/".to_owned(), |given| given.text);
    let address = |value| {
        let given = fields.checker.string(value)?;
        fields.checker.accept(&given.location, given.text.parse(), "give IP addresses of this computer")
    };
    let rosout = fields.flag("rosout");
    let only_networks = fields.list("only_networks", "give a list of addresses").iter();
    let topics = fields.section("topics");
    let config = RosConfig {
        enabled: fields.flag("enabled").unwrap_or(true),
        isolated: true,
        memory_limit_mb: fields.number("memory_limit_mb", MEMORY_LIMIT_MB, "MB").unwrap_or(DEFAULT_MEMORY_MB),
        namespace: overrides.namespace.clone().unwrap_or(namespace),
        remappings: overrides.remappings.clone(),
        graph: fields.flag("graph").unwrap_or(true),
        rosout: overrides.rosout.or(rosout).unwrap_or(true).then(|| LOG_TOPIC.to_owned()),
        // Higher domains have no ports.
        domain_id: fields.number("domain_id", 0..=232, ""),
        only_networks: only_networks.filter_map(address).collect(),
        transport: transport(files, &fields),
        durability,
        turn_indicators_status: topics
            .topic("turn_indicators_status", "/vehicle/status/turn_indicators_status"),
        hazard_lights_status: topics.topic("hazard_lights_status", "/vehicle/status/hazard_lights_status"),
        diagnostics: topics.topic("diagnostics", "/diagnostics"),
    };
    topics.done();
    fields.done();
    (overrides.node.clone().unwrap_or(node), config)
}
