//! Lists the interfaces of the machine.

use std::fs;
use std::path::Path;

use super::link::is_can;

/// Returns the names of all interfaces, sorted.
pub fn interfaces() -> Vec<String> {
    let Ok(entries) = fs::read_dir("/sys/class/net") else { return Vec::new() };
    let mut names: Vec<_> = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    names.sort_unstable();
    names
}

/// Returns the names of the CAN interfaces, sorted.
pub fn can_interfaces() -> Vec<String> {
    let mut names = interfaces();
    names.retain(|name| Path::new(&format!("/sys/class/net/{name}/type")).exists() && is_can(name));
    names
}
