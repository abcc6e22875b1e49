//! A summary of all elements that were not interpreted.

use std::collections::BTreeMap;

use super::super::reader::ScenarioReader;
use crate::config::reading::{Element, Location};

/// Lists the elements and attributes that were not interpreted, once for each kind.
pub(super) fn list(root: &Element, reader: &mut ScenarioReader<'_>) {
    let mut kinds = BTreeMap::new();
    collect(root, &mut kinds);
    for Leftover { location, times, elements, .. } in kinds.into_values() {
        let times = if times == 1 { "once".to_owned() } else { format!("{times} times") };
        let what = match elements {
            0 => times,
            1 => format!("{times}, 1 element"),
            _ => format!("{times}, {elements} elements"),
        };
        reader.leave_out(&location, &what);
    }
}

/// Elements or attributes of one kind.
struct Leftover {
    location: Location,
    times: usize,
    elements: usize,
}

fn collect(element: &Element, kinds: &mut BTreeMap<String, Leftover>) {
    for attribute in element.attributes.iter().filter(|attribute| !attribute.is_interpreted.get()) {
        add(kinds, &attribute.location, 0);
    }
    if !element.content.is_interpreted.get() && !element.content.text.is_empty() {
        add(kinds, &element.location, 0);
    }
    for child in &element.children {
        if child.is_interpreted.get() {
            collect(child, kinds);
        } else if !child.is_empty() {
            add(kinds, &child.location, child.count());
        }
    }
}

fn add(kinds: &mut BTreeMap<String, Leftover>, location: &Location, elements: usize) {
    let kind = without_numbers(&location.key.to_string());
    let leftover =
        kinds.entry(kind).or_insert_with(|| Leftover { location: location.clone(), times: 0, elements: 0 });
    leftover.times += 1;
    leftover.elements += elements;
}

/// Returns a path without positions: `Act[2]/Event[3]` becomes `Act/Event`.
fn without_numbers(path: &str) -> String {
    path.split('/').map(|step| step.split('[').next().unwrap_or(step)).collect::<Vec<_>>().join("/")
}
