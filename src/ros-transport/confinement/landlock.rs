//! Landlock: restricts the network process's access to files, ports and other processes, whatever system
//! calls it has left.
//!
//! With DDS: no access. With Zenoh: read access to files with host names, certificates and libraries. A
//! client, which connects only to its routers, may connect to their ports and listen on none. A peer learns
//! the ports of others from the network, so its ports cannot be limited.

use std::collections::BTreeSet;

use landlock::{
    ABI, Access as _, AccessFs, AccessNet, NetPort, Ruleset, RulesetAttr as _, RulesetCreatedAttr as _,
    RulesetError, RulesetStatus, Scope, path_beneath_rules,
};

use super::error::ConfinementError;
use crate::settings::Transport;
#[cfg(feature = "zenoh")]
use crate::zenoh_config;

/// Requested restrictions: files, their truncation and devices, TCP, signals and abstract sockets. An older
/// kernel supports fewer.
const WANTED: ABI = ABI::V6;
/// Folders where the C library looks up names, users and its own parts.
#[cfg(feature = "zenoh")]
const READ: [&str; 6] = ["/etc", "/usr", "/lib", "/lib64", "/run/systemd/resolve", "/run/resolvconf"];

/// Access that an engine needs.
#[derive(Debug, Default, PartialEq, Eq)]
struct Needs {
    /// Files to read, and folders to read with all their content.
    files: Vec<String>,
    /// TCP ports to connect to; `None` if they are not known in advance.
    ports: Option<BTreeSet<u16>>,
}

/// Restricts this thread, and all threads that it starts.
pub(super) fn restrict(engine: &Transport) -> Result<(), ConfinementError> {
    match restricted(&needs(engine))? {
        RulesetStatus::FullyEnforced => Ok(()),
        RulesetStatus::PartiallyEnforced => Err(ConfinementError::Partial),
        RulesetStatus::NotEnforced => Err(ConfinementError::Absent),
    }
}

fn restricted(needs: &Needs) -> Result<RulesetStatus, RulesetError> {
    let reading = AccessFs::ReadFile | AccessFs::ReadDir;
    let mut rules = Ruleset::default().handle_access(AccessFs::from_all(WANTED))?;
    if needs.ports.is_some() {
        rules = rules.handle_access(AccessNet::from_all(WANTED))?;
    }
    let ports = needs.ports.iter().flatten().map(|port| Ok(NetPort::new(*port, AccessNet::ConnectTcp)));
    let rules = rules.scope(Scope::from_all(WANTED))?.create()?;
    let rules = rules.add_rules(path_beneath_rules(&needs.files, reading))?;
    Ok(rules.add_rules(ports.collect::<Vec<Result<_, RulesetError>>>())?.restrict_self()?.ruleset)
}

fn needs(engine: &Transport) -> Needs {
    match engine {
        Transport::Dds => Needs { files: Vec::new(), ports: Some(BTreeSet::new()) },
        #[cfg(not(feature = "zenoh"))]
        Transport::Zenoh(_) => Needs::default(),
        #[cfg(feature = "zenoh")]
        Transport::Zenoh(settings) => {
            let mut files: Vec<_> = READ.into_iter().map(str::to_owned).collect();
            let config = zenoh_config::parse(settings.config.as_deref());
            let Ok(config) = config else { return Needs { files, ports: None } };
            let texts = |key: &str| config.get_json(key).map(|json| texts(&json)).unwrap_or_default();
            // Uses the folders of the files, since a certificate is renewed by replacing its file.
            files.extend(texts("transport").iter().filter_map(|text| folder(text)));
            let endpoints = texts("connect/endpoints");
            // Without an endpoint, a client searches the network for routers, and connects to any.
            let is_limited = zenoh_config::waits_for_router(&config) && !endpoints.is_empty();
            let ports = endpoints.iter().map(|endpoint| port(endpoint)).collect::<Option<_>>();
            Needs { files, ports: ports.filter(|_| is_limited) }
        }
    }
}

#[cfg(feature = "zenoh")]
fn texts(json: &str) -> Vec<String> {
    fn collect(value: serde_json::Value, texts: &mut Vec<String>) {
        use serde_json::Value::{Array, Bool, Null, Number, Object, String};
        match value {
            String(text) => texts.push(text),
            Array(values) => values.into_iter().for_each(|value| collect(value, texts)),
            Object(values) => values.into_iter().for_each(|(_, value)| collect(value, texts)),
            Null | Bool(_) | Number(_) => {}
        }
    }
    let mut found = Vec::new();
    collect(serde_json::from_str(json).unwrap_or_default(), &mut found);
    found
}

#[cfg(feature = "zenoh")]
fn folder(text: &str) -> Option<String> {
    let path = std::path::Path::new(text).parent().filter(|folder| folder.has_root())?;
    path.to_str().map(str::to_owned)
}

/// Returns the port of an endpoint such as `tls/router:7447?rel=1#so_sndbuf=65536`.
#[cfg(feature = "zenoh")]
fn port(endpoint: &str) -> Option<u16> {
    let address = endpoint.split(['?', '#']).next()?;
    address.rsplit_once(':')?.1.parse().ok()
}

#[cfg(all(test, feature = "zenoh"))]
mod tests {
    use super::*;
    use crate::settings::{TypeHashes, ZenohSettings};

    fn zenoh(config: &str) -> Needs {
        let config = Some(config.to_owned());
        needs(&Transport::Zenoh(ZenohSettings { config, type_hashes: TypeHashes::Rihs01 }))
    }

    #[test]
    fn a_client_connects_to_the_ports_of_its_routers_and_reads_its_certificates() {
        let client = zenoh(
            "{ mode: 'client', connect: { endpoints: ['tls/[::1]:7447#iface=lo', 'tcp/router:9'] }, \
             transport: { link: { tls: { root_ca_certificate: '/srv/keys/ca.pem' } } } }",
        );
        assert_eq!(client.ports, Some(BTreeSet::from([7447, 9])));
        assert_eq!(client.files.last().map(String::as_str), Some("/srv/keys"));
        let of_mode =
            "{ mode: 'client', connect: { endpoints: { client: ['tcp/a:1'], peer: ['tcp/b:2'] } } }";
        assert_eq!(zenoh(of_mode).ports, Some(BTreeSet::from([1, 2])));
    }

    #[test]
    fn ports_that_are_not_known_beforehand_are_not_restricted() {
        assert_eq!(zenoh("{ mode: 'peer', connect: { endpoints: ['tcp/a:1'] } }").ports, None);
        assert_eq!(
            zenoh("{ mode: 'client', connect: { endpoints: ['unixsock-stream/tmp/a'] } }").ports,
            None
        );
        assert_eq!(needs(&Transport::Dds), Needs { files: vec![], ports: Some(BTreeSet::new()) });
    }
}
