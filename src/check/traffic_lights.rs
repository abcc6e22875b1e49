//! What a check says of traffic-light states received over CAN.

use super::Report;
use crate::core::traffic_light::v2i_reception::binding::{Group, V2iBinding, V2iStates};
use crate::core::trust::table::Role;
use crate::core::trust::words::role_words;

/// Lists every source with its groups.
pub(super) fn sources(binding: &V2iBinding, report: &mut Report) {
    for source in &binding.sources {
        match &source.states {
            V2iStates::Single(group) => one_group(binding, group, "v2i", &format!("{}", group.id), report),
            V2iStates::Cycling(cycle) => {
                let [intersection, group] =
                    [cycle.intersection, cycle.group].map(|signal| &binding.table.signals[signal.0].name);
                let limit = cycle.timeout.as_millis();
                let text =
                    format!("{intersection} and {group}: a group is unknown after {limit} ms without it");
                report.line("v2i", &text);
                for ((intersection, number), group) in &cycle.groups {
                    let what = format!("{} is group {number} of intersection {intersection}", group.id);
                    one_group(binding, group, "", &what, report);
                }
            }
        }
        for role in &source.status {
            let name = |good| if good { "usable" } else { "not usable" }.to_owned();
            values(binding, role, "states", name, report);
        }
    }
}

fn one_group(binding: &V2iBinding, group: &Group, heading: &str, what: &str, report: &mut Report) {
    report.line(heading, what);
    values(binding, &group.state, "v2i", |bulbs| bulbs.to_string(), report);
    if let Some(confidence) = &group.confidence {
        let name = &binding.table.signals[confidence.role.signal.0].name;
        report.line("", &format!("{name}: confidence, {} is full", confidence.full));
    }
}

fn values<T: Copy>(
    binding: &V2iBinding,
    role: &Role<T>,
    subject: &str,
    name: impl Fn(T) -> String,
    report: &mut Report,
) {
    let words = role_words(role, subject.to_owned(), name);
    let values: Vec<_> = words.named.iter().map(|(range, text)| format!("{range} {text}")).collect();
    let signal = &binding.table.signals[role.signal.0].name;
    report.line("", &format!("{signal}: {}; anything else is invalid", values.join(", ")));
}
