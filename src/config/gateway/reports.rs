//! `[reports]`: when and how reports are published.

use std::time::Duration;

use crate::config::reading::{Fields, Keywords, key_rows, keyword, number_as};
use crate::core::vehicle_lights::binding::HazardBinding;
use crate::core::vehicle_report::Publish;

key_rows! {
    PUBLISH: bool = keyword("publish", IS_PERIODIC).or_text("periodic").doc("\"periodic\": at rate_hz and at once on a change; \"on_change\": on a change only");
    RATE_HZ: Duration = number_as("rate_hz", (0.1, 1000.0), "Hz", |hz| Some(Duration::from_secs_f64(1.0 / hz))).or_number(10.0)
        .doc("{range}; not allowed with \"on_change\"");
    DURABILITY: Durability = keyword("durability", DURABILITIES).or_text("transient_local").restart()
        .doc("a late joiner gets the current report; \"volatile\": it waits for the next");
    HAZARD_NOT_VISIBLE: bool = keyword("hazard_not_visible", IS_ACKNOWLEDGED).or_text("warn")
        .doc("status of hazard lights that no signal shows and that are never reported; \"acknowledged\": OK");
}

/// Durability of the reports' topics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// A late joiner gets the current report.
    #[default]
    TransientLocal,
    /// A late joiner waits for the next report.
    Volatile,
}

const DURABILITIES: Keywords<Durability> =
    &[("transient_local", Durability::TransientLocal), ("volatile", Durability::Volatile)];
/// Occasions of publishing; true for periodic reports.
const IS_PERIODIC: Keywords<bool> = &[("periodic", true), ("on_change", false)];

/// Statuses of hazard lights that are not visible; true for the one that accepts it.
const IS_ACKNOWLEDGED: Keywords<bool> = &[("warn", false), ("acknowledged", true)];

/// Reads the section: when reports are published, and their durability. `hazard` is the vehicle's binding, `None` if it was
/// refused; one without visible hazard lights learns whether this is acknowledged.
pub(super) fn reports(fields: Fields<'_>, hazard: Option<&mut HazardBinding>) -> (Publish, Durability) {
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
            fields.refuse(
                "rate_hz",
                "reports on change have no rate",
                "remove it, or use publish = \"periodic\"",
            );
        }
        Publish::OnChange
    };
    fields.done();
    (publish, durability)
}
