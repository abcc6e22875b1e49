//! `[reports]`: when and how reports are published.

use std::time::Duration;

use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::core::vehicle_lights::report::Publish;

const DEFAULT_RATE_HZ: f64 = 10.0;

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

/// Reads the section: when reports are published, and their durability.
pub(super) fn reports(fields: Fields<'_>) -> (Publish, Durability) {
    let durability = fields.keyword("durability", DURABILITIES).unwrap_or_default();
    let rate_hz = fields.number("rate_hz", 0.1..=1000.0, "Hz");
    let publish = if fields.keyword("publish", IS_PERIODIC).unwrap_or(true) {
        Publish::Periodic(Duration::from_secs_f64(1.0 / rate_hz.unwrap_or(DEFAULT_RATE_HZ)))
    } else {
        if rate_hz.is_some() {
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
