//! Reads the keys that influence a decision, for the decider of a gateway and of a drive.

use std::sync::Arc;
use std::time::Duration;

use super::country::parameters;
use super::files::Files;
use super::reading::{ConfigKey, Fields, flag, key_rows, millis};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::DeciderSettings;
use turn_signal::inputs::AgeLimits;
use turn_signal::intersection::STANDING_LIMIT;
use turn_signal::min_duration::MinDurations;
use turn_signal::parameters::VehicleInfo;

key_rows! {
    MINIMUM_ON_MS: Duration = millis("minimum_on_ms", 0, 60_000).or_time(MinDurations::READABLE.minimum_on)
        .doc("shortest signal, {range}; only with \"improved\"");
    MINIMUM_GAP_MS: Duration = millis("minimum_gap_ms", 0, 60_000).or_time(MinDurations::READABLE.minimum_gap)
        .doc("shortest time between two signals, {range}; only with \"improved\"");
    STANDING_LIMIT_MS: Duration = millis("standing_limit_ms", 0, 3_600_000).or_time(STANDING_LIMIT)
        .doc("so long a standing vehicle announces a turn that is out of reach, {range}; only with \"improved\"");
    WAITS_FOR_JUNCTIONS: bool = flag("waits_for_junctions", true)
        .doc("a turn's signal waits until a junction is passed that offers the same side and is not taken, unless the country's law demands it earlier; only with \"improved\"");
}

pub(super) mod age_limits {
    use super::{AgeLimits, ConfigKey, Duration, Fields, key_rows, millis};

    key_rows! {
        ODOMETRY_MS: Duration = age("odometry_ms", AgeLimits::DEFAULT.odometry).doc("then NO_COMMAND");
        PLANNED_PATH_MS: Duration = age("planned_path_ms", AgeLimits::DEFAULT.planned_path).doc("then manoeuvres are left out");
        MANOEUVRE_MS: Duration = age("manoeuvre_ms", AgeLimits::DEFAULT.manoeuvre)
            .doc("planning factors; then the manoeuvre is left out");
        SCENARIO_MS: Duration = age("scenario_ms", AgeLimits::DEFAULT.scenario).doc("then NO_COMMAND, if it was ever received");
        HAZARD_REQUEST_MS: Duration = age("hazard_request_ms", AgeLimits::DEFAULT.hazard_request)
            .doc("then the hazard lights are NO_COMMAND, if it was ever received");
        OWN_COMMAND_MS: Duration = age("own_command_ms", AgeLimits::DEFAULT.own_command).doc("shadow: then nothing is compared");
    }

    const fn age(name: &'static str, default: Duration) -> ConfigKey<Duration> {
        millis(name, 10, 60_000).or_time(default)
    }

    pub(super) fn read(fields: &Fields<'_>) -> AgeLimits {
        AgeLimits {
            odometry: fields.read(&ODOMETRY_MS),
            planned_path: fields.read(&PLANNED_PATH_MS),
            manoeuvre: fields.read(&MANOEUVRE_MS),
            scenario: fields.read(&SCENARIO_MS),
            hazard_request: fields.read(&HAZARD_REQUEST_MS),
            own_command: fields.read(&OWN_COMMAND_MS),
        }
    }
}

/// Reads `country`, `parameters`, `minimum_on_ms`, `minimum_gap_ms`, `standing_limit_ms`,
/// `waits_for_junctions` and `age_limits`, for the given `compat` and a vehicle of these dimensions.
pub(super) fn decider(
    files: &dyn Files,
    fields: &Fields<'_>,
    compat: DeciderCompat,
    vehicle: VehicleInfo,
) -> DeciderSettings {
    let (country, parameters) = parameters(files, fields);
    let min_durations =
        MinDurations { minimum_on: fields.read(&MINIMUM_ON_MS), minimum_gap: fields.read(&MINIMUM_GAP_MS) };
    DeciderSettings {
        parameters,
        standing_limit: fields.read(&STANDING_LIMIT_MS),
        waits_for_junctions: fields.read(&WAITS_FOR_JUNCTIONS),
        country: country.map(Arc::new),
        min_durations,
        age_limits: fields.section("age_limits").read_all(age_limits::read),
        vehicle,
        ..DeciderSettings::deployed(compat)
    }
}
