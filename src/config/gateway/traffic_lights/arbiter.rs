//! `[traffic_lights.arbiter]`: what the arbiter makes of camera and V2I.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::core::traffic_light::arbiter::{ArbiterSettings, Priority};

/// `[traffic_lights.arbiter]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArbiterFile {
    /// Seconds.
    pub external_delay_tolerance_s: Option<Spanned<f64>>,
    /// Seconds.
    pub external_time_tolerance_s: Option<Spanned<f64>>,
    /// Seconds.
    pub perception_time_tolerance_s: Option<Spanned<f64>>,
    /// `confidence`, `external` or `perception`.
    pub source_priority: Option<Spanned<String>>,
    /// Only what both sides say counts.
    #[serde(default)]
    pub enable_signal_matching: bool,
}

/// Checks the section.
pub(super) fn arbiter(checker: &mut Checker<'_>, file: &ArbiterFile) -> ArbiterSettings {
    let mut settings = ArbiterSettings { matching: file.enable_signal_matching, ..Default::default() };
    let tolerances = [
        (&file.external_delay_tolerance_s, &mut settings.external_delay_tolerance),
        (&file.external_time_tolerance_s, &mut settings.external_time_tolerance),
        (&file.perception_time_tolerance_s, &mut settings.perception_time_tolerance),
    ];
    for (given, tolerance) in tolerances {
        let Some(given) = given else { continue };
        match Duration::try_from_secs_f64(*given.get_ref()) {
            Ok(value) if value <= Duration::from_secs(3600) => *tolerance = value,
            Ok(_) | Err(_) => {
                checker.refuse(given, format!("invalid tolerance {} s", given.get_ref()), "give 0 to 3600 s");
            }
        }
    }
    if let Some(given) = &file.source_priority {
        match Priority::named(given.get_ref()) {
            Some(priority) => settings.priority = priority,
            None => checker.refuse(
                given,
                format!("{:?} is not a priority", given.get_ref()),
                "give \"confidence\", \"external\" or \"perception\"",
            ),
        }
    }
    settings
}
