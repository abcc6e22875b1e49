//! `[traffic_lights.arbiter]`: the arbiter's selection from camera and V2I.

use std::time::Duration;

use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::core::traffic_light::arbiter::{ArbiterSettings, Priority};

const PRIORITIES: Keywords<Priority> = &[
    ("confidence", Priority::Confidence),
    ("external", Priority::External),
    ("perception", Priority::Perception),
];

/// Reads the section.
pub(super) fn arbiter(fields: Fields<'_>) -> ArbiterSettings {
    let default = ArbiterSettings::default();
    let seconds =
        |key, default| fields.number(key, 0.0..=3600.0, "s").map_or(default, Duration::from_secs_f64);
    let settings = ArbiterSettings {
        external_delay_tolerance: seconds("external_delay_tolerance_s", default.external_delay_tolerance),
        external_time_tolerance: seconds("external_time_tolerance_s", default.external_time_tolerance),
        perception_time_tolerance: seconds("perception_time_tolerance_s", default.perception_time_tolerance),
        priority: fields.keyword("source_priority", PRIORITIES).unwrap_or(default.priority),
        matching: fields.flag("enable_signal_matching").unwrap_or_default(),
    };
    fields.done();
    settings
}
