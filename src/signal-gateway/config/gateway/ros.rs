//! `[ros]`: the node, its network, and the topics of the reports.

use std::net::IpAddr;
use std::path::Path;
use std::sync::LazyLock;

use super::in_effect::{DIGEST_START, digest};
use super::reports::Durability;
use super::topic_names::{TopicNames, written};
use crate::config::files::Files;
use crate::config::reading::{
    ConfigKey, Fields, Keywords, ValueShape, cannot_read, collection, flag, key_rows, keyword, other, text,
    whole,
};
use crate::config::ros_names::RosOverrides;
use crate::config::ros_names::{Remapping, is_name, is_namespace};
use crate::io::ros::topics::LOG_NAME;
use ros_transport::settings::{Transport, TypeHashes, ZenohSettings};
use ros_transport::zenoh_config;

/// Name of the node unless it is configured.
pub const DEFAULT_NODE: &str = "signal_gateway";

key_rows! {
    ENABLED: bool = flag("enabled", true).restart().doc("false: `run` and `demo` only log");
    NODE: String = other("node", || ValueShape::Text, ros_name, |text| Some(text.to_owned())).or_text(DEFAULT_NODE).restart()
        .doc("node name; diagnostics are named \"<node>: <task>\"");
    NAMESPACE: String = text("namespace").or_text("/").restart().doc("/ or /name");
    // Higher domains have no ports.
    DOMAIN_ID: u16 = whole("domain_id", 0, 232, "").example("0").restart()
        .doc("{range}; default: the environment's ROS_DOMAIN_ID, else 0");
    ONLY_NETWORKS: Vec<IpAddr> = collection("only_networks", || ValueShape::Texts, addresses).example("[\"127.0.0.1\"]").restart()
        .doc("own addresses to use; default: as ROS_LOCALHOST_ONLY and ROS_AUTOMATIC_DISCOVERY_RANGE say, else all");
    // The process needs a tenth of the default, and the rest for what readers have not acknowledged. The
    // range is from what serves a vehicle without traffic lights to more than any map needs.
    MEMORY_LIMIT_MB: u32 = whole("memory_limit_mb", 128, 16_384, "MB").or(384).restart()
        .doc("of the process that speaks DDS, {range}; more for thousands of traffic lights");
    TRANSPORT: bool = keyword("transport", TRANSPORTS).or_text("dds").restart()
        .doc("\"dds\", or \"zenoh\" in the conventions of rmw_zenoh: docs/fleet.md");
    ROSOUT: bool = flag("rosout", true).restart().doc("false: warnings and errors of the log do not go to /rosout");
    GRAPH: bool = flag("graph", true).restart()
        .doc("false: `ros2 node list` does not show the node; topics are as before, see docs/vehicle-lights.md");
}

pub(super) mod zenoh {
    use std::path::PathBuf;

    use crate::config::reading::{key_rows, keyword, path};
    use ros_transport::settings::TypeHashes;

    key_rows! {
        CONFIG: PathBuf = path("config").example("\"one_host.json5\"").restart()
            .doc("Zenoh's own configuration; default: a router on this computer, as rmw_zenoh expects it");
        TYPE_HASHES: TypeHashes = keyword("type_hashes", super::HASHES).or_text("rihs01").restart()
            .doc("Jazzy and later; \"not_supported\": Humble");
    }
}

pub(super) static TOPICS: LazyLock<Vec<ConfigKey<String>>> = LazyLock::new(|| written("ros.topics"));

/// Settings of the ROS 2 node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosConfig {
    /// False if `run` and `demo` publish nothing.
    pub enabled: bool,
    /// True if DDS runs in a separate process; not a key of the file, since only debuggers need the
    /// alternative.
    pub isolated: bool,
    /// Maximum private writable memory of that process, MB.
    pub memory_limit_mb: u32,
    /// Namespace, `/` or `/name`.
    pub namespace: String,
    /// Topics under other names, from the command line.
    pub remappings: Vec<Remapping>,
    /// Domain, if the configuration overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<u16>,
    /// False if the node is left out of the ROS 2 graph.
    pub graph: bool,
    /// Topic of warnings and errors; `None` if they are not published.
    pub rosout: Option<String>,
    /// Own addresses to use; all if empty.
    pub only_networks: Vec<IpAddr>,
    /// Transport of the messages.
    pub transport: Transport,
    /// Durability of the two reports.
    pub durability: Durability,
    /// Topics of the reports and of the diagnostics.
    pub topics: TopicNames,
}

