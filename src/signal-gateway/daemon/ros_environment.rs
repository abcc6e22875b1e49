//! Reads the environment variables of ROS 2 that concern the network.

use std::net::{IpAddr, Ipv4Addr};

use crate::config::gateway::RosConfig;

/// An environment variable of ROS 2 with an unsupported value.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosEnvironmentError {
    /// `ROS_DOMAIN_ID` is not a number from 0 to 232.
    #[error("ROS_DOMAIN_ID is {0:?}; set it to 0 to 232, or set [ros] domain_id")]
    DomainId(String),
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE` is neither `SUBNET` nor `LOCALHOST`.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is {0:?}; this node follows SUBNET and LOCALHOST: set one of them, or \
         [ros] enabled = false to publish nothing"
    )]
    DiscoveryRange(String),
}

/// The network settings from the configuration and the environment.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct RosNetwork {
    pub(super) domain_id: u16,
    /// Own addresses to use; all if empty.
    pub(super) only_networks: Vec<IpAddr>,
    /// Variables that have no effect, for the log.
    pub(super) warnings: Vec<&'static str>,
}

/// Combines configuration and environment; the configuration has priority. Fails for an unsupported value.
pub(super) fn network(
    ros: &RosConfig,
    variable: impl Fn(&str) -> Option<String>,
) -> Result<RosNetwork, RosEnvironmentError> {
    let variable = |name| variable(name).filter(|text| !text.is_empty());
    let domain_id = match (ros.domain_id, variable("ROS_DOMAIN_ID")) {
        (Some(domain_id), _) => domain_id,
        (None, None) => 0,
        (None, Some(text)) => {
            text.parse().ok().filter(|id| *id <= 232).ok_or(RosEnvironmentError::DomainId(text))?
        }
    };
    let is_local = match variable("ROS_AUTOMATIC_DISCOVERY_RANGE").as_deref() {
        Some("LOCALHOST") => true,
        None | Some("SUBNET" | "SYSTEM_DEFAULT") => variable("ROS_LOCALHOST_ONLY").as_deref() == Some("1"),
        Some(range) => return Err(RosEnvironmentError::DiscoveryRange(range.to_owned())),
    };
    let mut warnings = Vec::new();
    let mut only_networks = ros.only_networks.clone();
    if is_local && only_networks.is_empty() {
        only_networks.push(Ipv4Addr::LOCALHOST.into());
    } else if is_local && !only_networks.iter().all(IpAddr::is_loopback) {
        warnings.push(
            "ROS_LOCALHOST_ONLY or ROS_AUTOMATIC_DISCOVERY_RANGE is not followed: [ros] only_networks is set",
        );
    }
    if variable("ROS_STATIC_PEERS").is_some() {
        warnings.push(
            "ROS_STATIC_PEERS is not followed: this node is found over multicast, or by peers that list this computer; \
             [ros] only_networks chooses its networks",
        );
    }
    Ok(RosNetwork { domain_id, only_networks, warnings })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::files::{DEMO_CONFIG, Embedded};
    use crate::config::{Overrides, load};

    fn joined(
        only_networks: &[&str],
        domain_id: Option<u16>,
        environment: &[(&str, &str)],
    ) -> Result<RosNetwork, String> {
        let mut ros = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().ros;
        ros.only_networks = only_networks.iter().map(|address| address.parse().unwrap()).collect();
        ros.domain_id = domain_id;
        let value = |name: &str| environment.iter().find(|(known, _)| *known == name);
        let value = |name: &str| value(name).map(|(_, value)| (*value).to_owned());
        network(&ros, value).map_err(|error| error.to_string())
    }

    fn addresses(network: &RosNetwork) -> Vec<String> {
        network.only_networks.iter().map(IpAddr::to_string).collect()
    }

    #[test]
    fn local_discovery_is_the_loopback_unless_the_configuration_names_networks() {
        let range = "ROS_AUTOMATIC_DISCOVERY_RANGE";
        for (environment, expected) in [
            (vec![], vec![]),
            (vec![(range, "")], vec![]),
            (vec![(range, "SUBNET")], vec![]),
            (vec![(range, "SYSTEM_DEFAULT")], vec![]),
            (vec![(range, "LOCALHOST")], vec!["127.0.0.1"]),
            (vec![("ROS_LOCALHOST_ONLY", "1")], vec!["127.0.0.1"]),
            (vec![(range, "SUBNET"), ("ROS_LOCALHOST_ONLY", "1")], vec!["127.0.0.1"]),
            (vec![("ROS_LOCALHOST_ONLY", "0")], vec![]),
        ] {
            let network = joined(&[], None, &environment).unwrap();
            assert_eq!((addresses(&network), network.warnings.len()), (expected_of(&expected), 0));
        }
        for (own, warnings) in [("127.0.0.1", 0), ("10.0.0.1", 1)] {
            let network = joined(&[own], None, &[("ROS_LOCALHOST_ONLY", "1")]).unwrap();
            assert_eq!((addresses(&network), network.warnings.len()), (expected_of(&[own]), warnings));
        }
    }

    fn expected_of(addresses: &[&str]) -> Vec<String> {
        addresses.iter().map(|address| (*address).to_owned()).collect()
    }

    #[test]
    fn what_cannot_be_followed_is_refused_or_warned_of() {
        for range in ["OFF", "local"] {
            let refused = joined(&[], None, &[("ROS_AUTOMATIC_DISCOVERY_RANGE", range)]).unwrap_err();
            assert!(refused.contains(range) && refused.contains("[ros] enabled = false"), "{refused}");
        }
        let warnings = joined(&[], None, &[("ROS_STATIC_PEERS", "10.0.0.2;10.0.0.3")]).unwrap().warnings;
        assert!(matches!(warnings.as_slice(), [one] if one.contains("only_networks")), "{warnings:?}");
    }

    #[test]
    fn the_domain_is_that_of_the_configuration_else_of_the_environment() {
        let domain = |configured, given| {
            joined(&[], configured, &[("ROS_DOMAIN_ID", given)]).map(|network| network.domain_id)
        };
        assert_eq!((domain(Some(5), "7"), domain(None, "7"), domain(None, "")), (Ok(5), Ok(7), Ok(0)));
        assert_eq!(domain(Some(5), "many"), Ok(5));
        assert!(domain(None, "233").unwrap_err().contains("ROS_DOMAIN_ID"));
    }
}
