//! The interfaces of the machine, and those of CAN.

use std::fs;

use std::path::Path;

use super::link::is_can;

/// Names of the interfaces that exist, of CAN and others, ascending.
pub fn interfaces() -> Vec<String> {
    let Ok(entries) = fs::read_dir("/sys/class/net") else { return Vec::new() };
    let mut names: Vec<_> = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    names.sort_unstable();
    names
}

/// Names of the CAN interfaces that exist, ascending.
pub fn can_interfaces() -> Vec<String> {
    let mut names = interfaces();
    names.retain(|name| Path::new(&format!("/sys/class/net/{name}/type")).exists() && is_can(name));
    names
}
