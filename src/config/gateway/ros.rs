//! `[ros]`: the node, its network, and the topics of the reports.

use std::net::IpAddr;
use std::ops::RangeInclusive;

use super::reports::Durability;
use crate::config::reading::fields::Fields;
use crate::config::ros_names::RosOverrides;
use crate::config::ros_names::{Remapping, is_namespace};

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
    /// Durability of the two reports.
    pub durability: Durability,
    /// Topic of `TurnIndicatorsReport`.
    pub turn_indicators_status: String,
    /// Topic of `HazardLightsReport`.
    pub hazard_lights_status: String,
    /// Topic of `DiagnosticArray`.
    pub diagnostics: String,
}

/// Reads the section: the name of the node, and the rest; `durability` is that of the two reports.
pub(super) fn ros(
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
