//! Reads the keys that influence a decision, for the decider of a gateway and of a drive.

use std::sync::Arc;

use super::country::parameters;
use super::dimensions::vehicle;
use super::files::Files;
use super::reading::fields::Fields;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decider::DeciderSettings;
use crate::core::turn_signal::inputs::AgeLimits;
use crate::core::turn_signal::min_duration::MinDurations;

/// Longest signal, gap and age limit, ms.
const MAX_MS: u64 = 60_000;
/// Longest time that a vehicle may stand and still announce a turn, ms.
const MAX_STANDING_MS: u64 = 3_600_000;

/// Reads `country`, `parameters`, `minimum_on_ms`, `minimum_gap_ms`, `standing_limit_ms`, `waits_for_junctions`, `age_limits` and `vehicle`, for
/// the `compat` that is given.
pub(super) fn decider(files: &dyn Files, fields: &Fields<'_>, compat: DeciderCompat) -> DeciderSettings {
    let deployed = DeciderSettings::deployed(compat);
    let (country, parameters) = parameters(files, fields);
    let time = |key, default| fields.millis(key, 0..=MAX_MS).unwrap_or(default);
    let min_durations = MinDurations {
        minimum_on: time("minimum_on_ms", deployed.min_durations.minimum_on),
        minimum_gap: time("minimum_gap_ms", deployed.min_durations.minimum_gap),
    };
    let standing_limit = fields.millis("standing_limit_ms", 0..=MAX_STANDING_MS);
    let waits_for_junctions = fields.flag("waits_for_junctions");
    DeciderSettings {
        parameters,
        waits_for_junctions: waits_for_junctions.unwrap_or(deployed.waits_for_junctions),
        country: country.map(Arc::new),
        min_durations,
        standing_limit: standing_limit.unwrap_or(deployed.standing_limit),
        age_limits: age_limits(fields.section("age_limits")),
        vehicle: vehicle(fields.section("vehicle")),
        ..deployed
    }
}

fn age_limits(fields: Fields<'_>) -> AgeLimits {
    let limit = |key, default| fields.millis(key, 10..=MAX_MS).unwrap_or(default);
    let limits = AgeLimits {
        odometry: limit("odometry_ms", AgeLimits::DEFAULT.odometry),
        planned_path: limit("planned_path_ms", AgeLimits::DEFAULT.planned_path),
        manoeuvre: limit("manoeuvre_ms", AgeLimits::DEFAULT.manoeuvre),
        scenario: limit("scenario_ms", AgeLimits::DEFAULT.scenario),
        hazard_request: limit("hazard_request_ms", AgeLimits::DEFAULT.hazard_request),
        own_command: limit("own_command_ms", AgeLimits::DEFAULT.own_command),
    };
    fields.done();
    limits
}
