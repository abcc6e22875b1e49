//! A summary of all elements that were not interpreted. Those that would change lights are refused.

use std::collections::BTreeMap;

use super::super::reader::ScenarioReader;
use crate::config::reading::{Element, Location};

/// Lists the elements and attributes that were not interpreted, once for each kind.
pub(super) fn list(root: &Element, reader: &mut ScenarioReader<'_>) {
    let mut kinds = BTreeMap::new();
    collect(root, &mut kinds);
    let mut changers = BTreeMap::new();
    collect_changers(root, false, &mut changers);
    for (element, remedy) in changers.into_values() {
        let reason = format!("{} changes traffic lights, and is not interpreted", element.name);
        reader.refuse(&element.location, reason, remedy);
    }
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

struct Leftover {
    location: Location,
    times: usize,
    elements: usize,
}

fn collect(element: &Element, kinds: &mut BTreeMap<String, Leftover>) {
    for attribute in element.attributes.iter().filter(|attribute| !attribute.is_interpreted.get()) {
        add(kinds, &attribute.location, 0);
    }
    if !element.is_text_interpreted.get() && !element.text.is_empty() {
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

const AS_ACTION: &str = "write it as OpenSCENARIO 1.0 or later, with TrafficSignals, or as a TrafficSignalAction in an \
                         InfrastructureAction";
const AS_STATES: &str =
    "give a TrafficSignalState for each light, since the lights of a group are in the road network's file";

/// Collects the first element of each kind that would change lights: of OpenSCENARIO 0.9 (`Signals`, and
/// `Signal` with `SetState` or `SetController`), and of later versions at a place where no version has it. In
/// every version their names contain `Signal`; so do conditions, which change nothing.
fn collect_changers<'e>(
    element: &'e Element,
    is_test: bool,
    kinds: &mut BTreeMap<String, (&'e Element, &'static str)>,
) {
    let has_states = element.children.iter().any(|child| child.name == "TrafficSignalState");
    for child in element.children.iter().filter(|child| !child.is_empty()) {
        let is_test = is_test || child.name == "ByState" || child.name.ends_with("Condition");
        let is_group = child.name == "TrafficSignalGroupState";
        let is_empty_list = child.name.ends_with("Signals") && child.children.is_empty();
        let is_changer =
            child.name.contains("Signal") && !is_test && !is_empty_list && !child.is_interpreted.get();
        // The states of the lights repeat the state of their group.
        if is_changer && !(is_group && has_states) {
            let kind = without_numbers(&child.location.key.to_string());
            kinds.entry(kind).or_insert((child, if is_group { AS_STATES } else { AS_ACTION }));
        } else {
            collect_changers(child, is_test, kinds);
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
