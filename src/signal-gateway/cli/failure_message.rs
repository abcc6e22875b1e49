//! Writes the reason why a command failed and what to type next, in the same words for every command.

use std::path::Path;

use super::failure::Failure;
use super::web::unusable_address;
use super::{messages, unreadable};
use crate::daemon::DaemonError;
use crate::io::can::interfaces::can_interfaces;
use crate::io::can::traffic::is_virtual;
use can_signal::can::{LinkState, link_text};
use gateway_base::near_miss::nearest;

pub(super) fn show(failure: &Failure) {
    match failure {
        Failure::Refused(refused) => messages::refused(refused),
        Failure::File(path, error) => unreadable::show(path, error),
        Failure::Written(path, error) => unreadable::show_unwritable(path, error),
        Failure::Daemon(DaemonError::NoLink { interface, state }) => {
            messages::error(&link_text(interface, *state), &remedy(interface, *state));
        }
        Failure::Daemon(DaemonError::Recording { file, error }) => unreadable::show(Path::new(file), error),
        Failure::PageAddress(address, error) => {
            let unusable = unusable_address(*address, error);
            messages::error(&unusable.text, &unusable.remedy);
        }
        Failure::Usage(_) | Failure::Environment(_) | Failure::Daemon(_) | Failure::System(_) => {
            messages::error(&failure.to_string(), "");
        }
    }
}

fn remedy(interface: &str, state: LinkState) -> String {
    match state {
        LinkState::Missing => {
            let names = can_interfaces();
            match (nearest(interface, names.iter().map(String::as_str)), names.as_slice()) {
                (Some(near), _) => format!("did you mean {near}?"),
                (None, []) => "there is no CAN interface at all: plug in the adapter, or make a virtual one: ip link add dev vcan0 type vcan".to_owned(),
                (None, names) => format!("of CAN there is {}", names.join(", ")),
            }
        }
        LinkState::NotCan => "`ip -details link` shows which one is".to_owned(),
        LinkState::Down => bring_up(interface, is_virtual(interface)),
        LinkState::Failed(_) | LinkState::Up | LinkState::Ended => String::new(),
    }
}

/// Returns the command that brings an interface up without sending anything, not even error frames if the bit
/// rate is wrong. A virtual interface refuses a bit rate.
fn bring_up(interface: &str, is_virtual: bool) -> String {
    let rate = if is_virtual { "" } else { " type can bitrate 500000 listen-only on" };
    format!("bring it up first: ip link set {interface} up{rate}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_rate_is_advised_for_hardware_only() {
        assert_eq!(bring_up("vcan0", true), "bring it up first: ip link set vcan0 up");
        assert_eq!(
            bring_up("can0", false),
            "bring it up first: ip link set can0 up type can bitrate 500000 listen-only on"
        );
    }
}
