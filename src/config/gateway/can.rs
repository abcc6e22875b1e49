//! `[can.*]`: the interface of each bus.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::config::vehicle::Vehicle;

const DEFAULT_RECEIVE_BUFFER: usize = 4 << 20;

/// The sections by the names of their buses.
pub(super) type CanFiles = BTreeMap<Spanned<String>, CanFile>;

/// `[can.<bus>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CanFile {
    /// SocketCAN interface; also the name in recordings.
    pub interface: Spanned<String>,
    /// Kernel receive buffer to ask for, bytes.
    pub receive_buffer_bytes: Option<Spanned<usize>>,
}

/// Interface and receive buffer of each bus of the vehicle, in its order.
pub(super) fn cans(
    checker: &mut Checker<'_>,
    sections: &CanFiles,
    vehicle: &Vehicle,
) -> Vec<(String, usize)> {
    let buses: Vec<_> = vehicle.buses.iter().map(|bus| bus.name.as_str()).collect();
    let known = buses.join(", ");
    for (name, _) in sections.iter().filter(|(name, _)| !buses.contains(&name.get_ref().as_str())) {
        checker.refuse(
            name,
            format!("the vehicle profile has no bus {}", name.get_ref()),
            &format!("it has {known}"),
        );
    }
    let mut taken: Vec<&str> = Vec::new();
    for can in sections.values() {
        let interface = can.interface.get_ref();
        if !is_interface_name(interface) {
            let remedy = "give 1 to 15 characters without spaces and slashes, e.g. can0";
            checker.refuse(&can.interface, format!("{interface:?} is not an interface name"), remedy);
        }
        if taken.contains(&interface.as_str()) {
            checker.refuse(
                &can.interface,
                format!("{interface} serves two buses"),
                "give each bus its own interface",
            );
        }
        taken.push(interface);
        let buffer = can.receive_buffer_bytes.as_ref();
        checker.in_range(
            buffer,
            &(4096..=1 << 30),
            "invalid buffer size {} bytes",
            "give 4096 to 1073741824",
        );
    }
    let mut cans = Vec::new();
    for bus in buses {
        match sections.get(bus) {
            Some(can) => {
                let buffer = can.receive_buffer_bytes.as_ref();
                cans.push((
                    can.interface.get_ref().clone(),
                    buffer.map_or(DEFAULT_RECEIVE_BUFFER, |bytes| *bytes.get_ref()),
                ));
            }
            None => checker.refuse_at(
                0..0,
                format!("bus {bus} of the vehicle profile has no interface"),
                &format!("add [can.{bus}] interface = \"can0\""),
            ),
        }
    }
    cans
}

/// As the kernel's `dev_valid_name`.
fn is_interface_name(name: &str) -> bool {
    (1..=15).contains(&name.len())
        && name != "."
        && name != ".."
        && name.chars().all(|char| char.is_ascii_graphic() && char != '/' && char != ':')
}
