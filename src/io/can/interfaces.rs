//! The CAN interfaces of the machine.

use std::fs;

use std::path::Path;

use super::link::is_can;

/// Names of the CAN interfaces that exist, ascending.
pub fn can_interfaces() -> Vec<String> {
    let Ok(entries) = fs::read_dir("/sys/class/net") else { return Vec::new() };
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut names: Vec<_> = names
        .filter(|name| Path::new(&format!("/sys/class/net/{name}/type")).exists() && is_can(name))
        .collect();
    names.sort_unstable();
    names
}
