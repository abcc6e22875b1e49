//! The properties of network interfaces that matter for DDS: IPv4 addresses and whether their links are up.

use std::collections::BTreeSet;
use std::net::{IpAddr, Ipv4Addr};

use if_addrs::IfAddr;

/// An address and the index of its interface. An interface that was unplugged and returned has a new index,
/// and multicast groups must be joined again.
type LocalAddress = (Ipv4Addr, Option<u32>);

/// The addresses at one point in time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Interfaces {
    addresses: BTreeSet<LocalAddress>,
    up: BTreeSet<LocalAddress>,
}

impl Interfaces {
    /// Returns the current addresses, limited to those in `only` unless that is empty. Returns `None` if the
    /// system does not list them.
    pub(super) fn now(only: &[IpAddr]) -> Option<Self> {
        let mut interfaces = Self::default();
        for interface in if_addrs::get_if_addrs().ok()? {
            let IfAddr::V4(address) = &interface.addr else { continue };
            if !only.is_empty() && !only.contains(&IpAddr::V4(address.ip)) {
                continue;
            }
            let address = (address.ip, interface.index);
            interfaces.addresses.insert(address);
            if interface.is_oper_up() {
                interfaces.up.insert(address);
            }
        }
        Some(interfaces)
    }

    /// Returns true if there is an address that was not present before.
    fn has_new_address_since(&self, before: &Self) -> bool {
        !self.addresses.is_subset(&before.addresses)
    }

    /// Returns true if an address of `before` is still present, on a link that is up.
    pub(super) fn still_serves(&self, before: &Self) -> bool {
        !self.up.is_disjoint(&before.addresses)
    }

    fn has_new_link_since(&self, before: &Self) -> bool {
        !self.up.is_subset(&before.up)
    }
}

/// Detects addresses that our participant was not created with.
pub(super) struct AddressWatch {
    /// The interfaces at the last check.
    pub(super) last: Interfaces,
    /// They were the same at the check before.
    is_settled: bool,
}

impl AddressWatch {
    pub(super) fn new(interfaces: Interfaces) -> Self {
        Self { last: interfaces, is_settled: false }
    }

    /// Reads the interfaces, limited to those in `only` unless that is empty. Returns true if a link has come
    /// up since the last check.
    pub(super) fn check(&mut self, only: &[IpAddr]) -> bool {
        let now = Interfaces::now(only).unwrap_or_else(|| self.last.clone());
        let link_came_up = now.has_new_link_since(&self.last);
        self.is_settled = now == self.last;
        self.last = now;
        link_came_up
    }

    /// Returns true if there is an address that was not present before. It counts once it was present at two
    /// checks, since interfaces get their addresses one by one.
    pub(super) fn is_new_since(&self, before: &Interfaces) -> bool {
        self.is_settled && self.last.has_new_address_since(before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(addresses: &[u32], up: &[u32]) -> Interfaces {
        let address = |index: &u32| (Ipv4Addr::new(10, 0, 0, 1), Some(*index));
        Interfaces {
            addresses: addresses.iter().map(address).collect(),
            up: up.iter().map(address).collect(),
        }
    }

    #[test]
    fn an_address_under_a_new_index_is_new_and_one_that_went_is_not() {
        let before = with(&[1, 2], &[1, 2]);
        assert!(!with(&[1], &[1]).has_new_address_since(&before));
        assert!(with(&[1, 3], &[1, 3]).has_new_address_since(&before));
    }

    #[test]
    fn a_link_that_comes_up_is_new_and_one_that_goes_down_is_not() {
        let before = with(&[1, 2], &[1]);
        assert!(!with(&[1, 2], &[]).has_new_link_since(&before));
        assert!(with(&[1, 2], &[1, 2]).has_new_link_since(&before));
        assert!(!with(&[1, 2], &[1, 2]).has_new_address_since(&before));
    }

    #[test]
    fn a_participant_is_served_while_one_of_its_addresses_is_up() {
        let made = with(&[1, 2], &[1]);
        assert!(with(&[2, 3], &[2, 3]).still_serves(&made));
        assert!(!with(&[1, 2, 3], &[3]).still_serves(&made));
        assert!(!with(&[], &[]).still_serves(&made));
    }

    #[test]
    fn the_loopback_is_found_and_a_limit_holds() {
        let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let here = Interfaces::now(&[loopback]).unwrap();
        assert!(!here.addresses.is_empty());
        assert!(here.addresses.iter().all(|(address, _)| *address == Ipv4Addr::LOCALHOST));
        let nobodys = IpAddr::V4(Ipv4Addr::new(192, 0, 2, 1));
        assert_eq!(Interfaces::now(&[nobodys]), Some(Interfaces::default()));
    }
}
