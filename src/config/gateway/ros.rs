//! `[ros]`: the node, its network, and the topics of the reports.

use std::net::IpAddr;

use serde::Deserialize;
use toml::Spanned;

use super::reports::Durability;
use crate::config::reading::checker::Checker;

const DEFAULT_NODE: &str = "signal_gateway";

/// `[ros]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RosFile {
    /// Whether `run` and `demo` publish at all.
    pub enabled: Option<bool>,
    /// Node name.
    pub node: Option<Spanned<String>>,
    /// Namespace.
    pub namespace: Option<Spanned<String>>,
    /// Overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<Spanned<u16>>,
    /// Own addresses to use; all when empty.
    #[serde(default)]
    pub only_networks: Vec<IpAddr>,
    /// Topic names.
    #[serde(default)]
    pub topics: TopicsFile,
}

/// `[ros.topics]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TopicsFile {
    /// `TurnIndicatorsReport`
    pub turn_indicators_status: Option<Spanned<String>>,
    /// `HazardLightsReport`
    pub hazard_lights_status: Option<Spanned<String>>,
    /// `DiagnosticArray`
    pub diagnostics: Option<Spanned<String>>,
}

/// What the configuration says of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosConfig {
    /// Whether to publish at all.
    pub enabled: bool,
    /// Namespace, `/` or `/name`.
    pub namespace: String,
    /// Domain, when the configuration overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<u16>,
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

/// The name of the node.
pub(super) fn node(checker: &mut Checker<'_>, file: &RosFile) -> String {
    checker.ros_name(file.node.as_ref(), DEFAULT_NODE)
}

/// Checks the section; `durability` is that of the two reports.
pub(super) fn ros(checker: &mut Checker<'_>, file: &RosFile, durability: Durability) -> RosConfig {
    let namespace = match &file.namespace {
        Some(root) if root.get_ref() == "/" => "/".to_owned(),
        namespace => checker.topic(namespace.as_ref(), "/"),
    };
    if let Some(domain) = file.domain_id.as_ref().filter(|domain| *domain.get_ref() > 232) {
        checker.refuse(domain, format!("domain {} has no ports", domain.get_ref()), "give 0 to 232");
    }
    let topics = &file.topics;
    let mut status =
        |given: &Option<_>, name| checker.topic(given.as_ref(), &format!("/vehicle/status/{name}"));
    RosConfig {
        enabled: file.enabled.unwrap_or(true),
        namespace,
        domain_id: file.domain_id.as_ref().map(|domain| *domain.get_ref()),
        only_networks: file.only_networks.clone(),
        durability,
        turn_indicators_status: status(&topics.turn_indicators_status, "turn_indicators_status"),
        hazard_lights_status: status(&topics.hazard_lights_status, "hazard_lights_status"),
        diagnostics: checker.topic(topics.diagnostics.as_ref(), "/diagnostics"),
    }
}
