//! `[reports]`: when and how reports are published.

use std::time::Duration;

use crate::config::reading::{Fields, Keywords, key_rows, keyword, number_as, text};
use gateway_base::near_miss::did_you_mean;
use gateway_core::vehicle_lights::binding::HazardBinding;
use gateway_core::vehicle_report::Publish;
use gateway_core::vehicle_status::gear::GearBinding;
pub use ros_transport::qos::Durability;

key_rows! {
    PUBLISH: bool = keyword("publish", IS_PERIODIC).or_text("periodic").doc("\"periodic\": at rate_hz and at once on a change; \"on_change\": on a change only");
    RATE_HZ: Duration = number_as("rate_hz", 0.1, 1000.0, "Hz", |hz| Some(Duration::from_secs_f64(1.0 / hz))).or_number(10.0)
        .doc("{range}; not allowed with \"on_change\"");
    DURABILITY: Durability = keyword("durability", DURABILITIES).or_text("transient_local").restart()
        .doc("a late joiner gets the current report; \"volatile\": it waits for the next");
    MAX_RATE_HZ: Duration = number_as("max_rate_hz", 1.0, 200.0, "Hz", |hz| Some(Duration::from_secs_f64(1.0 / hz))).or_number(50.0)
        .doc("greatest rate of the reports on velocity and steering, which follow the frames; {range}");
    GEAR_SOURCE: String = text("gear_source").example("\"lever\"").doc("the source of [gear] that the car has, where the profile describes several gearboxes");
    HAZARD_NOT_VISIBLE: bool = keyword("hazard_not_visible", IS_ACKNOWLEDGED).or_text("warn")
        .doc("status of hazard lights that no signal shows and that are never reported; \"acknowledged\": OK");
}

const DURABILITIES: Keywords<Durability> =
    &[("transient_local", Durability::TransientLocal), ("volatile", Durability::Volatile)];
/// Occasions of publishing; true for periodic reports.
const IS_PERIODIC: Keywords<bool> = &[("periodic", true), ("on_change", false)];

/// Statuses for hazard lights that are not visible; true if this is acknowledged.
const IS_ACKNOWLEDGED: Keywords<bool> = &[("warn", false), ("acknowledged", true)];

pub(super) struct ReportSettings {
    /// Publication of reports that change rarely.
    pub(super) publish: Publish,
    /// Their durability.
    pub(super) durability: Durability,
    /// Minimum time between two reports that follow the frames.
    pub(super) min_period: Duration,
    /// The only gear source to use.
    pub(super) gear_source: Option<String>,
}

/// Reads the section. `hazard` is the vehicle's binding, `None` if it was refused; a binding without visible
/// hazard lights is told whether this is acknowledged. `gear` is the binding of its gear, if it has one.
pub(super) fn reports(
    fields: &Fields<'_>,
    hazard: Option<&mut HazardBinding>,
    gear: Option<&GearBinding>,
) -> ReportSettings {
    let is_accepted = fields.read(&HAZARD_NOT_VISIBLE);
    if let Some(hazard) = hazard {
        if let HazardBinding::NotVisible { is_acknowledged } = hazard {
            *is_acknowledged = is_accepted;
        } else if is_accepted {
            let reason = "the vehicle profile does not say [hazard] from = \"not_visible\"";
            fields.refuse(HAZARD_NOT_VISIBLE.name, reason, "remove the key");
        }
    }
    let durability = fields.read(&DURABILITY);
    let period = fields.read(&RATE_HZ);
    let publish = if fields.read(&PUBLISH) {
        Publish::Periodic(period)
    } else {
        if fields.has(RATE_HZ.name) {
            let remedy = "remove it, or use publish = \"periodic\"";
            fields.refuse("rate_hz", "reports on change have no rate", remedy);
        }
        Publish::OnChange
    };
    let min_period = fields.read(&MAX_RATE_HZ);
    ReportSettings { publish, durability, min_period, gear_source: gear_source(fields, gear) }
}

/// Reads the name of the gear source, which must be in the profile.
fn gear_source(fields: &Fields<'_>, gear: Option<&GearBinding>) -> Option<String> {
    let chosen = fields.given(&GEAR_SOURCE)?;
    let names: Vec<_> =
        gear.iter().flat_map(|gear| &gear.sources).map(|source| source.name.as_str()).collect();
    if !names.contains(&chosen.as_str()) {
        let all = format!(
            "the profile has {}",
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        );
        let reason = format!("the vehicle profile has no gear source {chosen}");
        fields.refuse(GEAR_SOURCE.name, reason, &did_you_mean(&chosen, names, all));
    }
    Some(chosen)
}
