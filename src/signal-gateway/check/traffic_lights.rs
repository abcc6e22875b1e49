//! Checks the traffic lights: states received over CAN, and parts without effect.

use super::report::CheckReport;
use crate::config::Settings;
use can_signal::validation::display::role_texts;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::Role;
use gateway_core::v2i_reception::binding::{BoundGroup, V2iBinding, V2iStates};
use traffic_lights::bulb::{Bulb, Color};

pub(super) fn sources(binding: &V2iBinding, report: &mut CheckReport) {
    for source in &binding.sources {
        match &source.states {
            V2iStates::Single(group) => one_group(binding, group, "v2i", &format!("{}", group.id), report),
            V2iStates::Cycling(cycle) => {
                let [intersection, group] =
                    [cycle.intersection, cycle.group].map(|signal| &binding.table.signals[signal.0].name);
                let limit = cycle.timeout.as_millis();
                let text =
                    format!("{intersection} and {group}: a group is unknown after {limit} ms without it");
                report.line("v2i", text);
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

/// Returns notes on parts of a scenario or a profile that have no effect.
pub(super) fn notes(settings: &Settings) -> Vec<String> {
    let parts = settings.light_topics.not_interpreted.iter().map(ToString::to_string);
    let gateway = &settings.gateway;
    let lost = !gateway.v2i.is_empty() && gateway.traffic_lights.is_none();
    let text = "v2i: received states are not used, and no map checks their ids; add [traffic_lights] to the configuration";
    let lost = lost.then(|| text.to_owned());
    parts.chain(lost).chain(arrows(&gateway.v2i)).collect()
}

/// Returns a note for each id that can show a lit arrow in a colour other than green.
fn arrows(binding: &V2iBinding) -> impl Iterator<Item = String> {
    binding.groups().filter_map(|group| {
        let states = group.state.values.entries().iter().filter_map(|(_, meaning)| match meaning {
            Meaning::Defined(bulbs) => Some(bulbs.iter()),
            Meaning::NotAvailable | Meaning::Fault | Meaning::Undefined => None,
        });
        let stops = |bulb: &Bulb| matches!(bulb.color, Color::Red | Color::Yellow);
        let arrow = states
            .flatten()
            .find(|bulb| stops(bulb) && bulb.shape.is_arrow() && bulb.status.is_lit())?;
        let id = group.id;
        Some(format!(
            "v2i: {id} can show {arrow}: Autoware before April 2026 passes on an arrow of any colour; bind a circle"
        ))
    })
}

fn one_group(binding: &V2iBinding, group: &BoundGroup, heading: &str, what: &str, report: &mut CheckReport) {
    report.line(heading, what);
    values(binding, &group.state, "v2i", |bulbs| bulbs.to_string(), report);
    if let Some(confidence) = &group.confidence {
        let name = &binding.table.signals[confidence.role.signal.0].name;
        report.line("", format!("{name}: confidence, {} is full", confidence.full));
    }
}

fn values<T: Copy>(
    binding: &V2iBinding,
    role: &Role<T>,
    subject: &str,
    name: impl Fn(T) -> String,
    report: &mut CheckReport,
) {
    let texts = role_texts(role, subject.to_owned(), name);
    let values: Vec<_> = texts.named.iter().map(|(range, text)| format!("{range} {text}")).collect();
    let signal = &binding.table.signals[role.signal.0].name;
    report.line("", format!("{signal}: {}; anything else is invalid", values.join(", ")));
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::files::Disk;
    use crate::config::load_profile;
    use can_signal::validation::meaning::{RawRange, ValueMap};
    use can_signal::validation::table::SignalIndex;
    use gateway_core::v2i_reception::binding::V2iSource;
    use traffic_lights::text::parse_bulbs;

    #[test]
    fn a_red_or_yellow_arrow_is_noted() {
        let noted = |state: &str| {
            let values = vec![(RawRange::single(1), Meaning::Defined(parse_bulbs(state).unwrap()))];
            let state = Role { signal: SignalIndex(0), values: ValueMap::new(values).unwrap() };
            let states = V2iStates::Single(BoundGroup { id: 7, state, confidence: None });
            let sources = vec![V2iSource { states, status: Vec::new() }];
            arrows(&V2iBinding { sources, ..V2iBinding::default() }).collect::<Vec<_>>()
        };
        assert_eq!(noted("red, green left, yellow solidOff left"), [""; 0]);
        let arrow = "v2i: 7 can show yellow solidOn left: Autoware before April 2026 passes on an arrow of any \
                     colour; bind a circle";
        assert_eq!(noted("green left, yellow left"), [arrow]);
    }

    #[test]
    fn every_group_is_listed_with_its_states() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/v2x_unit.toml");
        let text =
            super::super::binding(&load_profile(&Disk, &path).unwrap()).text(crate::check::Layout::default());
        for part in [
            "message    V2X_SPAT (5A1) on v2x: cyclic, unknown after 250 ms of silence\n",
            "turn       not in the profile: never published, no diagnostics\n",
            "v2i        34806\n           V2X_NEXT.AHEAD: 0 not available, 1 red solidOn circle, 2 yellow",
            "a group is unknown after 2000 ms without it\n           35101 is group 1 of intersection 1201\n",
            "V2X_SPAT.CONFIDENCE: confidence, 100 is full\n",
            "V2X_SPAT.USABLE: 0 not usable, 1 usable; anything else is invalid\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
