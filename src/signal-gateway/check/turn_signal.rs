//! Lists the settings of the turn signal decider.

use super::map;
use super::report::CheckReport;
use crate::config::gateway::turn_signal::TurnSignalConfig;
use crate::io::ros::topics::SubscriptionKind;
use crate::report::text::plain_path;
use turn_signal::flow::DeciderRole;
use turn_signal::parameters::VehicleInfo;
use turn_signal::parameters::table::PARAMETERS;
use turn_signal::planner_input::FactorTopic;

pub(super) fn decider(decider: &TurnSignalConfig, report: &mut CheckReport) {
    let (flow, settings) = (&decider.flow, &decider.flow.decider);
    let role = match (decider.runs, flow.role) {
        (false, _) => "neither enabled nor shadow: does not run".to_owned(),
        (true, DeciderRole::Command) => "enabled: commands are published".to_owned(),
        (true, DeciderRole::Shadow { tolerance }) => {
            format!("shadow: nothing is published; decisions may differ for {} ms", tolerance.as_millis())
        }
    };
    report.line("decider", role);
    let map_path = plain_path(&decider.map);
    report.line("", format!("map {}", map::summary(&map_path, &flow.road)));
    map::tags(&flow.road, settings.compat, report);
    let rules = settings
        .country
        .as_ref()
        .map_or("as deployed".to_owned(), |country| format!("{} ({})", country.code, country.source));
    report.line("", format!("compat {}, rules {rules}", settings.compat.name()));
    let VehicleInfo { front_overhang_m, rear_overhang_m, left_m, right_m, .. } = settings.vehicle;
    let front_m = settings.vehicle.front_m();
    report.line(
        "",
        format!(
            "vehicle: front bumper {front_m:.2} m before the rear axle ({front_overhang_m:.2} m overhang), rear \
             {rear_overhang_m:.2} m behind it, sides {left_m:.3} and {right_m:.3} m"
        ),
    );
    let ms = |limit: std::time::Duration| limit.as_millis();
    let limits = settings.age_limits;
    report.line(
        "",
        format!(
            "one cycle every {} ms; too old after: odometry {}, planned path {}, manoeuvres {}, scenario {}, hazard \
             request {} ms",
            ms(flow.period),
            ms(limits.odometry),
            ms(limits.planned_path),
            ms(limits.manoeuvre),
            ms(limits.scenario),
            ms(limits.hazard_request),
        ),
    );
    for parameter in PARAMETERS.iter().take(SIGNAL_PARAMETERS) {
        report.line("", format!("{} = {}", parameter.name, parameter.value(&settings.parameters)));
    }
    let (read, written) = (|key| decider.inputs.name(key), |key| decider.outputs.name(key));
    for key in SubscriptionKind::DECIDER.into_iter().filter_map(|kind| Some(kind.row().key?.key)) {
        let name = if read(key).is_empty() { "no topic" } else { read(key) };
        report.line("", format!("{} from {name}", key.replace('_', " ")));
    }
    let modules = if read("planning_factors").is_empty() { 0 } else { FactorTopic::ALL.len() };
    report.line("", format!("planning factors of {modules} of {} modules", FactorTopic::ALL.len()));
    for (key, what) in [("markers", "markers"), ("planning_factors", "planning factor")] {
        if !written(key).is_empty() {
            report.line("", format!("{what} of what is signalled to {}", written(key)));
        }
    }
    if decider.publishes_commands() {
        let (turn, hazard) = (written("turn_command"), written("hazard_command"));
        report.line("", format!("commands to {turn} and {hazard}"));
    }
}

/// Number of parameters at the head of the table that determine when to signal.
const SIGNAL_PARAMETERS: usize = 14;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::files::TestFiles;
    use crate::config::{Overrides, load};

    const CROSSROADS: &str = include_str!("../../../tests/maps/crossroads.osm");

    #[test]
    fn settings_and_topics_of_the_decider_are_listed() {
        let text = "[turn_signal]\nmap = \"map.osm\"\nshadow = true\ncountry = \"DE\"\ncompat = \"upstream\"\n\
                    parameters.turn_signal_search_time = 2.5\ninputs.scenario = \"\"\n";
        let files = TestFiles(&[("gateway.toml", text), ("map.osm", CROSSROADS)]);
        let settings = load(&files, Path::new("gateway.toml"), &Overrides::default()).unwrap();
        let text = super::super::binding(&settings).text(crate::check::Layout::default());
        for part in [
            "decider    shadow: nothing is published; decisions may differ for 500 ms\n",
            "compat upstream, rules DE (StVO",
            "front bumper 3.79 m before the rear axle",
            "one cycle every 100 ms; too old after: odometry 500,",
            "turn_signal_search_time = 2.5\n",
            "turn_signal_roundabout_on_entry = None\n",
            "turn_signal_roundabout_on_exit = Right\n",
            "odometry from /localization/kinematic_state\n",
            "scenario from no topic\n",
            "planning factors of 8 of 8 modules\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(!text.contains("commands to"), "{text}");
    }
}