/// Transports by keyword; true for Zenoh.
const TRANSPORTS: Keywords<bool> = &[("dds", false), ("zenoh", true)];
const HASHES: Keywords<TypeHashes> =
    &[("rihs01", TypeHashes::Rihs01), ("not_supported", TypeHashes::NotSupported)];

/// Reads the transport. Without Zenoh its section is checked, but its file is not read.
fn transport(files: &dyn Files, fields: &Fields<'_>) -> Transport {
    let is_zenoh = fields.read(&TRANSPORT);
    fields.section("zenoh").read_all(|section| {
        let (path, type_hashes) = (section.given(&zenoh::CONFIG), section.read(&zenoh::TYPE_HASHES));
        if !is_zenoh {
            // Unused settings are not in effect.
            section.record(&zenoh::CONFIG, "none");
            section.record(&zenoh::TYPE_HASHES, "none");
            return Transport::Dds;
        }
        if fields.has("only_networks") {
            let reason = "Zenoh has no own addresses to choose from";
            let remedy = "remove it; `listen` and `connect` in the file of [ros.zenoh] config choose";
            fields.refuse("only_networks", reason, remedy);
        }
        let config = path.and_then(|path| zenoh_config(files, section, &path));
        if let Err(error) = zenoh_config::check(config.as_deref()) {
            let key = if config.is_some() { "zenoh" } else { "transport" };
            fields.refuse(key, error.to_string(), error.remedy());
        }
        Transport::Zenoh(ZenohSettings { config, type_hashes })
    })
}

fn zenoh_config(files: &dyn Files, section: &Fields<'_>, path: &Path) -> Option<String> {
    let text = files.read(path).map_err(|error| cannot_read(&error));
    let text = text.and_then(|bytes| {
        String::from_utf8(bytes).map_err(|error| format!("not UTF-8: {}", error.utf8_error()))
    });
    if let Ok(text) = &text {
        // A file with different content is a different configuration.
        let content = digest(DIGEST_START, text.as_bytes());
        section.record(&zenoh::CONFIG, format!("#{content:016x}"));
    }
    let remedy = "give the path of a Zenoh configuration in JSON5, relative to this file";
    let text = text.map_err(|reason| format!("{}: {reason}", path.display()));
    section.checker.accept(section.at("config"), text, remedy)
}

/// Reads the section: the name of the node, and the rest; `durability` is for the two reports.
pub(super) fn ros(
    files: &dyn Files,
    fields: &Fields<'_>,
    durability: Durability,
    overrides: &RosOverrides,
) -> (String, RosConfig) {
    let node = overrides.node.clone().unwrap_or(fields.read(&NODE));
    let namespace = fields.read(&NAMESPACE);
    if !is_namespace(&namespace) {
        let reason = format!("{namespace:?} is not a namespace");
        fields.refuse(NAMESPACE.name, reason, "write it as / or /vehicle");
    }
    let namespace = overrides.namespace.clone().unwrap_or(namespace);
    let rosout = overrides.rosout.unwrap_or(fields.read(&ROSOUT));
    // The command line has priority.
    fields.record(&NODE, &node);
    fields.record(&NAMESPACE, &namespace);
    fields.record(&ROSOUT, rosout.to_string());
    let only_networks = fields.read(&ONLY_NETWORKS);
    let topics = fields.section("topics").read_all(|section| TopicNames::read(section, &TOPICS));
    let config = RosConfig {
        enabled: fields.read(&ENABLED),
        isolated: true,
        memory_limit_mb: fields.read(&MEMORY_LIMIT_MB),
        namespace,
        remappings: overrides.remappings.clone(),
        graph: fields.read(&GRAPH),
        rosout: rosout.then(|| LOG_NAME.to_owned()),
        domain_id: fields.given(&DOMAIN_ID),
        only_networks,
        transport: transport(files, fields),
        durability,
        topics,
    };
    (node, config)
}

fn addresses(fields: &Fields<'_>, key: &'static str) -> Vec<IpAddr> {
    let address = |value| {
        let given = fields.checker.string(value)?;
        fields.checker.accept(&given.location, given.text.parse(), "give IP addresses of this computer")
    };
    fields.list(key, "give a list of addresses").iter().filter_map(address).collect()
}

/// Reads the name of a node: letters, digits and underscores, not beginning with a digit.
fn ros_name(fields: &Fields<'_>, key: &'static str) -> Option<String> {
    let name = fields.string(key)?.text;
    if !is_name(&name) {
        let remedy = "use letters, digits and _, no digit first";
        fields.refuse(key, format!("{name:?} is not a ROS name"), remedy);
    }
    Some(name)
}
